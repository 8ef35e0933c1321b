"""Cases as the surrogate sees them: padded to five modes and four arcs, any number of tip nodes."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import Arc, ContactConfiguration, Segment
from sdm_core.permanent_contact.receptance import ContactReceptance
from sdm_core.rubbing_blade import RubbingBlade

MODES = 5
ARCS = 4


@dataclass(frozen=True)
class CaseBatch:
    """m cases of a blade in contact at a speed; K_e is not part of a case.

    The dynamics sees the tip only through G (DESIGN, fact 7), so a case is its frequencies,
    damping, G, speed and engagement. Modes beyond those a blade has are padded with ones the contact
    cannot reach (G_jj = 0).

    Attributes
    ----------
    omega
        Λ, rad/s, shape (m, 5).
    damping_ratio
        ξ, shape (m, 5).
    contact_matrix
        G, kg^-1, shape (m, 5, 5).
    speed_hz
        Ω, Hz, shape (m,).
    mode_count
        Modes the blade has, shape (m,).
    arcs
        Start and end of each arc of contact, revolutions, NaN where there is none, shape (m, 4, 2).
        Permanent contact is one arc from 0 to 1.
    arc_count
        Arcs there are, shape (m,): those beyond four are not in `arcs`. Zero where engagement is smooth.
    """

    omega: np.ndarray
    damping_ratio: np.ndarray
    contact_matrix: np.ndarray
    speed_hz: np.ndarray
    mode_count: np.ndarray
    arcs: np.ndarray
    arc_count: np.ndarray

    def __len__(self) -> int:
        return len(self.speed_hz)

    def __getitem__(self, index: slice | np.ndarray) -> CaseBatch:
        return CaseBatch(*(getattr(self, f.name)[index] for f in fields(self)))

    @classmethod
    def from_arrays(
        cls,
        omega: np.ndarray,
        damping_ratio: np.ndarray,
        contact_shape: np.ndarray,
        speed_hz: np.ndarray,
        arcs: np.ndarray | None = None,
    ) -> CaseBatch:
        """From Λ (m, n) in rad/s, ξ (n,) or (m, n), W^½V_bᵀ (m, r, n) in kg^-1/2, speeds (m,).

        Arcs have shape (m, a, 2); without them contact is permanent.

        Modes are sorted by frequency; a blade with more than five keeps its first five, and
        `DesignSpace.contains` refuses it by `mode_count`.
        """
        m, n = omega.shape
        damping = np.broadcast_to(damping_ratio, (m, n))
        order = order_of_modes(omega)
        omega_sorted = np.take_along_axis(omega, order, axis=1)
        damping_sorted = np.take_along_axis(damping, order, axis=1)
        shape = np.take_along_axis(contact_shape, order[:, None, :], axis=2)
        kept = order.shape[1]
        padded_omega = np.repeat(omega_sorted[:, -1:], MODES, axis=1)
        padded_damping = np.repeat(damping_sorted[:, -1:], MODES, axis=1)
        contact = np.zeros((m, MODES, MODES))
        padded_omega[:, :kept], padded_damping[:, :kept] = omega_sorted, damping_sorted
        contact[:, :kept, :kept] = np.swapaxes(shape, 1, 2) @ shape
        engaged, arc_count = _padded(np.tile([[0.0, 1.0]], (m, 1, 1)) if arcs is None else arcs)
        speed = np.asarray(speed_hz, dtype=float)
        return cls(padded_omega, padded_damping, contact, speed, np.full(m, n), engaged, arc_count)

    @classmethod
    def from_blade(
        cls, blade: Blade, contact: ContactConfiguration, speed_hz: np.ndarray, *, extrapolate: bool = False
    ) -> CaseBatch:
        """A blade in contact at many speeds.

        Smooth engagement has no arcs: `DesignSpace.contains` refuses it by `arc_count`.

        Raises
        ------
        InvalidInput
            For a node the blade has not got.
        OutOfSpeedRange
            Where the modal data do not reach.
        """
        root = np.sqrt(contact.weight_vector(blade.tip_nodes))
        omega, shape = blade.at_speeds(speed_hz, extrapolate=extrapolate)
        contact_shape = np.swapaxes(shape * root, 1, 2)
        arcs = np.broadcast_to(arcs_of(contact), (len(speed_hz), *arcs_of(contact).shape))
        return cls.from_arrays(omega, blade.damping_ratio, contact_shape, speed_hz, arcs)

    @classmethod
    def concatenate(cls, batches: list[CaseBatch]) -> CaseBatch:
        """One batch after another."""
        return cls(*(np.concatenate([getattr(b, f.name) for b in batches]) for f in fields(cls)))

    @property
    def compliance(self) -> np.ndarray:
        """G_jj/ω_j², m/N, shape (m, 5)."""
        return np.einsum("mjj->mj", self.contact_matrix) / self.omega**2

    @property
    def stiffness_scale(self) -> np.ndarray:
        """1/max_j(G_jj/ω_j²), N/m, shape (m,): κ = K_e / stiffness_scale; infinite without contact."""
        with np.errstate(divide="ignore"):
            return 1.0 / self.compliance.max(axis=1)

    @property
    def permanent(self) -> np.ndarray:
        """Where contact never ceases, shape (m,)."""
        return (self.arc_count == 1) & (np.nan_to_num(self.arcs[:, 0, 1] - self.arcs[:, 0, 0]) >= 1.0)

    @property
    def engaged_share(self) -> np.ndarray:
        """Share of the revolution in contact, the mean of γ; shape (m,)."""
        return np.nansum(self.arcs[:, :, 1] - self.arcs[:, :, 0], axis=1)

    def problem(self, i: int) -> RubbingBlade:
        """Case i for the exact core, with K_e = 0."""
        receptance = self.receptance(i)
        arcs: tuple[Arc, ...] | None = None
        segments: tuple[Segment, ...] = (Segment(1.0, True),)
        if not self.permanent[i]:
            held = self.arcs[i, : self.arc_count[i]]
            contact = ContactConfiguration({"tip": 1.0}, held.tolist())
            arcs, segments = contact.arcs, contact.segments
        return RubbingBlade(
            receptance.omega,
            receptance.damping_ratio,
            receptance.factor.T,
            float(self.speed_hz[i]),
            0.0,
            arcs,
            segments,
        )

    def receptance(self, i: int) -> ContactReceptance:
        """Receptance of case i at its contact nodes, for the exact core."""
        n = min(int(self.mode_count[i]), MODES)
        g = self.contact_matrix[i, :n, :n]
        value, vector = np.linalg.eigh(g)
        keep = value > 1e-13 * max(value.max(), 1e-300)
        factor = vector[:, keep] * np.sqrt(value[keep])
        return ContactReceptance(self.omega[i, :n], self.damping_ratio[i, :n], factor)


def order_of_modes(omega: np.ndarray) -> np.ndarray:
    """Places of the modes a case has, the lowest frequency first; shape (m, n), at most five, from (m, n)."""
    return np.argsort(omega, axis=1, kind="stable")[:, :MODES]


def arcs_of(contact: ContactConfiguration) -> np.ndarray:
    """Arcs of a contact as start and end in revolutions, touching ones as one; shape (a, 2).

    Turned so that the first starts at 0, which changes nothing about stability. None of them where engagement
    is smooth.
    """
    arcs: list[list[float]] = []
    at, touching = 0.0, False
    for segment in contact.segments:
        if segment.engaged and touching:
            arcs[-1][1] = at + segment.length
        elif segment.engaged:
            arcs.append([at, at + segment.length])
        at, touching = at + segment.length, segment.engaged
    return np.array(arcs).reshape(-1, 2)


def _padded(arcs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Four arcs each, NaN where there are fewer, and how many there are; from shape (m, a, 2)."""
    given = np.asarray(arcs, dtype=float)
    out = np.full((len(given), ARCS, 2), np.nan)
    kept = min(ARCS, given.shape[1])
    out[:, :kept] = given[:, :kept]
    return out, np.isfinite(given[:, :, 0]).sum(axis=1)

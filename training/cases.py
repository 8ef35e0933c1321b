"""Cases as the surrogate sees them: dimensionless, padded to five modes, any number of tip nodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.permanent_contact.receptance import ContactReceptance

MODES = 5


@dataclass(frozen=True)
class CaseBatch:
    """m cases of a blade at a speed in permanent contact; K_e is not part of a case.

    The dynamics sees the tip only through G (DESIGN, fact 7), so a case is its frequencies,
    damping, G and speed. Modes beyond those a blade has are padded with ones the contact cannot
    reach (G_jj = 0).

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
    """

    omega: np.ndarray
    damping_ratio: np.ndarray
    contact_matrix: np.ndarray
    speed_hz: np.ndarray
    mode_count: np.ndarray

    def __len__(self) -> int:
        return len(self.speed_hz)

    def __getitem__(self, index: slice | np.ndarray) -> CaseBatch:
        return CaseBatch(
            self.omega[index],
            self.damping_ratio[index],
            self.contact_matrix[index],
            self.speed_hz[index],
            self.mode_count[index],
        )

    @classmethod
    def from_arrays(
        cls,
        omega: np.ndarray,
        damping_ratio: np.ndarray,
        contact_shape: np.ndarray,
        speed_hz: np.ndarray,
    ) -> CaseBatch:
        """From Λ (m, n) in rad/s, ξ (n,) or (m, n), W^½V_bᵀ (m, r, n) in kg^-1/2 and speeds (m,).

        Modes are sorted by frequency; a blade with more than five keeps its first five, and
        `DesignSpace.contains` refuses it by `mode_count`.
        """
        m, n = omega.shape
        damping = np.broadcast_to(damping_ratio, (m, n))
        order = np.argsort(omega, axis=1, kind="stable")[:, :MODES]
        omega_sorted = np.take_along_axis(omega, order, axis=1)
        damping_sorted = np.take_along_axis(damping, order, axis=1)
        shape = np.take_along_axis(contact_shape, order[:, None, :], axis=2)
        kept = order.shape[1]
        padded_omega = np.repeat(omega_sorted[:, -1:], MODES, axis=1)
        padded_damping = np.repeat(damping_sorted[:, -1:], MODES, axis=1)
        contact = np.zeros((m, MODES, MODES))
        padded_omega[:, :kept], padded_damping[:, :kept] = omega_sorted, damping_sorted
        contact[:, :kept, :kept] = np.swapaxes(shape, 1, 2) @ shape
        return cls(padded_omega, padded_damping, contact, np.asarray(speed_hz, dtype=float), np.full(m, n))

    @classmethod
    def from_blade(
        cls, blade: Blade, contact: ContactConfiguration, speed_hz: np.ndarray, *, extrapolate: bool = False
    ) -> CaseBatch:
        """A blade in contact at many speeds; arcs of contact are not looked at.

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
        return cls.from_arrays(omega, blade.damping_ratio, contact_shape, speed_hz)

    @classmethod
    def concatenate(cls, batches: list[CaseBatch]) -> CaseBatch:
        """One batch after another."""
        names = ("omega", "damping_ratio", "contact_matrix", "speed_hz", "mode_count")
        return cls(*(np.concatenate([getattr(b, name) for b in batches]) for name in names))

    @property
    def compliance(self) -> np.ndarray:
        """G_jj/ω_j², m/N, shape (m, 5)."""
        return np.einsum("mjj->mj", self.contact_matrix) / self.omega**2

    @property
    def stiffness_scale(self) -> np.ndarray:
        """1/max_j(G_jj/ω_j²), N/m, shape (m,): κ = K_e / stiffness_scale; infinite without contact."""
        with np.errstate(divide="ignore"):
            return 1.0 / self.compliance.max(axis=1)

    def receptance(self, i: int) -> ContactReceptance:
        """Receptance of case i at its contact nodes, for the exact core."""
        n = min(int(self.mode_count[i]), MODES)
        g = self.contact_matrix[i, :n, :n]
        value, vector = np.linalg.eigh(g)
        keep = value > 1e-13 * max(value.max(), 1e-300)
        factor = vector[:, keep] * np.sqrt(value[keep])
        return ContactReceptance(self.omega[i, :n], self.damping_ratio[i, :n], factor)

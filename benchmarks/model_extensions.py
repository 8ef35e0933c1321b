"""What friction, tangential motion and a flexible casing would do to NASA rotor 37 (decisions 27 to 29).

Every extension keeps the equation det(I + K_e(1 − e^{−iωτ})F(iω)) = 0 and changes F alone:

    F = W^½ (V_n − εV_t)ᵀ (Λ² − ω² + 2iξΛω)⁻¹ (V_n + μV_t) W^½ + H_c(ω),

V_t the shapes in the direction of rotation, μ the coefficient of friction, ε the slope of the steady tip path
and H_c a casing's receptance where the blade is. Crossings: K_e = −1/(2 Re λ) where ωτ = 2 arg λ − π up to
turns, λ an eigenvalue of F, whose sign and phase are free here: F is not symmetric.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from rich.table import Table

from sdm_core.blade import Blade, example_blade
from sdm_core.boundary import boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.delay_equation import DelayEquation
from sdm_core.stability import stability

CONTACTS = {"LE": ("LE",), "TE": ("TE",), "both": ("LE", "TE")}
FRICTION = (-0.2, -0.1, 0.0, 0.1, 0.2)
SLOPES = (-0.01, 0.01)
SPEEDS_HZ = np.linspace(60.0, 300.0, 961)
# Rotor 37 turns against its +θ: its leading edge lies at the smaller θ, and a compressor blade leads with it.
SENSE_OF_ROTATION = -1.0
_POINTS_A_TURN = 40  # frequencies over which ωτ grows by 2π
_WIDTHS = np.sinh(np.linspace(-9.0, 9.0, 241)) / 8  # half widths of a resonance from its peak

Receptance = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Ring:
    """A casing as a thin free ring bending in its plane: nodal diameters from 2 (Love's inextensional modes).

    Attributes
    ----------
    radius, width, thickness
        m.
    young, density
        Pa, kg/m³.
    damping_ratio
        ξ of every mode.
    diameters
        Nodal diameters taken.
    """

    radius: float
    width: float
    thickness: float
    young: float = 110e9
    density: float = 4430.0
    damping_ratio: float = 5e-3
    diameters: tuple[int, ...] = tuple(range(2, 13))

    @property
    def omega(self) -> np.ndarray:
        """rad/s, shape (k,)."""
        n = np.array(self.diameters, dtype=float)
        bending = self.young * self.thickness**2 / (12 * self.density * self.radius**4)
        return np.sqrt(bending * n**2 * (n**2 - 1) ** 2 / (n**2 + 1))

    def receptance(self, w: np.ndarray, speed_hz: float) -> np.ndarray:
        """Σ_n φ_n²/2 [D(ω + nΩ) + D(ω − nΩ)] at the blade, m/N: each pair of modes seen from the rotor."""
        n = np.array(self.diameters, dtype=float)[:, None]
        area = self.width * self.thickness
        strength = 1 / (np.pi * self.density * area * self.radius * (1 + 1 / n**2))
        omega, turn = self.omega[:, None], 2 * np.pi * speed_hz * n

        def flexibility(nu: np.ndarray) -> np.ndarray:
            return 1 / (omega**2 - nu**2 + 2j * self.damping_ratio * omega * nu)

        return (strength / 2 * (flexibility(w + turn) + flexibility(w - turn))).sum(axis=0)


@dataclass(frozen=True)
class Extended:
    """One blade with an extended contact at one rotor speed.

    Attributes
    ----------
    omega, damping_ratio
        rad/s and 1, shape (n,).
    pushed, measured
        (V_n + μV_t)W^½ and (V_n − εV_t)W^½, kg^-1/2, shape (n, r).
    speed_hz
        Hz.
    casing
        None: rigid. With a casing one contact node is understood.
    """

    omega: np.ndarray
    damping_ratio: np.ndarray
    pushed: np.ndarray
    measured: np.ndarray
    speed_hz: float
    casing: Ring | None = None

    @classmethod
    def of(
        cls,
        blade: Blade,
        nodes: tuple[str, ...],
        speed_hz: float,
        friction: float = 0.0,
        slope: float = 0.0,
        casing: Ring | None = None,
    ) -> Extended:
        """With unit weight at nodes; tangential shapes are interpolated in Ω² like the others."""
        columns = [blade.tip_nodes.index(node) for node in nodes]
        omega, normal = blade.at_speeds(np.array([speed_hz]))
        squares = np.array([state.speed_hz**2 for state in blade.states])
        shapes = np.array([state.mode_shape_tangential for state in blade.states])
        weights = [np.prod([(speed_hz**2 - b) / (a - b) for b in squares if b != a]) for a in squares]
        tangential = SENSE_OF_ROTATION * np.einsum("s,snr->nr", weights, shapes)
        pushed = normal[0] + friction * tangential
        measured = normal[0] - slope * tangential
        return cls(omega[0], blade.damping_ratio, pushed[:, columns], measured[:, columns], speed_hz, casing)

    def eigenvalues(self, w: np.ndarray) -> np.ndarray:
        """λ of F, m/N, shape (k, r)."""
        h = 1 / (self.omega**2 - w[:, None] ** 2 + 2j * self.damping_ratio * self.omega * w[:, None])
        f = np.einsum("nr,kn,ns->krs", self.measured, h, self.pushed)
        if self.casing is not None:
            f = f + self.casing.receptance(w, self.speed_hz)[:, None, None]
        return f[:, :, 0] if f.shape[1] == 1 else np.linalg.eigvals(f)

    @property
    def frequencies(self) -> np.ndarray:
        """ω that resolve every resonance and every turn of ωτ, rad/s, ascending."""
        top = 1.5 * self.omega[-1]
        peaks = [self.omega[:, None] * (1 + self.damping_ratio[:, None] * _WIDTHS)]
        if self.casing is not None:
            ring = self.casing.omega[:, None] * (1 + self.casing.damping_ratio * _WIDTHS)
            turn = 2 * np.pi * self.speed_hz * np.array(self.casing.diameters)[:, None]
            peaks += [np.abs(ring + turn), np.abs(ring - turn)]
        step = 2 * np.pi * self.speed_hz / _POINTS_A_TURN
        every = np.concatenate([np.arange(step, top, step), *(p.ravel() for p in peaks)])
        return np.unique(every[(every > 0) & (every < top)])

    def critical_ke(self) -> tuple[float, float]:
        """First crossing in K_e, N/m, and its frequency, Hz."""
        w = self.frequencies
        lam = _followed(self.eigenvalues(w))
        left, right = np.repeat(w[:-1, None], lam.shape[1], 1), np.repeat(w[1:, None], lam.shape[1], 1)
        start, end = self._phase(left, lam[:-1]), self._phase(right, lam[1:])
        crossed = (start * end <= 0) & (np.abs(end - start) < np.pi)
        crossed &= np.minimum(lam[:-1].real, lam[1:].real) < 0
        a, b, at, fa = left[crossed], right[crossed], lam[:-1][crossed], start[crossed]
        for _ in range(50):
            middle = 0.5 * (a + b)
            every = self.eigenvalues(middle)
            here = every[np.arange(len(every)), np.abs(every - at[:, None]).argmin(axis=1)]
            value = self._phase(middle, here)
            same = value * fa > 0
            a, b = np.where(same, middle, a), np.where(same, b, middle)
            at, fa = np.where(same, here, at), np.where(same, value, fa)
        ke = np.where(at.real < 0, -0.5 / np.minimum(at.real, -1e-300), np.inf)
        least = int(ke.argmin())
        return float(ke[least]), float(a[least] / (2 * np.pi))

    def _phase(self, w: np.ndarray, lam: np.ndarray) -> np.ndarray:
        """ωτ + π − 2 arg λ, within half a turn."""
        return np.angle(-np.exp(1j * w / self.speed_hz) * (np.conj(lam) / np.abs(lam)) ** 2)

    def delay_equation(self, ke: float) -> DelayEquation:
        """The same without a casing, for semi-discretization: Γ need not be symmetric."""
        n = len(self.omega)
        damping = np.diag(2 * self.damping_ratio * self.omega)
        force = ke * self.pushed @ self.measured.T
        return DelayEquation.of_second_order(
            np.eye(n), damping, np.diag(self.omega**2), force, 1 / self.speed_hz
        )


def _followed(lam: np.ndarray) -> np.ndarray:
    """Two eigenvalues (k, 2) sorted so that each column is continuous."""
    if lam.shape[1] == 1:
        return lam
    out = lam.copy()
    straight = np.abs(np.diff(lam, axis=0)).sum(axis=1)
    across = np.abs(lam[1:] - lam[:-1, ::-1]).sum(axis=1)
    swapped = np.cumsum(across < straight) % 2 == 1
    out[1:][swapped] = lam[1:][swapped][:, ::-1]
    return out


def least_ke(blade: Blade, nodes: tuple[str, ...], **extension: float | Ring) -> tuple[float, float, float]:
    """Smallest K_e over `SPEEDS_HZ`, N/m, the speed and the chatter frequency there, Hz."""
    found = [(*Extended.of(blade, nodes, s, **extension).critical_ke(), s) for s in SPEEDS_HZ]  # type: ignore[arg-type]
    ke, chatter, speed = min(found)
    return ke, float(speed), chatter


def contradictions(blade: Blade) -> tuple[int, int]:
    """Verdicts of converged semi-discretization 0.5 % on either side that differ, and how many were asked."""
    wrong = asked = 0
    for nodes in CONTACTS.values():
        for friction, slope in ((-0.1, 0.0), (0.1, 0.0), (0.2, 0.0), (0.4, 0.0), (0.1, 0.01)):
            for speed in (120.0, 241.0):
                case = Extended.of(blade, nodes, speed, friction, slope)
                ke = case.critical_ke()[0]
                for factor, expected in ((0.995, True), (1.005, False)):
                    asked += 1
                    wrong += stability(case.delay_equation(factor * ke)).stable is not expected
    return wrong, asked


def table() -> Table:
    blade = example_blade("nasa_rotor_37")
    out = Table(
        "extension", *CONTACTS, title="NASA rotor 37, 60-300 Hz: smallest K_e [N/m] at Hz, chatter Hz"
    )

    def row(name: str, **extension: float | Ring) -> None:
        found = [least_ke(blade, nodes, **extension) for nodes in CONTACTS.values()]
        out.add_row(name, *(f"{ke:,.0f} at {speed:.1f}, {chatter:.0f}" for ke, speed, chatter in found))

    for friction in FRICTION:
        row(f"friction {friction:g}", friction=friction)
    for slope in SLOPES:
        row(f"tangential motion, slope {slope:g}", slope=slope)
    for thickness in (2e-3, 5e-3):
        ring = Ring(radius=0.25, width=0.05, thickness=thickness)
        found = [least_ke(blade, CONTACTS[name], casing=ring) for name in ("LE", "TE")]
        out.add_row(
            f"titanium ring of {1e3 * thickness:g} mm",
            *(f"{ke:,.0f} at {speed:.1f}, {chatter:.0f}" for ke, speed, chatter in found),
            "-",
        )
    exact = boundary(blade, ContactConfiguration.at("LE"), np.array([241.0]), 2.5e4).critical_ke[0]
    own = Extended.of(blade, ("LE",), 241.0).critical_ke()[0]
    wrong, asked = contradictions(blade)
    out.caption = (
        f"Without extension at 241 Hz, LE: {own:.4f} N/m, exact core {exact:.4f}. "
        f"With friction: {wrong} of {asked} verdicts 0.5 % off the boundary contradicted by "
        "semi-discretization."
    )
    return out

"""The linear delay equation with constant or periodic coefficients ([SBL] Eqs. 5-6)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sdm_core.errors import InvalidInput


class Modulation(Protocol):
    """A scalar periodic function of time: its values, its means over intervals, where it is not smooth."""

    def mean(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Mean over each [start, end], seconds, shape (N,)."""
        ...

    def at(self, t: np.ndarray) -> np.ndarray:
        """Values at times t, seconds, shape as t; at a break either side's."""
        ...

    @property
    def breaks(self) -> tuple[float, ...]:
        """Times within one period, seconds, between which the function is smooth."""
        ...


@dataclass(frozen=True)
class Cosine:
    """cos(2π t / period)."""

    period: float

    def mean(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        rate = 2 * np.pi / self.period
        return (np.sin(rate * end) - np.sin(rate * start)) / (rate * (end - start))

    def at(self, t: np.ndarray) -> np.ndarray:
        return np.cos(2 * np.pi / self.period * t)

    @property
    def breaks(self) -> tuple[float, ...]:
        return ()


@dataclass(frozen=True)
class Fourier:
    """mean + Σ_k cosine_k cos(2πkt/period) + sine_k sin(2πkt/period), k from 1.

    Parameters
    ----------
    average
        Mean over a period.
    cosine, sine
        Coefficients of equal number.
    period
        s.
    """

    average: float
    cosine: tuple[float, ...]
    sine: tuple[float, ...]
    period: float

    def __post_init__(self) -> None:
        if len(self.sine) != len(self.cosine):
            raise InvalidInput(
                "sine", f"{len(self.sine)} numbers", f"give {len(self.cosine)}, as many as cosine"
            )

    @property
    def _rates(self) -> np.ndarray:
        return 2 * np.pi / self.period * np.arange(1, len(self.cosine) + 1)

    def at(self, t: np.ndarray) -> np.ndarray:
        phase = np.asarray(t)[..., None] * self._rates
        return self.average + np.cos(phase) @ np.array(self.cosine) + np.sin(phase) @ np.array(self.sine)

    def mean(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        def integral(t: np.ndarray) -> np.ndarray:
            phase = t[..., None] * self._rates
            return np.sin(phase) @ (self.cosine / self._rates) - np.cos(phase) @ (self.sine / self._rates)

        return self.average + (integral(end) - integral(start)) / (end - start)

    @property
    def breaks(self) -> tuple[float, ...]:
        return ()


@dataclass(frozen=True)
class Engagement:
    """γ: 1 over the arcs of contact and 0 between, repeated every `period`.

    Parameters
    ----------
    arcs
        (start, end) in revolutions, as in `ContactConfiguration`.
    period
        One revolution, s.
    """

    arcs: tuple[tuple[float, float], ...]
    period: float

    def mean(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        return (self._engaged_time(end) - self._engaged_time(start)) / (end - start)

    def at(self, t: np.ndarray) -> np.ndarray:
        inside = np.mod(np.asarray(t) / self.period, 1.0)
        engaged = np.zeros(inside.shape)
        for a, b in self.arcs:
            engaged[((inside >= a) & (inside < b)) | (inside < b - 1.0)] = 1.0
        return engaged

    @property
    def breaks(self) -> tuple[float, ...]:
        edges = {float(np.mod(edge, 1.0)) for arc in self.arcs for edge in arc}
        return tuple(sorted(edge * self.period for edge in edges if edge > 0))

    def _engaged_time(self, t: np.ndarray) -> np.ndarray:
        turn = np.floor(t / self.period)
        inside = t / self.period - turn
        total = turn * sum(b - a for a, b in self.arcs)
        for a, b in self.arcs:
            total = total + np.clip(inside - a, 0.0, b - a) + np.clip(inside + 1.0 - a, 0.0, b - a)
            total = total - np.clip(1.0 - a, 0.0, b - a)  # so that the sum is zero at t = 0
        return total * self.period


@dataclass(frozen=True)
class Sampled:
    """Any function of time, averaged by Gauss-Legendre quadrature over each interval.

    Where the function jumps within an interval the mean is of first order only.

    Parameters
    ----------
    function
        Takes and returns arrays of equal shape.
    order
        Points per interval.
    breaks
        Times within one period, s, at which the function or one of its derivatives jumps.
    """

    function: Callable[[np.ndarray], np.ndarray]
    order: int = 8
    breaks: tuple[float, ...] = ()

    def mean(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        x, w = np.polynomial.legendre.leggauss(self.order)
        t = start[:, None] + (end - start)[:, None] * (x + 1) / 2
        return self.function(t) @ (w / 2)

    def at(self, t: np.ndarray) -> np.ndarray:
        return self.function(np.asarray(t, dtype=float))


@dataclass(frozen=True)
class PeriodicMatrix:
    """constant + Σ_k modulation_k(t) matrix_k, each matrix of shape (d, d)."""

    constant: np.ndarray
    terms: tuple[tuple[Modulation, np.ndarray], ...] = ()

    def means(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Means over each [start, end] ([SBL] Eq. 10), shape (N, d, d)."""
        out = np.repeat(self.constant[None], len(start), axis=0)
        for modulation, matrix in self.terms:
            out = out + modulation.mean(start, end)[:, None, None] * matrix
        return out

    def at(self, t: np.ndarray) -> np.ndarray:
        """Values at times t, shape (N, d, d)."""
        out = np.repeat(self.constant[None], len(t), axis=0)
        for modulation, matrix in self.terms:
            out = out + modulation.at(t)[:, None, None] * matrix
        return out

    @property
    def is_constant(self) -> bool:
        return not self.terms


@dataclass(frozen=True)
class DelayEquation:
    """ż(t) = A(t) z(t) + B(t) z(t − τ), A and B constant or τ-periodic ([SBL] Eq. 5).

    Parameters
    ----------
    a, b
        Coefficient matrices, (d, d).
    tau
        Delay, and period of the coefficients, s.

    Raises
    ------
    InvalidInput
        When shapes disagree, a coefficient is not finite or the delay not positive.
    """

    a: PeriodicMatrix
    b: PeriodicMatrix
    tau: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.tau) and self.tau > 0):
            raise InvalidInput("tau", self.tau, "give a delay above 0 s")
        shape = self.a.constant.shape
        if len(shape) != 2 or shape[0] != shape[1]:
            raise InvalidInput("a", f"shape {shape}", "give a square matrix")
        for name, coefficient in (("a", self.a), ("b", self.b)):
            for matrix in (coefficient.constant, *(m for _, m in coefficient.terms)):
                if matrix.shape != shape:
                    raise InvalidInput(name, f"shape {matrix.shape}", f"give every matrix the shape {shape}")
                if not np.isfinite(matrix).all():
                    raise InvalidInput(name, "not finite", "give finite coefficients")

    @property
    def size(self) -> int:
        """d."""
        return len(self.a.constant)

    @property
    def is_constant(self) -> bool:
        """True when no coefficient depends on time."""
        return self.a.is_constant and self.b.is_constant

    @property
    def pieces(self) -> np.ndarray:
        """Ends of the intervals of [0, τ] in which A and B are smooth, s, ascending from 0 to τ."""
        inner = {
            t for matrix in (self.a, self.b) for modulation, _ in matrix.terms for t in modulation.breaks
        }
        return np.array([0.0, *sorted(t for t in inner if 0 < t < self.tau), self.tau])

    @property
    def memory(self) -> np.ndarray:
        """Indices of the coordinates whose past matters: the columns of B that are not zero."""
        used = np.abs(self.b.constant).sum(axis=0)
        for _, matrix in self.b.terms:
            used = used + np.abs(matrix).sum(axis=0)
        return np.flatnonzero(used)

    def means(self, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Means of A and B over each [start, end] ([SBL] Eq. 10), shapes (N, d, d)."""
        return self.a.means(start, end), self.b.means(start, end)

    @classmethod
    def of_second_order(
        cls,
        mass: np.ndarray,
        damping: np.ndarray,
        stiffness: np.ndarray,
        force: np.ndarray,
        tau: float,
        modulation: Modulation | None = None,
    ) -> DelayEquation:
        """M ü + C u̇ + K u = γ(t) Γ [u(t − τ) − u(t)] in state space ([SBL] Eqs. 3-6).

        Parameters
        ----------
        mass, damping, stiffness, force
            M, C, K, Γ, shapes (n, n).
        modulation
            γ; None means 1.
        """
        n = len(mass)
        inverse = np.linalg.inv(mass)
        free = np.zeros((2 * n, 2 * n))
        free[:n, n:] = np.eye(n)
        free[n:, :n] = -inverse @ stiffness
        free[n:, n:] = -inverse @ damping
        now, before = np.zeros_like(free), np.zeros_like(free)
        now[n:, :n] = -inverse @ force
        before[n:, :n] = inverse @ force
        if modulation is None:
            return cls(PeriodicMatrix(free + now), PeriodicMatrix(before), tau)
        zero = np.zeros_like(free)
        return cls(
            PeriodicMatrix(free, ((modulation, now),)), PeriodicMatrix(zero, ((modulation, before),)), tau
        )


def delayed_mathieu(
    delta: float, epsilon: float, b: float, damping: float, period: float = 2 * np.pi
) -> DelayEquation:
    """ẍ + damping·ẋ + (δ + ε cos(2πt/period)) x = b x(t − period) (Insperger and Stépán 2002)."""
    free = np.array([[0.0, 1.0], [-delta, -damping]])
    swing = np.array([[0.0, 0.0], [-epsilon, 0.0]])
    past = np.array([[0.0, 0.0], [b, 0.0]])
    terms = ((Cosine(period), swing),) if epsilon else ()
    return DelayEquation(PeriodicMatrix(free, terms), PeriodicMatrix(past), period)


def down_milling(
    *,
    teeth: int,
    tangential_coefficient: float,
    normal_coefficient: float,
    frequency_hz: float,
    damping_ratio: float,
    mass: float,
    spindle_rpm: float,
    depth: float,
    radial_immersion: float = 1.0,
) -> DelayEquation:
    """One-degree-of-freedom down-milling, straight teeth (Insperger and Stépán 2004).

    m(ẍ + 2ζω ẋ + ω² x) = depth·h(t)·[x(t − τ) − x(t)], τ the tooth passing period,
    h(t) = Σ_teeth g(φ)(K_t cos φ + K_n sin φ) sin φ, with g = 1 between entry and exit angle.

    Parameters
    ----------
    tangential_coefficient, normal_coefficient
        K_t, K_n in N/m².
    depth
        Axial depth of cut, m.
    radial_immersion
        a/D in (0, 1].
    """
    tau = 60.0 / (spindle_rpm * teeth)
    entry, leave = np.arccos(2 * radial_immersion - 1), np.pi

    def directional(t: np.ndarray) -> np.ndarray:
        total = np.zeros_like(t)
        for tooth in range(teeth):
            angle = np.mod(2 * np.pi * (t * spindle_rpm / 60.0 + tooth / teeth), 2 * np.pi)
            cutting = (angle >= entry) & (angle <= leave)
            force = tangential_coefficient * np.cos(angle) + normal_coefficient * np.sin(angle)
            total += np.where(cutting, force * np.sin(angle), 0.0)
        return total

    # A tooth enters or leaves the cut where its angle passes one of the two; a period sees each once.
    edges = [np.mod(angle, 2 * np.pi / teeth) / (2 * np.pi / teeth) * tau for angle in (entry, leave)]
    omega = 2 * np.pi * frequency_hz
    unit = np.ones((1, 1))
    return DelayEquation.of_second_order(
        mass * unit,
        2 * mass * damping_ratio * omega * unit,
        mass * omega**2 * unit,
        depth * unit,
        tau,
        Sampled(
            directional, breaks=tuple(t for t in sorted(set(edges)) if 1e-12 * tau < t < (1 - 1e-12) * tau)
        ),
    )

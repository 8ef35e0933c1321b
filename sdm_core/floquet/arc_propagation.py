"""Motion over one revolution with arcs of contact: exact fundamental matrices, many at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial

import numpy as np

from sdm_core.interruption import checkpoint
from sdm_core.rubbing_blade import RubbingBlade

_DEGREE = 16
_TAYLOR = np.array([1.0 / factorial(k) for k in range(_DEGREE + 1)])
_LARGEST_NORM = 0.9  # at which 16 terms leave a remainder of 1e-16
_MOST_SQUARINGS = 60  # beyond, entries overflow long before


def exponentials(a: np.ndarray) -> np.ndarray:
    """exp(a) of many small matrices, shape (k, d, d): Taylor series, scaling and squaring."""
    return Exponentials.of(a, np.abs(a).sum(axis=2).max(axis=1)).over(np.ones(len(a)))


@dataclass(frozen=True)
class Exponentials:
    """exp(a x) of many small matrices a for several x each: powers of a serve all of them.

    Scaled motion is a rotation, so that squaring does not lose accuracy: rounding stays near
    ε‖a x‖. Powers and series take six products (Paterson and Stockmeyer 1973).

    Attributes
    ----------
    size
        ‖a‖ (largest row sum, or a bound on it), shape (k,).
    powers
        a/‖a‖ to the power 0 to 4, shape (5, k, d, d).
    """

    size: np.ndarray
    powers: np.ndarray

    @classmethod
    def of(cls, a: np.ndarray, size: np.ndarray) -> Exponentials:
        """Of matrices a, shape (k, d, d), with a bound `size` on their row sums, shape (k,)."""
        powers = np.empty((5, *a.shape), dtype=a.dtype)
        powers[0] = np.eye(a.shape[-1])
        np.multiply(a, (1 / np.where(size > 0, size, 1.0))[:, None, None], out=powers[1])
        np.matmul(powers[1], powers[1], out=powers[2])
        np.matmul(powers[2], powers[1], out=powers[3])
        np.matmul(powers[2], powers[2], out=powers[4])
        return cls(size, powers)

    def squarings(self, x: np.ndarray) -> np.ndarray:
        """How often x is halved for the series to converge, shape (k,)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            needed = np.ceil(np.log2(np.maximum(self.size * x / _LARGEST_NORM, 1e-300)))
        return np.clip(np.where(np.isnan(needed), 0, needed), 0, _MOST_SQUARINGS).astype(int)

    def over(self, x: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
        """exp(a x), x ≥ 0 of shape (k,), shape (k, d, d); or of some rows only."""
        times = self.squarings(x)
        out = self.step(x * 0.5**times, rows)
        return squared(out, times if rows is None else times[rows])

    def step(self, x: np.ndarray, rows: np.ndarray | slice | None = None) -> np.ndarray:
        """exp(a x) where ‖a‖ x is small enough for the series, shape (k, d, d); or of some rows only."""
        powers, size = self.powers, self.size * x
        if rows is not None:
            powers, size = powers[:, rows], size[rows]
        _, k, d, _ = powers.shape
        # Four terms of the series at a time, in one product of real numbers.
        scaled = _TAYLOR * size[:, None] ** np.arange(_DEGREE + 1)
        terms = np.zeros((k, 4, 5))
        terms[:, :, :4] = scaled[:, :16].reshape(k, 4, 4)
        terms[:, 3, 4] = scaled[:, 16]
        entries = powers.reshape(5, k, d * d).view(float).swapaxes(0, 1)
        blocks = np.ascontiguousarray((terms @ entries).swapaxes(0, 1)).view(powers.dtype)
        blocks = blocks.reshape(4, k, d, d)
        out = blocks[3]
        for j in (2, 1, 0):
            out = powers[4] @ out
            out += blocks[j]
        return out


def squared(a: np.ndarray, times: np.ndarray, order: np.ndarray | None = None) -> np.ndarray:
    """Each matrix squared so many times; `a` is used up.

    `order` is that of falling `times`, where the matrices already lie in it; the answer is not in it.
    """
    if len(a) == 0:
        return a
    if order is None:
        order = np.argsort(-times, kind="stable")  # those still to be squared lie together
        a = a[order]
    b, out = np.empty_like(a), np.empty_like(a)
    left = len(a) - np.cumsum(np.bincount(times))
    before = len(a)
    for count in left:
        out[order[count:before]] = a[count:before]
        np.matmul(a[:count], a[:count], out=b[:count])
        a, b, before = b, a, count
    return out


@dataclass(frozen=True)
class ArcPropagation:
    """ẍ + 2ξΛẋ + (Λ² − c γ(Ωt) G) x = 0 over one revolution, for a batch of rubbing blades.

    A Floquet solution of multiplier μ has x(t − τ) = x(t)/μ, so the contact force is
    K_e γ G (1/μ − 1) x = c γ G x (DESIGN, fact 5). Over an arc of contact and over the flight to
    the next one the coefficients are constant: M(c) is a product of matrix exponentials.

    The state is (x, ẋ/ω): free motion is a rotation and entries of M stay of order one. Time
    is in revolutions.

    Attributes
    ----------
    angle
        ωτ, rad a revolution, shape (b, n).
    damping_ratio
        ξ, shape (b, n).
    coupling
        G τ/ω, kg^-1 s²; rows divided by ω of that row; shape (b, n, n).
    arcs, flights
        Lengths of each arc of contact and of the free flight after it, revolutions, shape (b, s).
    """

    angle: np.ndarray
    damping_ratio: np.ndarray
    coupling: np.ndarray
    arcs: np.ndarray
    flights: np.ndarray

    @classmethod
    def of(cls, problems: Sequence[RubbingBlade]) -> ArcPropagation:
        """Of problems with equally many modes."""
        most = max(sum(s.engaged for s in p.segments) for p in problems)
        arcs, flights = np.zeros((len(problems), most)), np.zeros((len(problems), most))
        for i, problem in enumerate(problems):
            at = -1
            for segment in problem.segments:
                if segment.engaged:
                    at += 1
                    arcs[i, at] = segment.length
                else:
                    flights[i, at] = segment.length
        omega = np.array([p.omega for p in problems])
        tau = np.array([p.tau for p in problems])
        coupling = np.array([p.contact_matrix for p in problems]) * (tau[:, None] / omega)[:, :, None]
        damping = np.array([p.damping_ratio for p in problems])
        return cls(omega * tau[:, None], damping, coupling, arcs, flights)

    def __getitem__(self, rows: np.ndarray) -> ArcPropagation:
        return ArcPropagation(
            self.angle[rows],
            self.damping_ratio[rows],
            self.coupling[rows],
            self.arcs[rows],
            self.flights[rows],
        )

    def __len__(self) -> int:
        return len(self.angle)

    @property
    def size(self) -> int:
        """2n."""
        return 2 * self.angle.shape[1]

    @property
    def phase_shift(self) -> np.ndarray:
        """Σ_j G_jj τ/(2ω_j) × engaged share, m/N, shape (b,).

        Times |c| it bounds, to first order, the phase and growth that the contact adds a revolution.
        """
        return 0.5 * np.trace(self.coupling, axis1=1, axis2=2) * self.arcs.sum(axis=1)

    @property
    def rounding(self) -> np.ndarray:
        """Rounding of entries of M relative to the largest, shape (b,)."""
        return np.finfo(float).eps * (1 + self.angle.max(axis=1))

    def fundamental(self, case: np.ndarray, c: np.ndarray) -> np.ndarray:
        """M(c) of problem `case` each, shape (k, 2n, 2n); c in N/m, shape (k,)."""
        chunk = max(50, int(600 * (4 / self.size) ** 2))
        if len(case) > chunk:
            starts = range(0, len(case), chunk)
            return np.concatenate([self.fundamental(case[i : i + chunk], c[i : i + chunk]) for i in starts])
        checkpoint()
        out: np.ndarray | None = None
        with np.errstate(all="ignore"):  # where c is huge entries overflow: callers look at the result
            exponential = self.exponentials(case, c)
            for s in range(self.arcs.shape[1]):
                length = self.arcs[case, s]
                has = np.flatnonzero(length > 0)  # some have fewer arcs than others
                if out is None or len(has) == len(case):
                    step = exponential.over(length)
                    out = step if out is None else step @ out
                elif len(has):
                    out[has] = exponential.over(length, has) @ out[has]
                fly = np.flatnonzero(self.flights[case, s] > 0)
                if len(fly) == len(case):
                    out = self.flight(case, s) @ out
                elif len(fly):
                    out[fly] = self.flight(case[fly], s) @ out[fly]
        assert out is not None
        return out

    def exponentials(self, case: np.ndarray, c: np.ndarray) -> Exponentials:
        """Those of the motion in contact, of problem `case` each."""
        n = self.angle.shape[1]
        rate = np.zeros((len(case), 2 * n, 2 * n), dtype=np.result_type(c, float))
        at = np.arange(n)
        rate[:, at, n + at] = self.angle[case]
        rate[:, n + at, at] = -self.angle[case]
        rate[:, n + at, n + at] = -2 * self.damping_ratio[case] * self.angle[case]
        rate[:, n:, :n] += c[:, None, None] * self.coupling[case]
        # Rows of (0, angle) and of (c coupling − angle, −2ξ angle), without looking at every entry.
        rows = (1 + 2 * self.damping_ratio) * self.angle
        pull = np.abs(self.coupling).sum(axis=2)
        return Exponentials.of(rate, (rows[case] + np.abs(c)[:, None] * pull[case]).max(axis=1))

    def flight(self, case: np.ndarray, s: int) -> np.ndarray:
        """Free motion after arc s: each mode by itself, in closed form, shape (k, 2n, 2n)."""
        n = self.angle.shape[1]
        xi, turn = self.damping_ratio[case], self.angle[case] * self.flights[case, s, None]
        root = np.sqrt(1 - xi**2)
        decay, cosine, sine = np.exp(-xi * turn), np.cos(root * turn), np.sin(root * turn) / root
        out = np.zeros((len(case), 2 * n, 2 * n))
        at = np.arange(n)
        out[:, at, at] = decay * (cosine + xi * sine)
        out[:, at, n + at] = decay * sine
        out[:, n + at, at] = -decay * sine
        out[:, n + at, n + at] = decay * (cosine - xi * sine)
        return out

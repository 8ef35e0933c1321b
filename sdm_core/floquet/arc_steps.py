"""Fundamental matrices of arcs of contact for many c each: short steps as polynomials in c, then squared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.floquet.arc_propagation import ArcPropagation, squared
from sdm_core.floquet.power_series import half_circle, real_series
from sdm_core.interruption import checkpoint

_TERMS = 8  # of the polynomial: see `ArcSteps`


@dataclass(frozen=True)
class ArcSteps:
    """M(c) of many |c| ≤ `radius` for each of a batch of rubbing blades.

    Over a step h so short that ‖(A0 + c A1) h‖ < 0.9, exp((A0 + c A1) h) is a polynomial in c of a few terms:
    A1 turns displacements into velocities only, so that k of them take at least k − 1 of A0 in
    between, and the term c^k is smaller than 0.45^(2k−1)/(2k−1)!, 5e-18 for k = 8. The polynomial is
    found once from its values at four points of the half circle |c| = radius; M(c) then takes a sum
    of eight real matrices and as many squarings as it takes steps to the end of each arc.

    Attributes
    ----------
    radius
        Largest |c|, N/m, shape (b,).
    polynomials
        Real coefficients in c/radius, of the step of each arc, shape (p, 8, d²); an arc of problem i has
        the row `first[i]` + its number.
    times
        How often each step is doubled, shape (p,).
    first, arcs
        Row of the first arc and number of arcs, shape (b,).
    flights
        Free motion after each arc, shape (s, b, d, d).
    """

    radius: np.ndarray
    polynomials: np.ndarray
    times: np.ndarray
    first: np.ndarray
    arcs: np.ndarray
    flights: np.ndarray

    @classmethod
    def of(cls, motion: ArcPropagation, radius: np.ndarray) -> ArcSteps:
        """For |c| up to `radius`, N/m, shape (b,)."""
        b, d = len(motion), motion.size
        radius = np.where(radius > 0, radius, 1.0)
        arcs = (motion.arcs > 0).sum(axis=1)
        first = np.cumsum(arcs) - arcs
        polynomials, times = np.empty((int(arcs.sum()), _TERMS, d * d)), np.zeros(int(arcs.sum()), dtype=int)
        points = half_circle(_TERMS)
        chunk = max(12, int(150 * (4 / d) ** 2))
        order = np.argsort(-arcs, kind="stable")
        with np.errstate(all="ignore"):  # where c is huge entries overflow: callers look at the result
            for i in range(0, b, chunk):
                checkpoint()
                rows = order[i : i + chunk]
                case = np.repeat(rows, len(points))
                exponential = motion.exponentials(case, (radius[rows, None] * points).ravel())
                for s in range(int(arcs[rows[0]])):
                    own = rows[: np.count_nonzero(arcs[rows] > s)]
                    length = motion.arcs[case, s]
                    doubled = exponential.squarings(length)
                    steps = exponential.step(length * 0.5**doubled, slice(len(own) * len(points)))
                    steps = steps.reshape(len(own), len(points), d * d)
                    polynomials[first[own] + s] = real_series(steps)
                    times[first[own] + s] = doubled[:: len(points)][: len(own)]
            flights = np.array([motion.flight(np.arange(b), s) for s in range(motion.arcs.shape[1])])
        flights[motion.flights.T == 0] = np.eye(d)
        return cls(radius, polynomials, times, first, arcs, flights)

    def __getitem__(self, rows: np.ndarray) -> ArcSteps:
        arcs = self.arcs[rows]
        first = np.cumsum(arcs) - arcs
        kept = np.repeat(self.first[rows] - first, arcs) + np.arange(int(arcs.sum()))
        return ArcSteps(
            self.radius[rows], self.polynomials[kept], self.times[kept], first, arcs, self.flights[:, rows]
        )

    def fundamental(self, case: np.ndarray, c: np.ndarray) -> np.ndarray:
        """M(c) of problem `case` each, shape (k, 2n, 2n); c in N/m, shape (k,)."""
        d = self.flights.shape[-1]
        out = np.empty((len(case), d, d), dtype=complex)
        order = np.argsort(-self.arcs[case], kind="stable")  # those with fewer arcs come last
        chunk = max(50, int(600 * (4 / d) ** 2))
        with np.errstate(all="ignore"):
            for i in range(0, len(case), chunk):
                checkpoint()
                rows = order[i : i + chunk]
                out[rows] = self._part(case[rows], c[rows])
        return out

    def _part(self, case: np.ndarray, c: np.ndarray) -> np.ndarray:
        d = self.flights.shape[-1]
        have = [int((self.arcs[case] > s).sum()) for s in range(int(self.arcs[case[0]]))]
        t = c / self.radius[case]
        powers = np.empty((len(c), 2, _TERMS))
        power = np.ones(len(c), dtype=complex)
        for k in range(_TERMS):
            powers[:, 0, k], powers[:, 1, k] = power.real, power.imag
            power = power * t
        row = np.concatenate([self.first[case[:count]] + s for s, count in enumerate(have)])
        own = np.concatenate([np.arange(count) for count in have])
        order = np.argsort(-self.times[row], kind="stable")  # as `squared` wants them
        both = powers[own[order]] @ self.polynomials[row[order]]
        step = np.empty((len(row), d * d), dtype=complex)
        step.real, step.imag = both[:, 0], both[:, 1]
        steps = squared(step.reshape(-1, d, d), self.times[row], order)
        out = steps[: have[0]]
        done: int = 0
        for s, count in enumerate(have):
            if s:
                out[:count] = steps[done : done + count] @ out[:count]
            done += count
            flown = self.flights[s][case[:count]] @ out[:count].view(float)
            out[:count] = flown.view(complex)
        return out

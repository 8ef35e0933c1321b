"""Fundamental matrices of a whole disc of complex contact stiffness from a few: a power series."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import factorial

import numpy as np

from sdm_core.floquet.power_series import real_series
from sdm_core.floquet.propagation import Fundamental, Propagation, for_many

_TERMS = np.r_[np.arange(6, 32, 2), np.arange(32, 64, 4), 64, 80, 96, 128]
FEWEST_TERMS, MOST_TERMS = int(_TERMS[0]), int(_TERMS[-1])
# Phase shift s on the rim up to which so many terms suffice, two of them negligible: (0.8 s)ᵏ/k! < 3e-15.
# The factor is measured: with 1.0 a fifth of all terms was not needed, with 0.8 series seldom fall short.
_SHIFT_HELD = np.array([(3e-15 * factorial(m - 2)) ** (1 / (m - 2)) for m in _TERMS.tolist()]) / 0.8
_NEGLIGIBLE = 3e-15  # size of the last terms, relative to the largest entry on the disc


@dataclass(frozen=True)
class ContactExpansion:
    """M(c) = Σ_k C_k t^k, t = (c + centre)/radius, |t| ≤ 1: c inside a disc about −centre.

    M is an entire function of c = K_e(1/μ − 1). Multipliers with |μ| ≥ 1/R at any K_e up to K lie in
    the disc |c + K| ≤ R K, so that one series serves all of them, and every smaller K_e as well. It
    falls faster than any power. The coefficients are real since M(c̄) is the conjugate of M(c);
    a discrete Fourier transform of M on the rim gives them (`power_series`).

    Attributes
    ----------
    centre, radius
        K and R K, N/m, shape (b,).
    coefficients
        C_k, shape (b, m, d, d), zero from each one's own number of terms on.
    terms
        That number, shape (b,).
    size
        Largest entry of M on the rim, shape (b,): entries inside carry rounding errors of ε times it.
    noise
        Rounding of those entries, and what `motion` misses, relative to the largest, shape (b,).
    resolved
        False where the series had not fallen to rounding within `MOST_TERMS`, shape (b,).
    """

    centre: np.ndarray
    radius: np.ndarray
    coefficients: np.ndarray
    terms: np.ndarray
    size: np.ndarray
    noise: np.ndarray
    resolved: np.ndarray

    @classmethod
    def of(
        cls, motion: Propagation, ke: np.ndarray, reach: np.ndarray, many: Fundamental | None = None
    ) -> ContactExpansion:
        """About −K_e each, for multipliers down to 1/reach.

        Parameters
        ----------
        ke
            K, N/m, shape (b,).
        reach
            R ≥ 1, shape (b,).
        many
            The same motion `for_many` |c| ≤ (1 + R) K or more, where already there.
        """
        count, d = len(motion), motion.size
        centre, radius = ke, reach * ke
        size, resolved = np.full(count, np.inf), np.zeros(count, dtype=bool)
        terms = np.full(count, FEWEST_TERMS)
        shift = motion.phase_shift * radius
        many = for_many(motion, radius + centre) if many is None else many
        todo = np.arange(count)
        level = np.minimum(np.searchsorted(_SHIFT_HELD, shift), len(_TERMS) - 1)
        coefficients = np.zeros((count, int(_TERMS[level.max(initial=0)]), d, d))
        while len(todo):
            for now, m, found, largest in _series(many, todo, centre, radius, _TERMS[level[todo]]):
                noise = motion.rounding  # of smooth engagement known only now
                tail = np.abs(found[:, -max(2, m // 8) :]).max(axis=(1, 2, 3))
                done = (tail <= np.maximum(_NEGLIGIBLE, 2 * noise[now]) * largest) & np.isfinite(largest)
                if m > coefficients.shape[1]:
                    grown = np.zeros((count, m, d, d))
                    grown[:, : coefficients.shape[1]] = coefficients
                    coefficients = grown
                coefficients[now[done], :m] = found[done]
                terms[now[done]] = m
                size[now], resolved[now[done]] = largest, True
            level[todo] += 1
            todo = todo[~resolved[todo] & (level[todo] < len(_TERMS))]
        return cls(centre, radius, coefficients, terms, size, motion.rounding, resolved)

    def __getitem__(self, rows: np.ndarray) -> ContactExpansion:
        terms = self.terms[rows]
        return ContactExpansion(
            self.centre[rows],
            self.radius[rows],
            self.coefficients[rows, : terms.max(initial=FEWEST_TERMS)],
            terms,
            self.size[rows],
            self.noise[rows],
            self.resolved[rows],
        )

    def fundamental(self, c: np.ndarray) -> np.ndarray:
        """M(c), shape (b, j, d, d), for c of shape (b, j)."""
        return self.at(self._place(c))

    def at(self, t: np.ndarray) -> np.ndarray:
        """M at places t of the disc, shape (b, j, d, d), for t of shape (b, j), or (1, j) for all alike."""
        return self._sum(self._powers(t))

    def fundamental_and_slope(self, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """M(c) and dM/dc, shapes (b, j, d, d)."""
        powers, j = self._powers(self._place(c)), c.shape[1]
        falling = np.zeros_like(powers)
        order = np.arange(1, powers.shape[1])
        falling[:, 1:] = powers[:, :-1] * (order / self.radius[:, None])[:, :, None]
        both = self._sum(
            np.concatenate([powers[..., :j], falling[..., :j], powers[..., j:], falling[..., j:]], 2)
        )
        return both[:, :j], both[:, j:]

    def _place(self, c: np.ndarray) -> np.ndarray:
        return (c + self.centre[:, None]) / self.radius[:, None]

    def _powers(self, t: np.ndarray) -> np.ndarray:
        """Re t^k, then Im t^k, shape (b, m, 2j)."""
        j = t.shape[1]
        powers = np.empty((len(t), self.coefficients.shape[1], 2 * j))
        power = np.ones_like(t, dtype=complex)
        for k in range(powers.shape[1]):
            powers[:, k, :j], powers[:, k, j:] = power.real, power.imag
            power *= t
        return powers

    def _sum(self, powers: np.ndarray) -> np.ndarray:
        b, m, d, _ = self.coefficients.shape
        j = powers.shape[2] // 2
        # Real coefficients: two real products cost half of one complex.
        both = powers.swapaxes(1, 2) @ self.coefficients.reshape(b, m, d * d)
        out = np.empty((b, j, d * d), dtype=complex)
        out.real, out.imag = both[:, :j], both[:, j:]
        return out.reshape(b, j, d, d)


def _series(
    motion: Fundamental, rows: np.ndarray, centre: np.ndarray, radius: np.ndarray, terms: np.ndarray
) -> Iterator[tuple[np.ndarray, int, np.ndarray, np.ndarray]]:
    """Rows with equally many terms: coefficients (k, terms, d, d), largest entry on the rim (k,).

    The samples of all rows are taken at once: small groups would cost as much as large ones.
    """
    half = terms // 2
    start = np.cumsum(half) - half
    case = np.repeat(np.arange(len(rows)), half)
    turn = np.pi * (2 * (np.arange(len(case)) - start[case]) + 1) / terms[case]
    c = radius[rows[case]] * np.exp(1j * turn) - centre[rows[case]]
    values = motion.fundamental(rows[case], c)
    for m in np.unique(terms):
        members = np.flatnonzero(terms == m)
        own = values[start[members, None] + np.arange(m // 2)]
        with np.errstate(all="ignore"):
            largest = np.sqrt((own.real**2 + own.imag**2).max(axis=(1, 2, 3)))
            found = real_series(own.reshape(len(members), m // 2, -1))
        found = found.reshape(len(members), m, *own.shape[2:])
        yield rows[members], int(m), found, np.where(np.isfinite(largest), largest, np.inf)

"""Fundamental matrices of a whole disc of complex contact stiffness from a few: a power series."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import factorial

import numpy as np

from sdm_core.floquet.propagation import Propagation

_TERMS = np.array([6, 8, 10, 12, 14, 16, 18, 20, 24, 28, 32, 40, 48, 64, 96, 128])
FEWEST_TERMS, MOST_TERMS = int(_TERMS[0]), int(_TERMS[-1])
# Phase shift on the rim up to which so many terms suffice, two of them negligible: sᵏ/k! < 3e-15.
_SHIFT_HELD = np.array([(3e-15 * factorial(m - 2)) ** (1 / (m - 2)) for m in _TERMS])
_NEGLIGIBLE = 3e-15  # size of the last terms, relative to the largest entry on the disc


@dataclass(frozen=True)
class ContactExpansion:
    """M(c) = Σ_k C_k t^k, t = (c + centre)/radius, |t| ≤ 1: c inside a disc about −centre.

    M is an entire function of c = K_e(1/μ − 1). Multipliers with |μ| ≥ 1/R at any K_e up to K lie in
    the disc |c + K| ≤ R K, so that one series serves all of them, and every smaller K_e as well. It
    falls faster than any power. The coefficients are real since M(c̄) is the conjugate of M(c);
    a discrete Fourier transform of M on the rim gives them (Fornberg 1981).

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
    def of(cls, motion: Propagation, ke: np.ndarray, reach: np.ndarray) -> ContactExpansion:
        """About −K_e each, for multipliers down to 1/reach.

        Parameters
        ----------
        ke
            K, N/m, shape (b,).
        reach
            R ≥ 1, shape (b,).
        """
        count, d = len(motion), motion.size
        centre, radius = ke, reach * ke
        coefficients = np.zeros((count, FEWEST_TERMS, d, d))
        size, resolved = np.full(count, np.inf), np.zeros(count, dtype=bool)
        terms = np.full(count, FEWEST_TERMS)
        shift = motion.phase_shift * radius
        todo = np.arange(count)
        level = np.minimum(np.searchsorted(_SHIFT_HELD, shift), len(_TERMS) - 1)
        while len(todo):
            for now, m, found, largest in _series(motion, todo, centre, radius, _TERMS[level[todo]]):
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
        return self._sum(self._powers(c), self.coefficients)

    def fundamental_and_slope(self, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """M(c) and dM/dc, shapes (b, j, d, d)."""
        powers = self._powers(c)
        m = self.coefficients.shape[1]
        rising = self.coefficients[:, 1:] * (np.arange(1, m) / self.radius[:, None])[:, :, None, None]
        return self._sum(powers, self.coefficients), self._sum(powers[..., :-1], rising)

    def _powers(self, c: np.ndarray) -> np.ndarray:
        t = (c + self.centre[:, None]) / self.radius[:, None]
        powers = np.empty((*t.shape, self.coefficients.shape[1]), dtype=complex)
        powers[..., 0] = 1.0
        for k in range(1, powers.shape[-1]):
            powers[..., k] = powers[..., k - 1] * t
        return powers

    @staticmethod
    def _sum(powers: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
        b, j, m = powers.shape
        d = coefficients.shape[-1]
        flat = coefficients.reshape(b, m, d * d)
        # Real coefficients: two real products cost half of one complex.
        both = np.concatenate([powers.real, powers.imag], axis=1) @ flat
        return (both[:, :j] + 1j * both[:, j:]).reshape(b, j, d, d)


def _series(
    motion: Propagation, rows: np.ndarray, centre: np.ndarray, radius: np.ndarray, terms: np.ndarray
) -> Iterator[tuple[np.ndarray, int, np.ndarray, np.ndarray]]:
    """Rows with equally many terms: coefficients (k, terms, d, d), largest entry on the rim (k,).

    The samples of all rows are taken at once: small groups would cost as much as large ones.
    """
    half = terms // 2 + 1
    start = np.cumsum(half) - half
    case = np.repeat(np.arange(len(rows)), half)
    turn = 2 * np.pi * (np.arange(len(case)) - start[case]) / terms[case]
    c = radius[rows[case]] * np.exp(1j * turn) - centre[rows[case]]
    values = motion.fundamental(rows[case], c)
    for m in np.unique(terms):
        members = np.flatnonzero(terms == m)
        own = values[start[members, None] + np.arange(m // 2 + 1)]
        with np.errstate(all="ignore"):
            largest = np.abs(own).max(axis=(1, 2, 3))
            found = np.fft.irfft(own.conj(), m, axis=1)
        yield rows[members], int(m), found, np.where(np.isfinite(largest), largest, np.inf)

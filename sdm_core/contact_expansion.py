"""Fundamental matrices of a whole disc of complex contact stiffness from a few: a power series."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sdm_core.arc_propagation import ArcPropagation

_TERMS = (8, 12, 16, 24, 32, 48, 64, 96, 128)
FEWEST_TERMS, MOST_TERMS = _TERMS[0], _TERMS[-1]
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
        C_k, shape (b, terms, d, d).
    size
        Largest entry of M on the rim, shape (b,): entries inside carry rounding errors of ε times it.
    noise
        Rounding of those entries, relative to the largest, shape (b,).
    resolved
        False where the series had not fallen to rounding within `MOST_TERMS`, shape (b,).
    """

    centre: np.ndarray
    radius: np.ndarray
    coefficients: np.ndarray
    size: np.ndarray
    noise: np.ndarray
    resolved: np.ndarray

    @classmethod
    def of(cls, motion: ArcPropagation, ke: np.ndarray, reach: np.ndarray) -> ContactExpansion:
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
        shift = motion.phase_shift * radius
        noise = np.finfo(float).eps * (1 + motion.angle.max(axis=1))
        todo = np.arange(count)
        for m in _TERMS:
            # e^{s t} needs about e s + 8 terms: those that cannot do with m wait for the next round.
            now = todo[(2.7 * shift[todo] + 4 <= m) | (m == MOST_TERMS)]
            if len(now) == 0:
                continue
            found, largest = _series(motion, now, centre, radius, m)
            tail = np.abs(found[:, -max(2, m // 8) :]).max(axis=(1, 2, 3))
            done = (tail <= np.maximum(_NEGLIGIBLE, 2 * noise[now]) * largest) & np.isfinite(largest)
            if m > coefficients.shape[1]:
                grown = np.zeros((count, m, d, d))
                grown[:, : coefficients.shape[1]] = coefficients
                coefficients = grown
            coefficients[now[done], :m] = found[done]
            size[now], resolved[now[done]] = largest, True
            todo = np.setdiff1d(todo, now[done])
        return cls(centre, radius, coefficients, size, noise, resolved)

    def __getitem__(self, rows: np.ndarray) -> ContactExpansion:
        return ContactExpansion(
            self.centre[rows],
            self.radius[rows],
            self.coefficients[rows],
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
    motion: ArcPropagation, rows: np.ndarray, centre: np.ndarray, radius: np.ndarray, terms: int
) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (k, terms, d, d), and the largest entry on the rim (k,)."""
    half = terms // 2 + 1
    t = np.exp(2j * np.pi * np.arange(half) / terms)
    c = radius[rows, None] * t - centre[rows, None]
    values = motion.fundamental(np.repeat(rows, half), c.ravel()).reshape(
        len(rows), half, motion.size, motion.size
    )
    with np.errstate(all="ignore"):
        largest = np.abs(values).max(axis=(1, 2, 3))
        return np.fft.irfft(values.conj(), terms, axis=1), np.where(np.isfinite(largest), largest, np.inf)


@dataclass(frozen=True)
class ArcSeries:
    """M(c) of one problem where it grows too much over the disc for one series to hold its digits.

    Each arc is cut in 2^k equal parts, over which the contact shifts the phase by less than a
    radian: their exponentials have short series without cancellation, and k squarings give the arc.

    Attributes
    ----------
    motion
        A batch of one.
    centre
        K; the series hold in |c + K| ≤ K, the image of |μ| ≥ 1; N/m.
    parts
        Series of one part of each arc, shape (arcs, terms, d, d).
    squarings
        k of each arc, shape (arcs,).
    """

    motion: ArcPropagation
    centre: float
    parts: np.ndarray
    squarings: np.ndarray

    @classmethod
    def of(cls, motion: ArcPropagation, ke: float) -> ArcSeries:
        arcs = motion.arcs[0]
        shift = 0.5 * np.trace(motion.coupling[0]) * arcs * ke
        squarings = np.maximum(0, np.ceil(np.log2(np.maximum(shift, 1e-300)))).astype(int)
        every = np.zeros(len(arcs), dtype=int)
        part = replace(motion[every], arcs=(arcs * 0.5**squarings)[:, None], flights=np.zeros((len(arcs), 1)))
        for terms in (12, 24, 48, 96):
            parts, largest = _series(
                part, np.arange(len(arcs)), np.full(len(arcs), ke), np.full(len(arcs), ke), terms
            )
            if (np.abs(parts[:, -2:]).max(axis=(1, 2, 3)) <= 1e-14 * largest).all():
                break
        return cls(motion, ke, parts, squarings)

    def fundamental(self, c: np.ndarray) -> np.ndarray:
        """M(c), shape (k, d, d), for c of shape (k,) inside the disc."""
        t = (c + self.centre) / self.centre
        powers = t[:, None] ** np.arange(self.parts.shape[1])
        case = np.zeros(len(c), dtype=int)
        d = self.motion.size
        out: np.ndarray | None = None
        with np.errstate(all="ignore"):
            for s, (series, squarings) in enumerate(zip(self.parts, self.squarings, strict=True)):
                step = ContactExpansion._sum(powers[None], series[None])[0]
                for _ in range(squarings):
                    step = step @ step
                out = step if out is None else step @ out
                if self.motion.flights[0, s] > 0:
                    out = self.motion.flight(case, s) @ out
        assert out is not None
        return out.reshape(len(c), d, d)

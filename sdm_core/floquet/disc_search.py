"""Which disc of u = 1/μ to look in for the dominant multiplier, where the unit circle is out of reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.floquet.propagation import Fundamental

# Growth on the rim of the discs looked at, and the largest entry of u M there from which on one is taken to
# hold a multiplier: of 33 random blades each then had one in its first disc.
_EXPONENTS = np.array([2.5, 3.5, 5.0, 7.0, 9.0, 12.0, 16.0, 21.0])
_LIKELY = 2.0


@dataclass(frozen=True)
class DiscSearch:
    """Discs |u| < R tried in turn for the dominant multiplier of each problem, arrays of shape (b,).

    Attributes
    ----------
    reach
        R of the next one.
    largest
        That R may take.
    wider
        Factor to the next R while every disc was too small.
    empty, full
        Largest R known to hold no multiplier, smallest R whose series did not hold its digits.
    """

    reach: np.ndarray
    largest: np.ndarray
    wider: np.ndarray
    empty: np.ndarray
    full: np.ndarray

    @classmethod
    def of(cls, first: np.ndarray, largest: np.ndarray, wider: np.ndarray) -> DiscSearch:
        """To begin with `first`, or `largest` where that is smaller."""
        reach = np.minimum(first, largest)
        return cls(reach, largest, wider, np.zeros(len(first)), np.full(len(first), np.inf))

    def after(self, resolved: np.ndarray, found: np.ndarray) -> tuple[DiscSearch, np.ndarray]:
        """What is left to search, where the series was `resolved` and where a multiplier was `found`."""
        empty = np.where(resolved, self.reach, self.empty)
        full = np.where(resolved, self.full, self.reach)
        go = ~found & (empty < self.largest)
        with np.errstate(invalid="ignore"):
            between = np.sqrt(np.maximum(empty, full / self.wider**2) * full)
        reach = np.minimum(np.where(np.isinf(full), self.wider * empty, between), self.largest)
        return DiscSearch(reach[go], self.largest[go], self.wider[go], empty[go], full[go]), go


def likely_reach(many: Fundamental, ke: np.ndarray, growth: np.ndarray, largest: float) -> np.ndarray:
    """R of the smallest disc that is likely to hold a multiplier in strong contact, shape (b,).

    One with |u| = 1/|μ| < R takes a u M(K_e(u − 1)) with an eigenvalue of modulus one, and M is largest near
    the imaginary axis of u: there its largest entry is looked at. Too small a guess costs another disc,
    too large a one a longer series.

    Parameters
    ----------
    many
        The motion, made ready for |c| ≤ 2 K_e.
    ke, growth
        K_e, N/m, and to first order the growth over a revolution that |Im c| = K_e brings, shape (b,).
    largest
        That R may take.
    """
    reach = np.minimum(_EXPONENTS / growth[:, None], largest)
    case = np.repeat(np.arange(len(ke)), len(_EXPONENTS))
    m = many.fundamental(case, (ke[:, None] * (1j * reach - 1)).ravel())
    with np.errstate(all="ignore"):
        size = reach * np.abs(m).max(axis=(1, 2)).reshape(reach.shape)
    likely = ~(size < _LIKELY)
    likely[:, -1] = True
    return reach[np.arange(len(ke)), np.argmax(likely, axis=1)]

"""Rotor speeds at which a blade is unstable with one K_e, their edges exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.adaptive_map import adaptive_map
from sdm_core.blade import Blade
from sdm_core.boundary import BoundarySolution, boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.lobe_tips import SEARCH_MARGIN
from sdm_core.validation import KE_LIMIT

EDGE_TOLERANCE = 1e-6
"""Relative accuracy of the edges in speed."""
_ROUNDS = 60
# Between two lobes the first crossing rises to a peak. Peaks seen on the grid from this share of K_e
# on are followed up: the true one may be above, and a stable gap.
_PEAKS_FROM = 0.6
_PEAK_ROUNDS = 8
_PEAK_POINTS = np.array([1, 2, 3, 4, 5]) / 6


@dataclass(frozen=True)
class SpeedInterval:
    """Rotor speeds at which the blade is unstable with the liner's K_e.

    Attributes
    ----------
    low_hz, high_hz
        Edges, Hz.
    open_low, open_high
        True where the interval goes on beyond the range looked at.
    proven
        False where the exact core could not prove a point the interval rests on.
    """

    low_hz: float
    high_hz: float
    open_low: bool
    open_high: bool
    proven: bool


def unstable_speeds(
    blade: Blade,
    contact: ContactConfiguration,
    speed_range_hz: tuple[float, float],
    ke: float,
    deep: list[float],
) -> tuple[tuple[SpeedInterval, ...], bool]:
    """Intervals of speed with `ke` unstable; and whether all points they rest on are proven.

    Points are the speeds of an adaptive map, the tips of lobes and the peaks between them, so that neither an
    unstable interval nor a stable gap lies unseen between two; edges between them are bisected, and
    given from the unstable side.

    Parameters
    ----------
    ke
        N/m.
    deep
        Speeds of the tips of all lobes below `ke`, Hz: an unstable interval may be as narrow as its tip.
    """
    reach = min(SEARCH_MARGIN * ke, KE_LIMIT)
    seen = _Points.of(adaptive_map(blade, contact, *speed_range_hz, reach).boundary, ke)
    if deep:
        tips = boundary(blade, contact, np.array(deep), reach, truncation=False)
        seen = seen.joined(_Points.of(tips, ke))
    seen = _with_gaps(blade, contact, seen, ke, reach)
    speed, unstable, sure = seen.speed_hz, seen.unstable, seen.sure
    change = np.flatnonzero(unstable[1:] != unstable[:-1])
    stable_side = np.where(unstable[change], speed[change + 1], speed[change])
    unstable_side = np.where(unstable[change], speed[change], speed[change + 1])
    for _ in range(_ROUNDS):
        wide = np.abs(stable_side - unstable_side) > EDGE_TOLERANCE * unstable_side
        if not wide.any():
            break
        middle = 0.5 * (stable_side[wide] + unstable_side[wide])
        found = boundary(blade, contact, middle, reach, truncation=False)
        there = unstable_at(found, ke)
        stable_side[wide] = np.where(there, stable_side[wide], middle)
        unstable_side[wide] = np.where(there, middle, unstable_side[wide])
    # The unstable side of each edge: what is called unstable was seen to be.
    edges = list(unstable_side)
    opens = [*([float(speed[0])] if unstable[0] else [])]
    starts = opens + [e for e, i in zip(edges, change, strict=True) if unstable[i + 1]]
    ends = [e for e, i in zip(edges, change, strict=True) if unstable[i]]
    ends += [float(speed[-1])] if unstable[-1] else []
    intervals = tuple(
        SpeedInterval(
            float(low),
            float(high),
            bool(unstable[0]) and k == 0,
            bool(unstable[-1]) and k == len(starts) - 1,
            bool(sure[(speed >= low) & (speed <= high)].all()),
        )
        for k, (low, high) in enumerate(zip(starts, ends, strict=True))
    )
    return intervals, bool(sure.all())


def unstable_at(found: BoundarySolution, ke: float) -> np.ndarray:
    """True where `ke` lies in an interval of instability, edges included; shape (m,)."""
    return np.array([any(low <= ke <= high for low, high in row) for row in found.unstable_ke], dtype=bool)


@dataclass(frozen=True)
class _Points:
    """What is known at rising speeds, each of shape (m,): first crossing (infinite where none), K_e unstable,
    and proven."""

    speed_hz: np.ndarray
    first: np.ndarray
    unstable: np.ndarray
    sure: np.ndarray

    @classmethod
    def of(cls, found: BoundarySolution, ke: float) -> _Points:
        first = np.nan_to_num(found.critical_ke, nan=np.inf)
        return cls(found.speed_hz, first, unstable_at(found, ke), np.isfinite(found.error_estimate))

    def joined(self, other: _Points) -> _Points:
        speed, at = np.unique(np.r_[self.speed_hz, other.speed_hz], return_index=True)
        columns = ((self.first, other.first), (self.unstable, other.unstable), (self.sure, other.sure))
        return _Points(speed, *(np.r_[a, b][at] for a, b in columns))


def _with_gaps(
    blade: Blade, contact: ContactConfiguration, seen: _Points, ke: float, reach: float
) -> _Points:
    """The points, and those that climb each peak of the first crossing until it reaches `ke` or is known."""
    for _ in range(_PEAK_ROUNDS):
        left, here, right = seen.first[:-2], seen.first[1:-1], seen.first[2:]
        buried = seen.unstable[:-2] & seen.unstable[1:-1] & seen.unstable[2:]
        peak = 1 + np.flatnonzero(buried & (here >= left) & (here >= right) & (here > _PEAKS_FROM * ke))
        wide = seen.speed_hz[peak + 1] - seen.speed_hz[peak - 1] > EDGE_TOLERANCE * seen.speed_hz[peak]
        peak = peak[wide]
        if len(peak) == 0:
            break
        a, b, c = seen.speed_hz[peak - 1], seen.speed_hz[peak], seen.speed_hz[peak + 1]
        asked = np.r_[
            (a[:, None] + (b - a)[:, None] * _PEAK_POINTS).ravel(),
            (b[:, None] + (c - b)[:, None] * _PEAK_POINTS).ravel(),
        ]
        more = boundary(blade, contact, np.unique(asked), reach, truncation=False)
        seen = seen.joined(_Points.of(more, ke))
    return seen

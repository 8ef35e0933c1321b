"""Edges of unstable regions as lines from speed to speed."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from service.paper_figures.lobes import Interval, Lobes


@dataclass
class Outline:
    """One unstable region, followed over rising speed while its interval of K_e overlaps the one before.

    Attributes
    ----------
    ratio, low, high
        Ω/f₁ and the ends of the interval there, N/m.
    begins, ends
        Ω/f₁ between two speeds where the region appears and where it is gone; None at the ends of the chart.
    reach
        N/m up to which instability was looked for.
    """

    reach: float
    begins: float | None
    ratio: list[float] = field(default_factory=list)
    low: list[float] = field(default_factory=list)
    high: list[float] = field(default_factory=list)
    ends: float | None = None

    def add(self, ratio: float, interval: Interval) -> None:
        """The region at the next speed."""
        self.ratio.append(ratio)
        self.low.append(interval[0])
        self.high.append(interval[1])

    @property
    def polygon(self) -> tuple[np.ndarray, np.ndarray]:
        """Its whole circumference: Ω/f₁ and K_e."""
        left, right = self._tip(self.begins, 0), self._tip(self.ends, -1)
        x = [*left[0], *self.ratio, *right[0], *self.ratio[::-1]]
        y = [*left[1], *self.low, *right[1], *self.high[::-1]]
        return np.array(x), np.array(y)

    @property
    def edge(self) -> tuple[np.ndarray, np.ndarray]:
        """What parts it from stability: the circumference without where it was not followed further."""
        left, right = self._tip(self.begins, 0), self._tip(self.ends, -1)
        upper = [np.nan if high >= self.reach else high for high in self.high[::-1]]
        # A gap, so that the lower edge is not joined to the upper one at an end of the chart.
        x = [*left[0], *self.ratio, *right[0], np.nan, *self.ratio[::-1]]
        y = [*left[1], *self.low, *right[1], np.nan, *upper]
        return np.array(x), np.array(y)

    def _tip(self, at: float | None, end: int) -> tuple[list[float], list[float]]:
        """Where the region closes between two speeds: far up, or half way between its edges."""
        if at is None:
            return [], []
        low, high = self.low[end], self.high[end]
        return [at], [self.reach if high >= self.reach else 0.5 * (low + high)]


def outlines(lobes: Lobes, low: float, high: float) -> list[Outline]:
    """Unstable regions from `low` to `high` in Ω/f₁, each as a line.

    Examples
    --------
    >>> one = Lobes("", np.array([0.1, 0.2, 0.3]), ((), ((2.0, 5.0),), ()), ke_max=5.0)
    >>> [line.edge[0][:3].round(2).tolist() for line in outlines(one, 0.0, 1.0)]
    [[0.15, 0.2, 0.25]]
    """
    at = np.flatnonzero((lobes.ratio >= low - 1e-12) & (lobes.ratio <= high + 1e-12))
    reach = max((b for found in lobes.unstable_ke for _, b in found), default=lobes.ke_max)
    done: list[Outline] = []
    growing: list[Outline] = []
    before: float | None = None
    for i in at:
        ratio = float(lobes.ratio[i])
        between = None if before is None else 0.5 * (before + ratio)
        left = list(lobes.unstable_ke[i])
        kept = []
        for region in growing:
            last = region.low[-1], region.high[-1]
            next_one = next((iv for iv in left if iv[0] <= last[1] and last[0] <= iv[1]), None)
            if next_one is None:
                region.ends = between
                done.append(region)
            else:
                left.remove(next_one)
                region.add(ratio, next_one)
                kept.append(region)
        for interval in left:
            fresh = Outline(reach, between)
            fresh.add(ratio, interval)
            kept.append(fresh)
        growing, before = kept, ratio
    return done + growing

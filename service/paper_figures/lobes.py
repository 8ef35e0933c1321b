"""Where a blade is unstable, speed by speed, and the measures two such diagrams are compared by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.blade import Blade
from sdm_core.boundary import boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.lobe_tips import lobe_grid

# Flanks are followed beyond the axis, so that they leave it where they do.
REACH = 1.2
# Speeds that draw the wide lobes, beside several on each of the narrow ones.
EVEN_SPEEDS = 500

Interval = tuple[float, float]


@dataclass(frozen=True)
class Lobes:
    """One curve of a figure.

    Attributes
    ----------
    label
        Its name in the key.
    ratio
        Rising Ω/f₁, shape (m,).
    unstable_ke
        Intervals of instability at each speed, N/m, up to `REACH` times `ke_max`.
    ke_max
        Top of the axis, N/m: measures are taken up to it.
    """

    label: str
    ratio: np.ndarray
    unstable_ke: tuple[tuple[Interval, ...], ...]
    ke_max: float

    @property
    def first_ke(self) -> np.ndarray:
        """Least unstable K_e at each speed, N/m; infinite where there is none up to `ke_max`."""
        first = np.array([found[0][0] if found else np.inf for found in self.unstable_ke])
        return np.where(first <= self.ke_max, first, np.inf)

    def least(self, low: float, high: float) -> tuple[float, float] | None:
        """(K_e in N/m, Ω/f₁) of the deepest lobe from `low` to `high`; None without one."""
        first = np.where((self.ratio >= low) & (self.ratio <= high), self.first_ke, np.inf)
        at = int(np.argmin(first))
        return (float(first[at]), float(self.ratio[at])) if np.isfinite(first[at]) else None

    def lowest_unstable(self, low: float, high: float) -> float | None:
        """The least Ω/f₁ from `low` to `high` with any unstable K_e up to `ke_max`."""
        some = np.isfinite(self.first_ke) & (self.ratio >= low) & (self.ratio <= high)
        return float(self.ratio[np.argmax(some)]) if some.any() else None

    def share(self, low: float, high: float) -> float:
        """Unstable share of the rectangle from `low` to `high` in Ω/f₁ and up to `ke_max` in K_e."""
        return self._share(np.array([_length(found, self.ke_max) for found in self.unstable_ke]), low, high)

    def share_not_in(self, other: Lobes, low: float, high: float) -> float:
        """Share of that rectangle that is unstable here and stable in `other`, on the same speeds."""
        assert np.array_equal(self.ratio, other.ratio)
        alone = [
            _length(mine, self.ke_max) - _length(_common(mine, theirs), self.ke_max)
            for mine, theirs in zip(self.unstable_ke, other.unstable_ke, strict=True)
        ]
        return self._share(np.array(alone), low, high)

    def stretches(self, ke: float, low: float, high: float) -> list[tuple[float, float]]:
        """Stretches of Ω/f₁ from `low` to `high` over which this K_e is unstable."""
        inside = np.array([any(a <= ke <= b for a, b in found) for found in self.unstable_ke])
        inside &= (self.ratio >= low) & (self.ratio <= high)
        steps = np.diff(np.r_[0, inside.astype(int), 0])
        starts, ends = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1) - 1
        return [(float(self.ratio[a]), float(self.ratio[b])) for a, b in zip(starts, ends, strict=True)]

    def _share(self, length: np.ndarray, low: float, high: float) -> float:
        at = (self.ratio >= low - 1e-12) & (self.ratio <= high + 1e-12)
        return float(np.trapezoid(length[at], self.ratio[at]) / (self.ke_max * np.ptp(self.ratio[at])))


def speed_grid(
    blades: list[tuple[Blade, ContactConfiguration]],
    first_frequency_hz: float,
    ratios: tuple[float, float],
    ke_max: float,
    *,
    also: tuple[float, ...] = (),
    even: int = EVEN_SPEEDS,
    between: bool = True,
) -> np.ndarray:
    """Speeds in Hz that follow every lobe of every blade and contact of a figure, rising.

    Parameters
    ----------
    also
        Ω/f₁ that measures begin or end at.
    between
        Twice as many, so that the tips look round.
    """
    evenly = first_frequency_hz * np.union1d(np.linspace(*ratios, even), also)
    grid = evenly
    for blade, contact in blades:
        grid = np.union1d(grid, lobe_grid(blade, contact, evenly, REACH * ke_max))
    if between:
        grid = np.union1d(grid, 2.0 / (1.0 / grid[:-1] + 1.0 / grid[1:]))
    return grid[np.r_[True, np.diff(grid) > 1e-9 * grid[-1]]]


def exact_lobes(
    label: str,
    blade: Blade,
    contact: ContactConfiguration,
    speed_hz: np.ndarray,
    first_frequency_hz: float,
    ke_max: float,
) -> Lobes:
    """By the closed form, proven by the root count; beyond the modal data from extrapolated ones."""
    found = boundary(blade, contact, speed_hz, REACH * ke_max, extrapolate=True, truncation=False)
    return Lobes(label, speed_hz / first_frequency_hz, found.unstable_ke, ke_max)


def _length(intervals: tuple[Interval, ...], ke_max: float) -> float:
    return sum(max(0.0, min(high, ke_max) - low) for low, high in intervals)


def _common(a: tuple[Interval, ...], b: tuple[Interval, ...]) -> tuple[Interval, ...]:
    pairs = ((max(low, lo), min(high, hi)) for low, high in a for lo, hi in b)
    return tuple((low, high) for low, high in pairs if low < high)

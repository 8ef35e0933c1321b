"""Stability maps refined only at the boundary: few speeds where it is smooth, many where it bends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from sdm_core.blade import Blade
from sdm_core.boundary import BoundarySolution, boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import check_range, lobe_grid
from sdm_core.validation import KE_LIMIT, number

DEFAULT_TOLERANCE = 0.02
_NARROWEST = 1e-3  # share of a speed between neighbours: an edge that jumps is located so far
_MOST_SPEEDS = 20_000

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class AdaptiveMap:
    """Intervals of instability over rotor speeds that lie as densely as the boundary asks for.

    Attributes
    ----------
    boundary
        At rising speeds.
    within
        Largest relative difference of K_e from a straight line between neighbours, where the number of
        edges stays the same; infinite where the speeds were not enough.
    """

    boundary: BoundarySolution
    within: float

    def stable(self, speed_hz: np.ndarray, ke: np.ndarray) -> np.ndarray:
        """1.0 stable, 0.0 unstable, NaN where a neighbour is not decided; edges interpolated in 1/Ω.

        Between speeds with different numbers of edges the nearer one tells.

        Raises
        ------
        InvalidInput
            For shapes that do not go together, and points outside the map.
        """
        known, intervals = self.boundary.speed_hz, self.boundary.unstable_ke
        try:
            speed_hz, ke = np.broadcast_arrays(np.asarray(speed_hz, float), np.asarray(ke, float))
        except (TypeError, ValueError):
            raise InvalidInput("ke", ke, "give numbers in a shape that goes with speed_hz") from None
        for name, values, low, high, unit in (
            ("speed_hz", speed_hz, known[0], known[-1], "Hz"),
            ("ke", ke, 0.0, self.boundary.ke_max, "N/m"),
        ):
            inside = (values >= low) & (values <= high)
            if not inside.all():
                raise InvalidInput(
                    name,
                    float(values[~inside].flat[0]),
                    f"stay from {low:g} to {high:g} {unit}: the map ends there",
                )
        out = np.ones(speed_hz.shape)
        right = np.clip(np.searchsorted(known, speed_hz), 1, len(known) - 1)
        share = (1 / known[right - 1] - 1 / speed_hz) / (1 / known[right - 1] - 1 / known[right])
        unsure = ~np.isfinite(self.boundary.error_estimate)
        for at in np.ndindex(speed_hz.shape):
            a, b = intervals[right[at] - 1], intervals[right[at]]
            if len(a) == len(b):
                edges = (1 - share[at]) * np.array(a) + share[at] * np.array(b)
            else:
                edges = np.array(a if share[at] < 0.5 else b)
            if any(low < ke[at] < high for low, high in edges.reshape(-1, 2)):
                out[at] = 0.0
            elif unsure[right[at] - 1] or unsure[right[at]]:
                out[at] = np.nan
        return out


def adaptive_map(
    blade: Blade,
    contact: ContactConfiguration,
    low_hz: float,
    high_hz: float,
    ke_max: float,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    progress: Progress | None = None,
) -> AdaptiveMap:
    """All edges of instability from `low_hz` to `high_hz`, to a tolerance between the speeds too.

    At each speed the edges are exact (`boundary`). Starting from several speeds a lobe, a speed is
    added between two neighbours until every edge is straight in 1/Ω to `tolerance`, and until the
    place where an edge begins or ends is known to 1e-3 of the speed.

    Parameters
    ----------
    low_hz, high_hz
        Range of rotor speeds, Hz.
    ke_max
        N/m.
    tolerance
        Relative in K_e, between speeds.
    progress
        Called with speeds solved and their number as far as it is known.

    Raises
    ------
    InvalidInput
        For an unusable range, stiffness or tolerance, or more lobes than can be followed.
    """
    check_range(low_hz, high_hz)
    number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    number("tolerance", tolerance, 1e-6, 1.0, "of K_e")
    known = boundary(
        blade,
        contact,
        lobe_grid(blade, contact, np.array([low_hz, high_hz]), ke_max),
        ke_max,
        truncation=False,
    )
    untested = np.ones(len(known.speed_hz) - 1, dtype=bool)
    within = 0.0
    while True:
        period = 1.0 / known.speed_hz
        wide = np.abs(np.diff(period)) > _NARROWEST * period[1:]
        at = np.flatnonzero(untested & wide)
        if len(at) == 0:
            break
        if len(period) + len(at) > _MOST_SPEEDS:
            within = np.inf
            break
        middle = boundary(blade, contact, 2.0 / (period[at] + period[at + 1]), ke_max, truncation=False)
        if progress is not None:
            progress(len(period), len(period) + len(at))
        bend = np.array([_bend(known, middle, int(i), k) for k, i in enumerate(at)])
        again = bend > tolerance
        within = max(within, float(bend[~again].max(initial=0.0)))
        known = _merged(known, middle)
        # Both halves of an interval that bends are looked at again.
        fresh = np.zeros(len(untested), dtype=bool)
        fresh[at[again]] = True
        halves = np.repeat(fresh, np.where(np.isin(np.arange(len(untested)), at), 2, 1))
        untested = halves
    return AdaptiveMap(known, within)


def _bend(known: BoundarySolution, middle: BoundarySolution, left: int, at: int) -> float:
    """Largest relative distance of the edges in the middle from a straight line; infinite where they differ
    in number."""
    a, b, m = known.unstable_ke[left], known.unstable_ke[left + 1], middle.unstable_ke[at]
    if not len(a) == len(b) == len(m):
        return np.inf
    if len(m) == 0:
        return 0.0
    line = 0.5 * (np.array(a) + np.array(b))
    return float(np.abs(np.array(m) / line - 1).max())


def _merged(a: BoundarySolution, b: BoundarySolution) -> BoundarySolution:
    order = np.argsort(np.r_[a.speed_hz, b.speed_hz], kind="stable")
    columns: dict[str, Any] = {
        f.name: np.concatenate([getattr(a, f.name), getattr(b, f.name)])[order]
        for f in fields(BoundarySolution)
        if isinstance(getattr(a, f.name), np.ndarray)
    }
    intervals = a.unstable_ke + b.unstable_ke
    return replace(a, **columns, unstable_ke=tuple(intervals[i] for i in order), cost_s=a.cost_s + b.cost_s)

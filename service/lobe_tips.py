"""Tips of the stability lobes: they fall between the speeds of any grid, so they are searched for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sdm_core.blade import Blade
from service.speeds import evenly_timed
from training.answers import BoundaryAnswers

# Near its tip a lobe is 1/|sin(2πf/Ω)| wide in K_e: 16 speeds a lobe of the highest mode bracket
# every tip, and a parabola through the lowest three ranks the tips to about 0.1 %.
SPEEDS_PER_LOBE = 16
FEWEST_SPEEDS, MOST_SPEEDS = 64, 2000
SPEEDS_PER_ROUND = 9
MOST_ROUNDS = 10


@dataclass(frozen=True)
class CriticalSpeed:
    """Tip of a lobe: the rotor speed at which the least K_e of its neighbourhood destabilises.

    Attributes
    ----------
    ke
        N/m, by the exact core.
    speed_hz, speed_rpm, speed_ratio
        The rotor speed in revolutions per second, per minute, and over the first frequency at rest.
    chatter_hz
        Frequency of the vibration that starts.
    lobes_per_revolution
        Wear lobes round the casing, chatter_hz / speed_hz.
    error_estimate
        Relative error of `ke`: the core's at that speed, plus what the last round still changed.
    """

    ke: float
    speed_hz: float
    speed_rpm: float
    speed_ratio: float
    chatter_hz: float
    lobes_per_revolution: float
    error_estimate: float


def lobe_grid(blade: Blade, low_hz: float, high_hz: float) -> np.ndarray:
    """Rising speeds in Hz dense enough to put several on every lobe of every mode."""
    highest = float(max(state.frequency_hz.max() for state in blade.states))
    lobes = highest * (1.0 / low_hz - 1.0 / high_hz)
    count = int(np.clip(np.ceil(SPEEDS_PER_LOBE * lobes), FEWEST_SPEEDS, MOST_SPEEDS))
    return evenly_timed(low_hz, high_hz, count)


def deepest_lobe_tips(
    grid: BoundaryAnswers,
    exact: Callable[[np.ndarray], BoundaryAnswers],
    first_frequency_hz: float,
    *,
    count: int = 8,
    tolerance: float = 1e-4,
) -> tuple[CriticalSpeed, ...]:
    """The tips of the `count` deepest lobes seen on a grid of speeds, smallest K_e first.

    Every lobe's minimum on the grid is bracketed by its neighbours. Each round asks the exact core
    for nine speeds across all brackets in one call and keeps the two gaps beside the lowest, until
    no K_e changes by more than `tolerance`, relative.

    Parameters
    ----------
    grid
        First crossings over rising speeds.
    exact
        First crossings by the exact core at given speeds, shape (m,).
    first_frequency_hz
        At rest, for `speed_ratio`.

    Returns
    -------
    Empty when no speed of the grid has a crossing, or the exact core confirms none.
    """
    period, at = 1.0 / grid.speed_hz, _lowest_minima(grid.critical_ke, count)
    if len(at) == 0:
        return ()
    low, high = period[np.maximum(at - 1, 0)], period[np.minimum(at + 1, len(period) - 1)]
    before = np.full(len(at), np.inf)
    for _ in range(MOST_ROUNDS):
        tau = np.linspace(low, high, SPEEDS_PER_ROUND)
        answer = exact(1.0 / tau.ravel())
        ke = np.nan_to_num(answer.critical_ke, nan=np.inf).reshape(tau.shape)
        best = ke.argmin(axis=0)
        column = np.arange(len(at))
        least = ke[best, column]
        with np.errstate(invalid="ignore"):
            change = np.where(np.isfinite(least) & np.isfinite(before), np.abs(before - least) / least, np.inf)
        low = tau[np.maximum(best - 1, 0), column]
        high = tau[np.minimum(best + 1, SPEEDS_PER_ROUND - 1), column]
        before = least
        if (change[np.isfinite(least)] <= tolerance).all():
            break
    flat = best * len(at) + column
    tips = [
        _tip(answer, int(i), float(step), first_frequency_hz)
        for i, step in zip(flat, change, strict=True)
        if np.isfinite(answer.critical_ke[i])
    ]
    return tuple(sorted(tips, key=lambda tip: tip.ke))


def _lowest_minima(critical_ke: np.ndarray, count: int) -> np.ndarray:
    """Indices of the `count` lowest local minima, by the parabola through each and its neighbours."""
    ke = np.nan_to_num(critical_ke, nan=np.inf)
    walled = np.concatenate(([np.inf], ke, [np.inf]))
    left, right = walled[:-2], walled[2:]
    at = np.flatnonzero(np.isfinite(ke) & (ke <= left) & (ke < right))
    a, b, c = left[at], ke[at], right[at]
    inside = np.isfinite(a) & np.isfinite(c) & (a + c > 2 * b)
    vertex = b.copy()
    a, b, c = a[inside], b[inside], c[inside]
    vertex[inside] = b - (a - c) ** 2 / (8 * (a + c - 2 * b))
    return at[np.argsort(vertex, kind="stable")[:count]]


def _tip(answer: BoundaryAnswers, i: int, change: float, first_frequency_hz: float) -> CriticalSpeed:
    speed, chatter = float(answer.speed_hz[i]), float(answer.chatter_hz[i])
    return CriticalSpeed(
        ke=float(answer.critical_ke[i]),
        speed_hz=speed,
        speed_rpm=60.0 * speed,
        speed_ratio=speed / first_frequency_hz,
        chatter_hz=chatter,
        lobes_per_revolution=chatter / speed,
        error_estimate=float(answer.error_estimate[i]) + change,
    )

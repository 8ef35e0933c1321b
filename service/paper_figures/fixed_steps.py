"""Lobes as semi-discretization with a fixed number of steps sees them ([SBL] 2.3 and Fig. 7)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.parallel import available_cores, shared
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.semi_discretization import StructuredAveraged
from service.paper_figures.lobes import REACH, Interval, Lobes

# K_e at which ln|μ| is looked at before its zeros are closed in on: in permanent contact an unstable stretch
# nearly always goes on to the top of the axis, so few are enough.
_SCANNED = 5
_WITHIN = 3e-4  # of the axis, where a zero is placed
_SPEEDS_A_PART = 25


@dataclass(frozen=True)
class _Part:
    problems: list[RubbingBlade]
    steps: int
    reach: float


def fixed_step_lobes(
    label: str,
    steps: int,
    blade: Blade,
    contact: ContactConfiguration,
    speed_hz: np.ndarray,
    first_frequency_hz: float,
    ke_max: float,
    done: Callable[[], None],
) -> Lobes:
    """Where the scheme's largest multiplier leaves the unit circle: zeros of ln|μ| over K_e at each speed.

    The scheme is the paper's, averaged (Eq. 8), in the form that keeps the contact history only and has
    the same multipliers. An unstable stretch of K_e narrower than a fifth of the axis may be missed.

    Parameters
    ----------
    steps
        N.
    done
        Called after each `parts_of` the speeds.
    """
    problems = RubbingBlade.at_speeds(blade, contact, speed_hz)
    parts = [
        _Part(problems[i : i + _SPEEDS_A_PART], steps, REACH * ke_max)
        for i in range(0, len(problems), _SPEEDS_A_PART)
    ]
    found: list[list[tuple[Interval, ...]]] = [[] for _ in parts]
    for i, intervals in shared(_solved, parts, min(2, available_cores())):
        found[i] = intervals
        done()
    every = tuple(one for part in found for one in part)
    return Lobes(label, speed_hz / first_frequency_hz, every, ke_max)


def parts_of(speed_hz: np.ndarray) -> int:
    """How often `fixed_step_lobes` says that some of it is done."""
    return -(-len(speed_hz) // _SPEEDS_A_PART)


def _solved(part: _Part) -> list[tuple[Interval, ...]]:
    scheme = StructuredAveraged(part.steps)

    def growth(problem: RubbingBlade, ke: float) -> float:
        return float(np.log(np.abs(scheme.multipliers(problem.with_ke(ke).delay_equation(), 1)[0])))

    def at(problem: RubbingBlade) -> Callable[[float], float]:
        return lambda ke: growth(problem, ke)

    return [unstable_intervals(at(problem), part.reach) for problem in part.problems]


def unstable_intervals(growth: Callable[[float], float], reach: float) -> tuple[Interval, ...]:
    """Intervals of (0, reach] over which `growth` is above 0, it being below at 0.

    Examples
    --------
    >>> [[round(edge, 3) for edge in found] for found in unstable_intervals(lambda ke: ke - 0.3, 1.0)]
    [[0.3, 1.0]]
    """
    ke = np.linspace(0.0, reach, _SCANNED + 1)
    value = np.array([-np.inf, *(growth(k) for k in ke[1:])])
    ke, value = _with_peaks(growth, ke, value)
    edges = [
        # ln|μ| falls without bound towards K_e = 0 where |μ| does: the zero lies above the first value.
        float(brentq(growth, max(a, 1e-6 * reach), b, xtol=_WITHIN * reach))
        for a, b, before, after in zip(ke[:-1], ke[1:], value[:-1], value[1:], strict=True)
        if (before > 0) != (after > 0)
    ]
    if len(edges) % 2:
        edges.append(float(reach))
    return tuple(zip(edges[::2], edges[1::2], strict=True))


def _with_peaks(
    growth: Callable[[float], float], ke: np.ndarray, value: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The samples, and one more wherever the parabola through three rises above 0 between stable ones."""
    more = []
    for i in range(2, len(ke) - 1):
        a, b, c = value[i - 1 : i + 2]
        if max(a, b, c) < 0 and b > max(a, c):
            peak = ke[i] + 0.5 * (ke[1] - ke[0]) * (a - c) / (a - 2 * b + c)
            if b - (a - c) ** 2 / (8 * (a - 2 * b + c)) > 0.5 * b:
                more.append(float(peak))
    if not more:
        return ke, value
    joined = np.r_[ke, more]
    values = np.r_[value, [growth(k) for k in more]]
    rising = np.argsort(joined)
    return joined[rising], values[rising]

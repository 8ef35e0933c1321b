"""Tips of the stability lobes: they fall between the speeds of any grid, so they are searched for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from sdm_core.blade import Blade
from sdm_core.boundary import boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.rubbing_blade import check_blade_and_contact
from sdm_core.validation import KE_LIMIT, SPEED_LIMITS_HZ, number

# A lobe's edge is about K_e ∝ 1/|sin(2πf/Ω)|: 8 speeds a lobe of the highest mode bracket every tip,
# and a parabola through the lowest three ranks the tips to better than 1 %.
SPEEDS_PER_LOBE = 8
FEWEST_SPEEDS, MOST_SPEEDS = 64, 2000
# Between two such speeds a lobe's edge rises to at most 1/cos(π/8) = 1.08 times its tip: looked for
# up to 1.2 times the largest K_e of interest, no tip below it hides between the speeds of a grid.
SEARCH_MARGIN = 1.2
SPEEDS_TO_BEGIN = 9
# How well a grid ranks lobes: the parabola through three of its speeds misses a tip by 1 % of K_e or less.
_RANKED_TO = 0.03
MOST_ROUNDS = 10


class FirstCrossings(Protocol):
    """First crossings over rotor speeds, as a `BoundarySolution` has them, each of shape (m,)."""

    @property
    def speed_hz(self) -> np.ndarray: ...
    @property
    def critical_ke(self) -> np.ndarray: ...
    @property
    def chatter_hz(self) -> np.ndarray: ...
    @property
    def error_estimate(self) -> np.ndarray: ...


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
        Relative error of `ke`: the core's at that speed, plus what the last round still changed or a parabola
        through the lowest speeds still lacks.
    """

    ke: float
    speed_hz: float
    speed_rpm: float
    speed_ratio: float
    chatter_hz: float
    lobes_per_revolution: float
    error_estimate: float

    @property
    def proven(self) -> bool:
        """False where the core could not prove that `ke` is the first crossing."""
        return bool(np.isfinite(self.error_estimate))


def evenly_timed(low_hz: float, high_hz: float, count: int) -> np.ndarray:
    """`count` rising speeds in Hz, evenly spaced in 1/Ω, in which lobes are periodic (DESIGN, fact 6)."""
    speeds = 1.0 / np.linspace(1.0 / low_hz, 1.0 / high_hz, count)
    speeds[0], speeds[-1] = low_hz, high_hz  # not an ulp beyond the modal data
    return speeds


def check_range(low_hz: float, high_hz: float) -> None:
    """Two rotor speeds, rising by more than rounding.

    Raises
    ------
    InvalidInput
        Naming the field, the value and the remedy.
    """
    number("low_hz", low_hz, *SPEED_LIMITS_HZ, "Hz")
    number("high_hz", high_hz, *SPEED_LIMITS_HZ, "Hz")
    if low_hz >= high_hz * (1 - 1e-6):
        raise InvalidInput("low_hz", low_hz, f"give a speed below high_hz = {high_hz:g} Hz, not next to it")


def least_critical_ke(
    blade: Blade,
    contact: ContactConfiguration,
    low_hz: float,
    high_hz: float,
    ke_max: float,
    *,
    count: int = 8,
    tolerance: float = 1e-4,
) -> tuple[CriticalSpeed, ...]:
    """The tips of the deepest lobes over a range of speeds, smallest K_e first, by the exact core.

    The first is the smallest K_e that destabilises anywhere in the range; tips fall between the
    speeds of any grid, so each is refined until K_e changes by no more than `tolerance`, relative.

    Parameters
    ----------
    low_hz, high_hz
        Range of rotor speeds, Hz.
    ke_max
        Tips above it are left out, N/m.

    Raises
    ------
    InvalidInput
        For an unusable range or stiffness, or more lobes than can be followed.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> found = least_critical_ke(
    ...     example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), 150.0, 300.0, 2.5e4
    ... )
    >>> found[0].ke <= found[1].ke
    True
    """
    check_range(low_hz, high_hz)
    number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    number("tolerance", tolerance, 1e-10, 1.0, "of K_e")
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise InvalidInput("count", count, "give a whole number from 1 up")
    reach = min(SEARCH_MARGIN * ke_max, KE_LIMIT)

    def exact(speed_hz: np.ndarray) -> FirstCrossings:
        return boundary(blade, contact, speed_hz, reach, truncation=False)

    grid = lobe_grid(blade, contact, np.array([low_hz, high_hz]), ke_max)
    first = blade.first_frequency_hz
    return deepest_lobe_tips(exact(grid), exact, first, ke_max=ke_max, count=count, tolerance=tolerance)


def lobe_grid(blade: Blade, contact: ContactConfiguration, even_hz: np.ndarray, ke_max: float) -> np.ndarray:
    """Rising speeds in Hz dense enough to put several on every lobe that reaches below `ke_max`.

    Evenly spaced in 1/Ω, as lobes are, from end to end of `even_hz`, and those of `even_hz`: the
    abscissa of a map, rising. They draw the steep flanks of the wide lobes at high speed.

    Raises
    ------
    InvalidInput
        When so many lobes lie in the range that `MOST_SPEEDS` would pass some by.
    """
    check_blade_and_contact(blade, contact)
    low_hz, high_hz = float(even_hz[0]), float(even_hz[-1])
    highest = _highest_frequency(blade, contact, ke_max)
    lobes = highest * (1.0 / low_hz - 1.0 / high_hz)
    count = max(int(np.ceil(SPEEDS_PER_LOBE * lobes)), FEWEST_SPEEDS)
    if count > MOST_SPEEDS:
        most = MOST_SPEEDS // SPEEDS_PER_LOBE
        # Rounded up, so that the number shown is accepted.
        least = np.ceil(1e3 / (most / highest + 1.0 / high_hz)) / 1e3
        raise InvalidInput(
            "speed",
            f"{low_hz:g} to {high_hz:g} Hz",
            f"narrow it, e.g. from {least:.10g} Hz: {lobes:.0f} lobes of the mode at {highest:.6g} Hz lie "
            f"in it, and at most {most} can be followed",
        )
    rising = np.union1d(evenly_timed(low_hz, high_hz, count), even_hz)
    return rising[np.concatenate(([True], np.diff(rising) > 1e-9 * high_hz))]


def _highest_frequency(blade: Blade, contact: ContactConfiguration, ke_max: float) -> float:
    """Of the modes whose lobes can reach below `ke_max`, Hz.

    Alone, mode j is stable below 2ξ_j(1 + ξ_j)ω_j²/G_jj (DESIGN, section 6). Other modes move that
    little where frequencies are many bandwidths apart; a mode counts up to four times `ke_max`.
    """
    weights, damping = contact.weight_vector(blade.tip_nodes), blade.damping_ratio
    highest = blade.first_frequency_hz
    for state in blade.states:
        strength = state.mode_shape**2 @ weights
        alone = 2 * damping * (1 + damping) * (2 * np.pi * state.frequency_hz) ** 2
        highest = max(highest, *state.frequency_hz[alone <= 4 * ke_max * strength], highest)
    return float(highest)


def deepest_lobe_tips(
    grid: FirstCrossings,
    exact: Callable[[np.ndarray], FirstCrossings],
    first_frequency_hz: float,
    *,
    ke_max: float,
    count: int = 8,
    tolerance: float = 1e-4,
) -> tuple[CriticalSpeed, ...]:
    """The tips of the `count` deepest lobes seen on a grid of speeds, smallest K_e first.

    Every lobe's minimum on the grid is bracketed by its neighbours. The exact core is asked for nine
    speeds across each bracket, then for three in each gap beside the lowest, all lobes in one call,
    until a lobe's K_e changes by no more than `tolerance`, relative.

    Parameters
    ----------
    grid
        First crossings over rising speeds.
    exact
        First crossings by the exact core at given speeds, shape (m,).
    first_frequency_hz
        At rest, for `speed_ratio`.
    ke_max
        Tips above it are left out, N/m. `grid` and `exact` should look up to `SEARCH_MARGIN` times it.

    Returns
    -------
    Empty when no lobe seen on the grid has its tip below `ke_max`, by the exact core.
    """
    period, at = 1.0 / grid.speed_hz, _lowest_minima(grid.critical_ke, count)
    ends = zip(period[np.maximum(at - 1, 0)], period[np.minimum(at + 1, len(period) - 1)], strict=True)
    done: list[_Lobe] = []
    lobes = [_Lobe.unknown() for _ in at]
    asked = [np.linspace(low, high, SPEEDS_TO_BEGIN) for low, high in ends]
    for _ in range(MOST_ROUNDS):
        if not lobes:
            break
        answer = exact(1.0 / np.concatenate(asked))
        parts = np.split(np.arange(len(answer.speed_hz)), np.cumsum([len(a) for a in asked])[:-1])
        told = [lobe.told(answer, part) for lobe, part in zip(lobes, parts, strict=True)]
        done += [lobe for lobe in told if lobe.change <= tolerance]
        lobes = [lobe for lobe in told if lobe.change > tolerance and np.isfinite(lobe.least)]
        asked = [lobe.finer() for lobe in lobes]
    tips = (lobe.tip(first_frequency_hz) for lobe in done + lobes if lobe.least <= ke_max)
    return tuple(sorted(tips, key=lambda tip: tip.ke)[:count])


@dataclass(frozen=True)
class _Lobe:
    """What the exact core said near one lobe's tip, by rising period 1/Ω.

    Attributes
    ----------
    change
        Relative change of the smallest K_e in the last round.
    """

    period: np.ndarray
    ke: np.ndarray
    chatter_hz: np.ndarray
    error_estimate: np.ndarray
    change: float

    @classmethod
    def unknown(cls) -> _Lobe:
        nothing = np.zeros(0)
        return cls(nothing, nothing, nothing, nothing, np.inf)

    @property
    def least(self) -> float:
        return float(self.ke.min(initial=np.inf))

    def told(self, answer: FirstCrossings, part: np.ndarray) -> _Lobe:
        """The lobe with what the core answered at `part` of its speeds."""
        period = np.concatenate((self.period, 1.0 / answer.speed_hz[part]))
        ke = np.concatenate((self.ke, np.nan_to_num(answer.critical_ke[part], nan=np.inf)))
        chatter = np.concatenate((self.chatter_hz, answer.chatter_hz[part]))
        error = np.concatenate((self.error_estimate, answer.error_estimate[part]))
        rising = np.argsort(period)
        least = ke.min()
        change = abs(self.least - least) / least if np.isfinite(self.least) else np.inf
        if np.isfinite(
            change
        ):  # the lowest may have stayed where it was: what lies below it by its neighbours
            change = max(change, _still_below(period[rising], ke[rising]))
        return _Lobe(period[rising], ke[rising], chatter[rising], error[rising], change)

    def finer(self) -> np.ndarray:
        """Periods of the next round: three in each gap beside the lowest."""
        i = int(np.argmin(self.ke))
        near = self.period[max(i - 1, 0) : i + 2]
        return np.concatenate([a + (b - a) * np.array([0.25, 0.5, 0.75]) for a, b in pairwise(near)])

    def tip(self, first_frequency_hz: float) -> CriticalSpeed:
        i = int(np.argmin(self.ke))
        speed, chatter = 1.0 / float(self.period[i]), float(self.chatter_hz[i])
        return CriticalSpeed(
            ke=float(self.ke[i]),
            speed_hz=speed,
            speed_rpm=60.0 * speed,
            speed_ratio=speed / first_frequency_hz,
            chatter_hz=chatter,
            lobes_per_revolution=chatter / speed,
            error_estimate=float(self.error_estimate[i] + self.change),
        )


def _still_below(period: np.ndarray, ke: np.ndarray) -> float:
    """How far below the lowest point its tip may lie, relative: the drop of the parabola through it and its
    neighbours."""
    i = int(np.argmin(ke))
    if i == 0 or i == len(ke) - 1 or not np.isfinite(ke[i - 1 : i + 2]).all():
        return 0.0
    x, y = period[i - 1 : i + 2] - period[i], ke[i - 1 : i + 2] - ke[i]
    left, right = y[0] / x[0], y[2] / x[2]
    bend = (right - left) / (x[2] - x[0])
    slope = left - bend * x[0]
    return float(slope**2 / (4 * bend) / ke[i]) if bend > 0 else 0.0


def _lowest_minima(critical_ke: np.ndarray, count: int) -> np.ndarray:
    """Indices of the `count` lowest local minima, by the parabola through each and its neighbours.

    More where others are so close that the grid cannot tell which are the lowest.
    """
    ke = np.nan_to_num(critical_ke, nan=np.inf)
    walled = np.concatenate(([np.inf], ke, [np.inf]))
    left, right = walled[:-2], walled[2:]
    at = np.flatnonzero(np.isfinite(ke) & (ke <= left) & (ke < right))
    a, b, c = left[at], ke[at], right[at]
    inside = np.isfinite(a) & np.isfinite(c) & (a + c > 2 * b)
    vertex = b.copy()
    a, b, c = a[inside], b[inside], c[inside]
    vertex[inside] = b - (a - c) ** 2 / (8 * (a + c - 2 * b))
    order = np.argsort(vertex, kind="stable")
    close = vertex[order] <= (1 + _RANKED_TO) * vertex[order[count - 1 : count]].max(initial=-np.inf)
    return at[order] if len(order) <= count else at[order[close]]

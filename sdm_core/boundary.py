"""Boundaries over rotor speed, and verdicts on many points: the front door of charts."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.crossings import Crossings
from sdm_core.errors import InvalidInput
from sdm_core.floquet.arc_boundary import boundaries_with_arcs
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.interruption import checkpoint
from sdm_core.permanent_contact.permanent_boundary import permanent_crossings
from sdm_core.permanent_contact.root_count import unstable_root_count
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.truncation import change_of_critical_ke, truncation_warnings
from sdm_core.validation import KE_LIMIT, number, speeds, stiffnesses

CLOSED_FORM = "closed-form boundary, argument principle"
CHARACTERISTIC = "exact characteristic equation, argument principle"
_POINTS_AT_ONCE = 20_000
_ON_AXIS = 1e-9  # of a turn of the multiplier

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class BoundarySolution:
    """First crossing and all intervals of instability at each speed.

    Attributes
    ----------
    speed_hz
        Hz, shape (m,).
    critical_ke
        First crossing, N/m, NaN where there is none below `ke_max`; shape (m,).
    chatter_hz
        Chatter frequency there, Hz.
    error_estimate
        Relative error of `critical_ke`; infinite where the proof did not succeed, also of there
        being no crossing.
    unstable_ke
        Intervals of instability up to `ke_max`, (low, high) in N/m, for each speed. With contact that varies
        round the casing, stiffnesses too high to be decided count as unstable, and what happens within
        0.1 % of K_e, or 0.5 % where contact is very strong, may be missed.
    method
        What was computed, in words.
    truncation_change
        Relative change of `critical_ke` when the mode of highest frequency is dropped (`truncation`), shape
        (m,); NaN where it was not asked for or there is only one mode.
    warnings
        What the user should know, in words.
    cost_s
        Time taken, s.
    """

    speed_hz: np.ndarray
    ke_max: float
    critical_ke: np.ndarray
    chatter_hz: np.ndarray
    error_estimate: np.ndarray
    unstable_ke: tuple[tuple[tuple[float, float], ...], ...]
    method: str
    truncation_change: np.ndarray
    warnings: tuple[str, ...]
    cost_s: float

    @property
    def wear_lobes(self) -> np.ndarray:
        """Lobes that chatter wears into the liner per revolution, chatter frequency over Ω, shape (m,)."""
        return self.chatter_hz / self.speed_hz

    @property
    def crossing(self) -> tuple[str | None, ...]:
        """Kind of each first crossing: ``hopf``, ``flip`` (μ = −1), ``fold`` (μ = 1); None without one."""
        turns = self.wear_lobes % 1.0
        return tuple(
            None
            if np.isnan(turn)
            else "flip"
            if abs(turn - 0.5) < _ON_AXIS
            else "fold"
            if min(turn, 1 - turn) < _ON_AXIS
            else "hopf"
            for turn in turns
        )


def boundary(
    blade: Blade,
    contact: ContactConfiguration,
    speed_hz: np.ndarray,
    ke_max: float,
    *,
    extrapolate: bool = False,
    truncation: bool = True,
    progress: Progress | None = None,
) -> BoundarySolution:
    """Exact stability boundary at each rotor speed.

    In permanent contact the closed form, each first crossing proven on both sides by the root
    count; with arcs the multipliers are followed over K_e.

    Parameters
    ----------
    speed_hz
        Hz, shape (m,).
    ke_max
        N/m.
    truncation
        Whether to find out what the mode of highest frequency contributes, which doubles the cost.
    progress
        Called with speeds solved and their number.

    Raises
    ------
    InvalidInput
        For unusable speeds, stiffness or contact.
    OutOfSpeedRange
        Where the blade's modal data do not reach.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> found = boundary(
    ...     example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), np.array([250.0]), 2.5e4
    ... )
    >>> bool(found.error_estimate[0] < 1e-9)
    True
    """
    start = time.perf_counter()
    speed = speeds("speed_hz", speed_hz)
    number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    problems = RubbingBlade.at_speeds(blade, contact, speed, extrapolate=extrapolate)
    if contact.permanent:
        found = permanent_crossings(problems, ke_max, progress=progress, root_count=unstable_root_count)
    else:
        found = boundaries_with_arcs(problems, ke_max, progress=progress)
    change = np.full(len(speed), np.nan)
    if truncation:
        change = change_of_critical_ke(problems, ke_max, found)
    return BoundarySolution(
        speed,
        float(ke_max),
        np.array([c.ke[0] if len(c.ke) else np.nan for c in found]),
        np.array([c.frequency_hz[0] if len(c.ke) else np.nan for c in found]),
        np.array([_first_error(c) for c in found]),
        tuple(c.unstable_intervals(ke_max) for c in found),
        CLOSED_FORM if contact.permanent else CHARACTERISTIC,
        change,
        truncation_warnings(change),
        time.perf_counter() - start,
    )


def verdicts(
    blade: Blade,
    contact: ContactConfiguration,
    speed_hz: np.ndarray,
    ke: np.ndarray,
    *,
    extrapolate: bool = False,
    progress: Progress | None = None,
    workers: int | None = None,
) -> np.ndarray:
    """Exact verdicts at points (speed, K_e): 1.0 stable, 0.0 unstable, NaN not decided; shape (m,).

    In permanent contact the crossings at a speed decide all points of that speed at once; with arcs
    the multipliers of many points are solved for together.

    Parameters
    ----------
    speed_hz, ke
        Hz and N/m, shape (m,) each.
    progress
        Called with points solved and their number.
    workers
        Processes to share the work with arcs; None as in `batch_multipliers`.
    """
    speed, stiffness = speeds("speed_hz", speed_hz), stiffnesses("ke", ke)
    if len(speed) != len(stiffness):
        raise InvalidInput("ke", f"{len(stiffness)} numbers", f"give one a speed: {len(speed)}")
    unique, index = np.unique(speed, return_inverse=True)
    problems = RubbingBlade.at_speeds(blade, contact, unique, extrapolate=extrapolate)
    if contact.permanent:
        return _permanent_verdicts(problems, index, stiffness, progress)
    out = np.empty(len(speed))
    for start in range(0, len(speed), _POINTS_AT_ONCE):
        checkpoint()
        part = slice(start, start + _POINTS_AT_ONCE)
        points = [problems[i].with_ke(k) for i, k in zip(index[part], stiffness[part], strict=True)]

        def points_done(done: int, _: int, start: int = start) -> None:
            if progress is not None:
                progress(start + done, len(speed))

        found = batch_multipliers(points, dominant=False, progress=points_done, workers=workers)
        out[part] = found.stable
    return out


def _first_error(found: Crossings) -> float:
    if not found.proven:
        return np.inf
    return float(found.error_estimate[0]) if len(found.ke) else 0.0


def _permanent_verdicts(
    problems: list[RubbingBlade], case: np.ndarray, ke: np.ndarray, progress: Progress | None
) -> np.ndarray:
    """Verdicts on points (case, K_e) from the crossings of each case, shape of `ke`."""
    largest = np.zeros(len(problems))
    np.maximum.at(largest, case, ke)
    loaded = np.flatnonzero(largest)

    def points_done(done: int, of: int) -> None:
        if progress is not None:
            progress(len(ke) * done // of, len(ke))

    found = [Crossings.none()] * len(problems)
    solved = permanent_crossings(
        [problems[i] for i in loaded],
        largest[loaded] * (1 + 1e-6),
        progress=points_done,
        root_count=unstable_root_count,
    )
    points_done(1, 1)
    for i, crossings in zip(loaded, solved, strict=True):
        found[i] = crossings
    out = _between_crossings(found, case, ke)
    # Without contact a damped blade is stable, an undamped one on the limit.
    damped = np.array([(problem.damping_ratio > 0).all() for problem in problems])
    return np.where(ke == 0, np.where(damped, 1.0, np.nan)[case], out)


def _between_crossings(found: list[Crossings], case: np.ndarray, ke: np.ndarray) -> np.ndarray:
    """1.0 with no unstable roots, 0.0 with some, NaN on a crossing or where the proof failed."""
    number = np.array([len(crossings.ke) for crossings in found])
    owner = np.repeat(np.arange(len(found)), number)
    at = np.concatenate([crossings.ke for crossings in found])
    width = np.clip(np.concatenate([crossings.error_estimate for crossings in found]), 1e-12, 1e3) * at
    pairs = np.r_[0.0, np.cumsum(np.concatenate([crossings.direction for crossings in found]))]
    # Complex numbers sort by real part, then imaginary part: by case, then by K_e.
    point = case + 1j * ke
    after = np.searchsorted(owner + 1j * at, point, side="right")
    out = np.where(pairs[after] > pairs[(np.cumsum(number) - number)[case]], 0.0, 1.0)
    below = np.r_[-1.0, np.maximum.accumulate(owner + 1j * (at + width))]
    above = np.r_[np.minimum.accumulate((owner + 1j * (at - width))[::-1])[::-1], len(found)]
    on_crossing = (point <= below[after]) | (point >= above[after])
    proven = np.array([crossings.proven for crossings in found])
    return np.where(on_crossing | ~proven[case], np.nan, out)

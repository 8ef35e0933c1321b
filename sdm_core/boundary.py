"""Boundaries over rotor speed, and verdicts on many points: the front door of charts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sdm_core.arc_boundary import arc_crossings
from sdm_core.blade import Blade
from sdm_core.closed_form import Crossings, crossings
from sdm_core.contact import ContactConfiguration
from sdm_core.interruption import checkpoint
from sdm_core.receptance import ContactReceptance, Sweep, swept
from sdm_core.root_count import unstable_root_count
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.stability import proven_verdict
from sdm_core.validation import KE_LIMIT, number, speeds, stiffnesses

CLOSED_FORM = "closed-form boundary, argument principle"
CHARACTERISTIC = "exact characteristic equation, argument principle"
_CHECK = 1e-4  # distance from a crossing, relative in K_e, at which the root count proves it

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
        Intervals of instability up to `ke_max`, (low, high) in N/m, for each speed.
    method
        What was computed, in words.
    """

    speed_hz: np.ndarray
    ke_max: float
    critical_ke: np.ndarray
    chatter_hz: np.ndarray
    error_estimate: np.ndarray
    unstable_ke: tuple[tuple[tuple[float, float], ...], ...]
    method: str


def boundary(
    blade: Blade,
    contact: ContactConfiguration,
    speed_hz: np.ndarray,
    ke_max: float,
    *,
    extrapolate: bool = False,
    progress: Progress | None = None,
) -> BoundarySolution:
    """Exact stability boundary at each rotor speed.

    In permanent contact the closed form, each first crossing proven on both sides by the root
    count; with arcs a proven scan of K_e.

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
    speed = speeds("speed_hz", speed_hz)
    number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    problems = RubbingBlade.at_speeds(blade, contact, speed, extrapolate=extrapolate)
    sweeps = _SharedSweeps(blade)
    found: list[Crossings] = []
    for i, problem in enumerate(problems):
        checkpoint()
        found.append(_crossings(problem, ke_max, sweeps))
        if progress is not None:
            progress(i + 1, len(problems))
    return BoundarySolution(
        speed,
        float(ke_max),
        np.array([c.ke[0] if len(c.ke) else np.nan for c in found]),
        np.array([c.frequency_hz[0] if len(c.ke) else np.nan for c in found]),
        np.array([_first_error(c) for c in found]),
        tuple(c.unstable_intervals(ke_max) for c in found),
        CLOSED_FORM if contact.permanent else CHARACTERISTIC,
    )


def verdicts(
    blade: Blade,
    contact: ContactConfiguration,
    speed_hz: np.ndarray,
    ke: np.ndarray,
    *,
    extrapolate: bool = False,
    progress: Progress | None = None,
) -> np.ndarray:
    """Exact verdicts at points (speed, K_e): 1.0 stable, 0.0 unstable, NaN not decided; shape (m,).

    In permanent contact the crossings at a speed decide all points of that speed at once.
    """
    speed, stiffness = speeds("speed_hz", speed_hz), stiffnesses("ke", ke)
    unique, index = np.unique(speed, return_inverse=True)
    problems = RubbingBlade.at_speeds(blade, contact, unique, extrapolate=extrapolate)
    sweeps = _SharedSweeps(blade)
    out = np.full(len(speed), np.nan)
    order = np.argsort(index, kind="stable")
    groups = np.split(order, np.searchsorted(index[order], np.arange(1, len(unique))))
    done = 0
    for problem, members in zip(problems, groups, strict=True):
        checkpoint()
        if problem.permanent:
            out[members] = _from_crossings(problem, stiffness[members], sweeps)
        else:
            for i in members:
                verdict = proven_verdict(problem.with_ke(stiffness[i]))
                out[i] = np.nan if verdict is None else float(verdict)
        done += len(members)
        if progress is not None:
            progress(done, len(speed))
    return out


class _SharedSweeps:
    """One sweep serves all speeds of a blade whose modes do not depend on speed."""

    def __init__(self, blade: Blade) -> None:
        self._shared = len(blade.states) == 1
        self._sweep: Sweep | None = None
        self._ke_max = 0.0

    def of(self, receptance: ContactReceptance, ke_max: float) -> Sweep:
        if not self._shared:
            return swept(receptance, ke_max)
        if self._sweep is None or self._ke_max < ke_max:
            self._sweep, self._ke_max = swept(receptance, ke_max), ke_max
        return self._sweep


def _crossings(problem: RubbingBlade, ke_max: float, sweeps: _SharedSweeps) -> Crossings:
    if not problem.permanent:
        return arc_crossings(problem, ke_max)
    receptance = ContactReceptance(problem.omega, problem.damping_ratio, problem.contact_factor)
    if receptance.rank == 0:
        return crossings(receptance, problem.speed_hz, ke_max)
    found = crossings(receptance, problem.speed_hz, ke_max, sweep=sweeps.of(receptance, ke_max))
    if _proven(receptance, problem.speed_hz, found, ke_max):
        return found
    finer = swept(receptance, ke_max, tolerance=1e-4)
    found = crossings(receptance, problem.speed_hz, ke_max, sweep=finer)
    if _proven(receptance, problem.speed_hz, found, ke_max):
        return found
    return replace(found, error_estimate=np.full(len(found.ke), np.inf), proven=False)


def _first_error(found: Crossings) -> float:
    if not found.proven:
        return np.inf
    return float(found.error_estimate[0]) if len(found.ke) else 0.0


def _proven(receptance: ContactReceptance, speed_hz: float, found: Crossings, ke_max: float) -> bool:
    """The root count agrees below and above the first crossing, and at the largest K_e."""
    if not found.consistent:
        return False
    first = found.ke[0] if len(found.ke) else ke_max
    checks = np.array([first * (1 - _CHECK), first * (1 + _CHECK), ke_max])
    if not len(found.ke):
        checks = checks[2:]
    expected = np.array([2 * found.direction[found.ke <= k].sum() for k in checks])
    count = unstable_root_count(receptance, speed_hz, checks)
    close = np.array([(np.abs(found.ke / k - 1) < 1e-6).any() for k in checks])
    return bool(((count == expected) | close).all())


def _from_crossings(problem: RubbingBlade, ke: np.ndarray, sweeps: _SharedSweeps) -> np.ndarray:
    if not (ke > 0).any():
        return _unloaded(problem, ke)
    found = _crossings(problem, float(ke.max()) * (1 + 1e-6), sweeps)
    if not found.proven:
        return np.full(len(ke), np.nan)
    pairs = np.array([found.direction[found.ke <= k].sum() for k in ke])
    out = np.where(pairs > 0, 0.0, 1.0)
    for crossing, error in zip(found.ke, found.error_estimate, strict=True):
        out[np.abs(ke - crossing) <= max(error, 1e-12) * crossing] = np.nan
    return np.where(ke == 0, _unloaded(problem, ke), out)


def _unloaded(problem: RubbingBlade, ke: np.ndarray) -> np.ndarray:
    """Without contact a damped blade is stable, an undamped one on the limit."""
    damped = bool((problem.damping_ratio > 0).all())
    return np.full(len(ke), 1.0 if damped else np.nan)

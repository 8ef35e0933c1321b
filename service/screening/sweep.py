"""A boundary over many speeds, and the lobes' tips between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.lobe_tips import SEARCH_MARGIN, CriticalSpeed, deepest_lobe_tips
from sdm_core.validation import KE_LIMIT
from service.answerer import Answerer
from training.answers import EXACT, BoundaryAnswers

Progress = Callable[[int, int, str], None]

# With arcs the exact core takes up to half a second a speed, and a service answers within minutes.
SPEEDS_A_PART = 100
# With arcs fewer tips are looked for, for the same reason.
TIPS, TIPS_WITH_ARCS = 8, 4


def searched(
    answerer: Answerer,
    blade: Blade,
    contact: ContactConfiguration,
    grid: np.ndarray,
    ke_max: float,
    policy: str,
    progress: Progress | None = None,
    alpha: float | None = None,
) -> tuple[BoundaryAnswers, tuple[CriticalSpeed, ...]]:
    """The boundary on a grid of speeds, and the tips of its deepest lobes by the exact core.

    Where the surrogate sees no tip below `ke_max`, the exact core sweeps again: "none" is never the
    surrogate's word alone.

    Parameters
    ----------
    grid
        Rising speeds, Hz; `lobe_grid` misses no lobe.
    policy, alpha
        Of the sweep: who answers, and the false-stable rate that "auto" keeps (None: the model's default).

    Returns
    -------
    The boundary, looked for up to `SEARCH_MARGIN` times `ke_max`; tips below `ke_max`, smallest K_e first.
    """
    reach = min(SEARCH_MARGIN * ke_max, KE_LIMIT)

    def exact(speed_hz: np.ndarray) -> BoundaryAnswers:
        return answerer.boundary(blade, contact, speed_hz, reach, policy="exact")

    def tips(boundary: BoundaryAnswers) -> tuple[CriticalSpeed, ...]:
        count = TIPS if contact.permanent else TIPS_WITH_ARCS
        return deepest_lobe_tips(boundary, exact, blade.first_frequency_hz, ke_max=ke_max, count=count)

    boundary = swept(answerer, blade, contact, grid, reach, policy, progress, alpha)
    found = tips(boundary)
    if not found and not (boundary.source == EXACT).all():
        boundary = swept(answerer, blade, contact, grid, reach, "exact", progress)
        found = tips(boundary)
    return boundary, found


def swept(
    answerer: Answerer,
    blade: Blade,
    contact: ContactConfiguration,
    speed_hz: np.ndarray,
    ke_max: float,
    policy: str,
    progress: Progress | None = None,
    alpha: float | None = None,
) -> BoundaryAnswers:
    """First crossing at each speed; with arcs of contact asked for in parts.

    Parameters
    ----------
    progress
        Called with (done, total, what is next) after each part.
    """
    size = len(speed_hz) if contact.permanent else SPEEDS_A_PART
    parts = []
    for start in range(0, len(speed_hz), size):
        if progress is not None:
            progress(start, len(speed_hz), f"{speed_hz[start]:.4g} Hz")
        part = speed_hz[start : start + size]
        parts.append(answerer.boundary(blade, contact, part, ke_max, policy=policy, alpha=alpha))
    return parts[0] if len(parts) == 1 else _joined(parts)


def through_tips(
    answerer: Answerer,
    blade: Blade,
    contact: ContactConfiguration,
    boundary: BoundaryAnswers,
    tips: Sequence[CriticalSpeed],
) -> BoundaryAnswers:
    """The same boundary with the exact core's answers at the lobes' tips, which a line then reaches."""
    at = np.array([tip.speed_hz for tip in tips if not (boundary.speed_hz == tip.speed_hz).any()])
    if not len(at):
        return boundary
    joined = _joined([boundary, answerer.boundary(blade, contact, at, boundary.ke_max, policy="exact")])
    rising = np.argsort(joined.speed_hz)
    return replace(
        joined,
        unstable_ke=tuple(joined.unstable_ke[i] for i in rising),
        **{
            name: getattr(joined, name)[rising]
            for name in ("speed_hz", "critical_ke", "chatter_hz", "error_estimate", "source", "reason")
        },
    )


def cut_off(answers: BoundaryAnswers, ke_max: float) -> BoundaryAnswers:
    """The same boundary, looked for only up to `ke_max`."""
    beyond = ~(answers.critical_ke <= ke_max)
    intervals = (
        None if found is None else tuple((low, min(high, ke_max)) for low, high in found if low <= ke_max)
        for found in answers.unstable_ke
    )
    return replace(
        answers,
        ke_max=ke_max,
        critical_ke=np.where(beyond, np.nan, answers.critical_ke),
        chatter_hz=np.where(beyond, np.nan, answers.chatter_hz),
        unstable_ke=tuple(intervals),
    )


def _joined(parts: Sequence[BoundaryAnswers]) -> BoundaryAnswers:
    def column(name: str) -> np.ndarray:
        return np.concatenate([getattr(part, name) for part in parts])

    return BoundaryAnswers(
        speed_hz=column("speed_hz"),
        ke_max=parts[0].ke_max,
        critical_ke=column("critical_ke"),
        chatter_hz=column("chatter_hz"),
        error_estimate=column("error_estimate"),
        unstable_ke=tuple(interval for part in parts for interval in part.unstable_ke),
        source=column("source"),
        reason=column("reason"),
        model=parts[0].model,
        solver=parts[0].solver,
        certificate=next((part.certificate for part in parts if part.certificate is not None), None),
    )

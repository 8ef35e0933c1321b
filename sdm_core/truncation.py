"""Whether the blade has enough modes: the critical K_e with and without the one of highest frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sdm_core.crossings import Crossings
from sdm_core.floquet.arc_boundary import boundaries_with_arcs
from sdm_core.floquet.propagation import propagation_of
from sdm_core.permanent_contact.permanent_boundary import permanent_crossings
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.validation import KE_LIMIT

TOLERATED_CHANGE = 0.02
"""Relative change of the critical K_e above which a blade has too few modes."""
_STRONGEST = 8.0  # ln of the growth that contact gives a revolution


def crossings_of(problems: Sequence[RubbingBlade], ke_max: float) -> list[Crossings]:
    """Crossings of each up to `ke_max`, all in permanent contact or none."""
    if problems[0].permanent:
        return permanent_crossings(problems, ke_max)
    return boundaries_with_arcs(problems, ke_max)


def without_highest_mode(problem: RubbingBlade) -> RubbingBlade:
    """The same blade with one mode less."""
    kept = np.delete(np.arange(len(problem.omega)), np.argmax(problem.omega))
    return replace(
        problem,
        omega=problem.omega[kept],
        damping_ratio=problem.damping_ratio[kept],
        contact_shape=problem.contact_shape[:, kept],
    )


def change_of_critical_ke(
    problems: Sequence[RubbingBlade], ke_max: float, crossings: Sequence[Crossings]
) -> np.ndarray:
    """(K_e without the highest mode − K_e)/K_e at each speed, shape (m,).

    Infinite where the crossing below `ke_max` comes with that mode alone, −1 where it comes without it
    alone, 0 where there is none either way, NaN for a blade of one mode.
    """
    if len(problems) == 0 or len(problems[0].omega) == 1:
        return np.full(len(problems), np.nan)
    fewer = crossings_of([without_highest_mode(p) for p in problems], ke_max)
    first = np.array([c.ke[0] if len(c.ke) else np.inf for c in crossings])
    without = np.array([c.ke[0] if len(c.ke) else np.inf for c in fewer])
    both = np.isinf(first) & np.isinf(without)
    with np.errstate(invalid="ignore"):
        change = np.where(np.isinf(first), -1.0, without / first - 1)
    return np.where(both, 0.0, change)


def truncation_warnings(change: np.ndarray) -> tuple[str, ...]:
    """What the user should know of such changes, in words."""
    known = np.abs(change[~np.isnan(change)])
    if len(known) == 0 or known.max() <= TOLERATED_CHANGE:
        return ()
    share = "" if len(known) == 1 else f" at {(known > TOLERATED_CHANGE).sum()} of {len(known)} speeds"
    worst = f"by up to {100 * known.max():.2g} %" if np.isfinite(known.max()) else "from none to one"
    return (
        f"too few modes{share}: dropping the highest changes the critical K_e {worst}; "
        f"give the blade modes of higher frequency",
    )


def modes_enough(problem: RubbingBlade, ke_max: float) -> tuple[float, tuple[str, ...]]:
    """Change of the critical K_e at one speed, and warnings; NaN where there is none up to `ke_max`."""
    if len(problem.omega) == 1:
        return np.nan, ()
    ke_max = min(ke_max, KE_LIMIT)
    if not problem.permanent:  # seldom is anything stable beyond, and it takes long to follow
        growth = float(propagation_of([problem]).phase_shift[0])
        ke_max = min(ke_max, _STRONGEST / max(growth, 1e-300))
    crossings = crossings_of([problem], ke_max)
    change = change_of_critical_ke([problem], ke_max, crossings)
    if len(crossings[0].ke) == 0 and change[0] == 0.0:
        return np.nan, ()
    return float(change[0]), truncation_warnings(change)

"""How much work of the exact core one call may ask for."""

from __future__ import annotations

import numpy as np

from sdm_core.blade import Blade
from sdm_core.errors import TooMuchWork

# Seconds of exact work for up to five modes, from measured costs on one core of a small machine.
POINT_S, ARC_VERDICT_S, ARC_BOUNDARY_S, PERMANENT_S = 0.02, 0.004, 0.5, 0.02
GRADIENT_S = 0.02  # beside the boundary
# Measured from 5 to 40 modes: 0.025 s, 0.7 s, 5.9 s a point.
_GROWTH_WITH_MODES = 2.6
# Natural frequency over rotor speed up to which those costs hold; beyond it they grow in proportion.
_VIBRATIONS = 200.0


def check_budget(budget_s: float, count: int, unit_s: float, blade: Blade, speed_hz: np.ndarray) -> None:
    """Refuse more work than fits into `budget_s`, as estimated before it starts.

    Parameters
    ----------
    count, unit_s
        Answers asked for, and what one costs of a blade of few modes.

    Raises
    ------
    TooMuchWork
        Saying how many would do.
    """
    if not count:
        return
    fastest = max(float(state.frequency_hz.max()) for state in blade.states)
    unit_s *= (max(blade.mode_count, 5) / 5) ** _GROWTH_WITH_MODES
    unit_s *= max(1.0, fastest / float(speed_hz.min()) / _VIBRATIONS)
    most = int(budget_s / unit_s)
    if count > most:
        many = f"ask for at most {most} of them in one call" if most else "leave out the highest modes"
        raise TooMuchWork("speed_hz", f"{count} answers by the exact core", many)

"""Further entries of a blade's modal states at any rotor speed."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from sdm_core.blade.modal import Blade


def over_speed(blade: Blade, key: str, speed_hz: np.ndarray) -> np.ndarray | None:
    """One optional entry of the blade's states at rotor speeds; None where a state lacks it.

    Not-a-knot in Ω², as `Blade.at_speeds` interpolates. Shape (m, ...) of the entry's own.
    """
    values = [getattr(state, key) for state in blade.states]
    if any(value is None for value in values):
        return None
    at = np.atleast_1d(np.asarray(speed_hz, dtype=float))
    table = np.array(values, dtype=float)
    if len(values) == 1:
        return np.broadcast_to(table[0], (len(at), *table.shape[1:])).copy()
    return CubicSpline([state.speed_hz**2 for state in blade.states], table)(at**2)

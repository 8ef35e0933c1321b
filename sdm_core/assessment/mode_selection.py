"""A blade with some of its modes only: what each mode does by itself, and what the others add."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sdm_core.blade import Blade, ModalState
from sdm_core.blade.tracking import FURTHER_SHAPES
from sdm_core.errors import InvalidInput


def with_modes(blade: Blade, modes: Sequence[int]) -> Blade:
    """The blade with the given modes kept and the others dropped.

    Parameters
    ----------
    modes
        Numbers of the modes to keep, counted from 1 in the blade's order.

    Raises
    ------
    InvalidInput
        For a mode the blade has not got, one named twice, or none.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> with_modes(example_blade("nasa_rotor_37"), [2]).states[0].frequency_hz.round(0)
    array([2563.])
    """
    if len(modes) == 0:
        raise InvalidInput("modes", "[]", "name at least one mode")
    for i, mode in enumerate(modes):
        if isinstance(mode, bool) or not isinstance(mode, int | np.integer):
            raise InvalidInput(f"modes[{i}]", mode, "give a whole number")
        if not 1 <= mode <= blade.mode_count:
            raise InvalidInput(f"modes[{i}]", mode, f"give a mode from 1 to {blade.mode_count}")
        if mode in modes[:i]:
            raise InvalidInput(f"modes[{i}]", mode, "name every mode once")
    kept = np.asarray(modes, dtype=int) - 1
    states = tuple(_kept(state, kept) for state in blade.states)
    return replace(blade, states=states, damping_ratio=blade.damping_ratio[kept])


def mode_alone(blade: Blade, mode: int) -> Blade:
    """The blade with one mode only, counted from 1."""
    return with_modes(blade, [mode])


def _kept(state: ModalState, kept: np.ndarray) -> ModalState:
    shapes = {
        key: getattr(state, key)[kept]
        for key in ("mode_shape", *FURTHER_SHAPES)
        if getattr(state, key) is not None
    }
    return replace(state, frequency_hz=state.frequency_hz[kept], **shapes)

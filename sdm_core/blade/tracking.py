"""Which mode of one modal state is which mode of the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linear_sum_assignment

from sdm_core.errors import ModesNotTracked

if TYPE_CHECKING:
    from sdm_core.blade.modal import ModalState

# Amplitudes of a modal state in further directions than that of contact, each (n, r).
FURTHER_SHAPES = ("mode_shape_radial", "mode_shape_tangential", "mode_shape_axial")
# A followed mode keeps its shape to within this distance (0 the same, 1 nothing in common) ...
LARGEST_SHAPE_CHANGE = 0.35
# ... and no other pairing may be as good to within this much.
LEAST_MARGIN = 0.02


def rising_modes(state: ModalState) -> np.ndarray:
    """Indices of the modes by rising frequency: the order of a blade's modes, shape (n,)."""
    return np.argsort(state.frequency_hz, kind="stable")


def tracked(states: Sequence[ModalState]) -> tuple[ModalState, ...]:
    """States (sorted by speed), modes by rising frequency in the first one and signs aligned.

    Modes are paired by the shape of their amplitudes at the tip, in every direction given, and by
    frequency: two modes whose tip shapes look alike (a first and a second flap seen by one row of
    nodes) are told apart by frequency, two that cross in frequency by shape.

    Raises
    ------
    ModesNotTracked
        Naming the modes and the two speeds, when shapes change too much or two pairings are
        equally good.
    """
    rising = rising_modes(states[0])
    done = [states[0].reordered(rising, np.ones(len(rising)))]
    for state in states[1:]:
        order, sign = _pairing(done[-1], state)
        done.append(state.reordered(order, sign))
    return tuple(done)


def _pairing(before: ModalState, after: ModalState) -> tuple[np.ndarray, np.ndarray]:
    a, b = _all_directions(before, after)
    inner = a @ b.T
    size = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1)[None, :]
    # min over sign of |a - s b|² / (|a|² + |b|²): unlike the MAC it also sees amplitude.
    shape_change = np.where(size > 0, 1 - 2 * np.abs(inner) / np.where(size > 0, size, 1), 0.0)
    frequency_change = np.abs(np.log(after.frequency_hz[None, :] / before.frequency_hz[:, None]))
    cost = shape_change + frequency_change
    rows, order = linear_sum_assignment(cost)
    best = cost[rows, order].sum()

    lost = shape_change[rows, order] > LARGEST_SHAPE_CHANGE
    if lost.any():
        j = int(np.argmax(lost))
        raise _refusal([j], before, after, f"its tip shape changes by {shape_change[j, order[j]]:.2f}")
    for j in range(len(order)):
        for k in range(j):
            swapped = best - cost[j, order[j]] - cost[k, order[k]] + cost[j, order[k]] + cost[k, order[j]]
            if swapped - best < LEAST_MARGIN:
                raise _refusal([k, j], before, after, "they can be paired either way")
    sign = np.where(inner[rows, order] < 0, -1.0, 1.0)
    return order, sign


def _all_directions(before: ModalState, after: ModalState) -> tuple[np.ndarray, np.ndarray]:
    a, b = [before.mode_shape], [after.mode_shape]
    for name in FURTHER_SHAPES:
        if getattr(before, name) is not None and getattr(after, name) is not None:
            a.append(getattr(before, name))
            b.append(getattr(after, name))
    return np.hstack(a), np.hstack(b)


def _refusal(modes: list[int], before: ModalState, after: ModalState, why: str) -> ModesNotTracked:
    names = " and ".join(f"mode {j + 1} ({before.frequency_hz[j]:.6g} Hz)" for j in modes)
    return ModesNotTracked(
        "states",
        f"{names} from {before.speed_hz:g} to {after.speed_hz:g} Hz",
        f"cannot be followed: {why}. Add a state between these speeds",
    )

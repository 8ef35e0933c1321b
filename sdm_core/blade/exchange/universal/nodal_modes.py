"""Mode shapes at nodes in space (x, y, z), as test and finite element programs give them, to a blade."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sdm_core.blade.exchange.content import Positions
from sdm_core.blade.modal import Blade, ModalState
from sdm_core.blade.tip_line import TipLine, cylindrical_frames
from sdm_core.errors import InvalidInput


@dataclass(frozen=True)
class NodalModes:
    """Mass-normalised modes at one rotor speed, in SI.

    Parameters
    ----------
    speed_hz
        Rotor speed.
    frequency_hz
        Shape (n,).
    damping_ratio
        Shape (n,).
    displacement
        x, y, z by node, kg^-1/2, each of shape (n, 3).
    """

    speed_hz: float
    frequency_hz: np.ndarray
    damping_ratio: np.ndarray
    displacement: Mapping[int, np.ndarray]


def blade_at_tip(
    name: str,
    modes: Sequence[NodalModes],
    tip: TipLine,
    places: Positions | None,
    rotation_axis: tuple[float, float, float],
    damping_ratio: float | Sequence[float],
) -> Blade:
    """The blade its tip nodes make; radial, tangential and axial shapes where their places are known.

    Raises
    ------
    InvalidInput
        For tip nodes without mode shape.
    """
    frames = position = None
    if places is not None and all(node in places for node in tip.nodes):
        position = np.array([places[node] for node in tip.nodes])
        frames = cylindrical_frames(position, np.array(rotation_axis))
    states = []
    for state in modes:
        missing = [node for node in tip.nodes if node not in state.displacement]
        if missing:
            raise InvalidInput(
                "tip.nodes",
                missing[0],
                f"the modes at {state.speed_hz:g} Hz do not hold this node: name others",
            )
        at_tip = np.stack([state.displacement[node] for node in tip.nodes], axis=1)  # (n, r, 3)
        main = np.einsum("nrx,rx->nr", at_tip, tip.contact_directions)
        further = [None] * 3 if frames is None else list(np.einsum("nrx,rax->anr", at_tip, frames))
        states.append(ModalState(state.speed_hz, state.frequency_hz, main, *further))
    axis = np.array(rotation_axis)
    radius = z = theta = None
    if frames is not None and position is not None:
        radius = np.einsum("rx,rx->r", position, frames[:, 0]).tolist()
        z = (position @ axis).tolist()
        theta = np.arctan2(frames[:, 0] @ frames[0, 1], frames[:, 0] @ frames[0, 0]).tolist()
    return Blade(
        name,
        tip.names,
        damping_ratio,
        states,
        tip.direction,
        tip_radius_m=radius,
        tip_z_m=z,
        tip_theta_rad=theta,
    )

"""The row of tip nodes that meets the casing, and the direction in which it does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sdm_core.blade.modal import DIRECTIONS
from sdm_core.errors import InvalidInput
from sdm_core.validation import vector

# Contact direction: by name, or as parts (radial, tangential, axial).
Direction = str | tuple[float, float, float]
_Z = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class TipLine:
    """Contact nodes of a model in space, leading to trailing edge.

    Parameters
    ----------
    names
        Names of the r tip nodes, as the blade file will call them.
    nodes
        Their numbers in the model, shape (r,).
    contact_directions
        Direction in which each node meets the casing, in the model's x, y, z, pointing out of the
        blade, shape (r, 3); scaled to unit length.
    direction
        What they are: ``casing_normal``, ``radial`` or ``given``.

    Raises
    ------
    InvalidInput
        For directions of no length, or a count that does not fit.
    """

    names: tuple[str, ...]
    nodes: tuple[int, ...]
    contact_directions: np.ndarray
    direction: str = "casing_normal"

    def __init__(
        self,
        names: Sequence[str],
        nodes: Sequence[int],
        contact_directions: np.ndarray,
        direction: str = "casing_normal",
    ) -> None:
        put = object.__setattr__
        put(self, "names", tuple(names))
        put(self, "nodes", tuple(int(node) for node in nodes))
        if len(self.names) != len(self.nodes) or not self.nodes:
            raise InvalidInput("tip.nodes", f"{len(self.nodes)} nodes", f"give one a name: {len(self.names)}")
        if len(set(self.nodes)) != len(self.nodes):
            raise InvalidInput("tip.nodes", list(self.nodes), "name every node once")
        towards = np.array(contact_directions, dtype=float)
        if towards.shape != (len(self.nodes), 3) or not np.isfinite(towards).all():
            raise InvalidInput(
                "tip.contact_directions",
                f"shape {towards.shape}",
                f"give x, y, z for each of the {len(self.nodes)} tip nodes",
            )
        length = np.linalg.norm(towards, axis=1)
        if (length == 0).any():
            i = int(np.argmin(length))
            raise InvalidInput(f"tip.contact_directions[{i}]", [0, 0, 0], "give a direction that points out")
        towards = towards / length[:, None]
        towards.setflags(write=False)
        put(self, "contact_directions", towards)
        if direction not in DIRECTIONS:
            raise InvalidInput("tip.direction", direction, f"give one of {', '.join(DIRECTIONS)}")
        put(self, "direction", direction)

    @classmethod
    def along(
        cls,
        names: Sequence[str],
        nodes: Sequence[int],
        position_m: np.ndarray,
        direction: Direction = "casing_normal",
        *,
        casing_slope: float | None = None,
        rotation_axis: Sequence[float] = _Z,
    ) -> TipLine:
        """Nodes at places, their directions from the shape of the tip.

        Parameters
        ----------
        position_m
            Places of the nodes, leading to trailing edge, m, shape (r, 3).
        direction
            ``casing_normal``, ``radial``, or (radial, tangential, axial).
        casing_slope
            dr/dz of the casing; None: that of the tip itself at each node.
        rotation_axis
            Through the origin, pointing downstream.
        """
        axis = np.array(rotation_axis, dtype=float)
        frames = cylindrical_frames(position_m, axis)
        towards = checked_direction(direction)
        if isinstance(towards, tuple):
            return cls(names, nodes, np.einsum("k,rkx->rx", np.array(towards), frames), "given")
        if towards == "radial":
            return cls(names, nodes, frames[:, 0], "radial")
        slopes = np.full(len(frames), 0.0 if casing_slope is None else casing_slope)
        if casing_slope is None:
            slopes = _tip_slope(
                position_m @ axis, np.einsum("rx,rx->r", position_m, frames[:, 0]), position_m
            )
        return cls(names, nodes, frames[:, 0] - slopes[:, None] * frames[:, 2], "casing_normal")


def checked_direction(direction: Direction) -> Direction:
    """A contact direction that can be used.

    Raises
    ------
    InvalidInput
        For another name, or three numbers that are all zero.
    """
    if isinstance(direction, str):
        if direction not in ("casing_normal", "radial"):
            raise InvalidInput(
                "tip.direction",
                direction,
                "give casing_normal, radial, or three numbers (radial, tangential, axial)",
            )
        return direction
    given = vector("tip.direction", direction, -1e6, 1e6, "")
    if len(given) != 3 or not given.any():
        raise InvalidInput("tip.direction", given.tolist(), "give (radial, tangential, axial), not zero")
    return float(given[0]), float(given[1]), float(given[2])


def _tip_slope(z: np.ndarray, radius: np.ndarray, place: np.ndarray) -> np.ndarray:
    """dr/dz of the tip at its nodes, by a cubic through its meridional line, shape (r,)."""
    chord = np.linalg.norm(place[-1] - place[0])
    # One node, or a chord along the circumference, says nothing of dr/dz.
    if len(z) < 2 or np.ptp(z) < 1e-2 * chord:
        return np.zeros(len(z))
    fit = np.polynomial.Polynomial.fit(z, radius, min(3, len(z) - 1))
    return fit.deriv()(z)


def cylindrical_frames(position_m: np.ndarray, rotation_axis: np.ndarray) -> np.ndarray:
    """Radial, tangential, axial unit vectors at points, the rotor turning about an axis through the origin.

    Parameters
    ----------
    position_m
        Points in m, shape (r, 3).
    rotation_axis
        Unit vector, shape (3,).

    Returns
    -------
    Shape (r, 3, 3): [point, (radial, tangential, axial), xyz]; tangential = axial × radial, which is the
    direction of rotation for one half of all rotors and against it for the other.

    Raises
    ------
    InvalidInput
        For a point on the axis.

    Examples
    --------
    >>> cylindrical_frames(np.array([[2.0, 0.0, 5.0]]), np.array([0.0, 0.0, 1.0]))[0]
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    across = position_m - np.outer(position_m @ rotation_axis, rotation_axis)
    radius = np.linalg.norm(across, axis=1)
    if (radius <= 1e-12 * (1 + np.abs(position_m).max())).any():
        i = int(np.argmin(radius))
        raise InvalidInput(
            f"node_position_m[{i}]", position_m[i].tolist(), "it lies on the rotation axis: check the axis"
        )
    radial = across / radius[:, None]
    axial = np.broadcast_to(rotation_axis, radial.shape)
    return np.stack((radial, np.cross(axial, radial), axial), axis=1)

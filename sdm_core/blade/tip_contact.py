"""Which nodes of a solid blade's tip meet the casing, and in which direction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from sdm_core.blade.solid_mesh import SolidMesh
from sdm_core.blade.tip_line import TipLine, cylindrical_frames
from sdm_core.errors import InvalidInput
from sdm_core.validation import number, vector

_AXIS = np.array([0.0, 0.0, 1.0])
LINES = ("middle", "pressure", "suction")


@dataclass(frozen=True)
class TipContact:
    """Choice of contact nodes and contact direction.

    Parameters
    ----------
    nodes
        Tip nodes from leading to trailing edge, evenly spaced in the mesh.
    line
        ``middle`` of the thickness, ``pressure`` or ``suction`` side.
    direction
        ``casing_normal`` (default: what the liner pushes back along, DESIGN fact 8), ``radial``, which
        reproduces [SBL], or a vector (radial, tangential, axial) of one's own.
    casing_slope
        dr/dz of the casing; None: the profile's, or that of the tip itself at each node.
    """

    nodes: int = 9
    line: Literal["middle", "pressure", "suction"] = "middle"
    direction: str | tuple[float, float, float] = "casing_normal"
    casing_slope: float | None = None

    def __post_init__(self) -> None:
        if isinstance(self.nodes, bool) or not isinstance(self.nodes, int) or not 2 <= self.nodes <= 201:
            raise InvalidInput("tip.nodes", self.nodes, "give a whole number of nodes from 2 to 201")
        if self.line not in LINES:
            raise InvalidInput("tip.line", self.line, f"give one of {', '.join(LINES)}")
        if isinstance(self.direction, str):
            if self.direction not in ("casing_normal", "radial"):
                raise InvalidInput(
                    "tip.direction",
                    self.direction,
                    "give casing_normal, radial, or three numbers (radial, tangential, axial)",
                )
        else:
            given = vector("tip.direction", self.direction, -1e6, 1e6, "")
            if len(given) != 3 or not given.any():
                raise InvalidInput(
                    "tip.direction", self.direction, "give (radial, tangential, axial), not zero"
                )
            object.__setattr__(self, "direction", tuple(float(x) for x in given))
        if self.casing_slope is not None:
            number("tip.casing_slope", self.casing_slope, -10.0, 10.0, "")

    def on(self, mesh: SolidMesh, suction_side: int = 1, casing_slope: float | None = None) -> TipLine:
        """The tip line on a mesh, its node numbers those of the mesh.

        Parameters
        ----------
        suction_side
            +1 where the suction side lies at t = +1, −1 where it lies at t = −1.
        casing_slope
            dr/dz of the casing where the profile knows it; this choice's own comes first.

        Raises
        ------
        InvalidInput
            When the mesh has too few nodes along the chord.
        """
        nodes = self._nodes(mesh, suction_side)
        place = mesh.position_m[nodes]
        frames = cylindrical_frames(place, _AXIS)
        if self.direction == "radial":
            towards, name = frames[:, 0], "radial"
        elif self.direction == "casing_normal":
            slope = casing_slope if self.casing_slope is None else self.casing_slope
            slopes = _tip_slope(place) if slope is None else np.full(len(place), slope)
            towards, name = frames[:, 0] - slopes[:, None] * frames[:, 2], "casing_normal"
        else:
            towards, name = np.einsum("k,rkx->rx", np.array(self.direction), frames), "given"
        names = ["LE", *(f"N{i}" for i in range(2, self.nodes)), "TE"]
        return TipLine(names, nodes, towards, name)

    def _nodes(self, mesh: SolidMesh, suction_side: int) -> list[int]:
        chord, span, thickness = 2 * np.array(
            [mesh.subdivision.chord, mesh.subdivision.span, mesh.subdivision.thickness]
        )
        layer = thickness // 2
        if self.line != "middle":
            at_suction = thickness if suction_side > 0 else 0
            layer = at_suction if self.line == "suction" else thickness - at_suction
        # In the middle of an odd number of layers 20-node elements have nodes at corners only.
        step = 2 if layer % 2 else 1
        there = chord // step
        if there < self.nodes - 1:
            raise InvalidInput(
                "tip.nodes",
                self.nodes,
                f"the mesh has {there + 1} nodes on this line: ask for fewer, or mesh.chord for more",
            )
        at = step * np.rint(np.linspace(0, there, self.nodes)).astype(int)
        found = [mesh.node_at(int(i), int(span), int(layer)) for i in at]
        return [node for node in found if node is not None]


def _tip_slope(place: np.ndarray) -> np.ndarray:
    """dr/dz of the tip at its nodes, by a cubic through its meridional line, shape (r,)."""
    z, radius = place[:, 2], np.hypot(place[:, 0], place[:, 1])
    chord = np.linalg.norm(place[-1] - place[0])
    if np.ptp(z) < 1e-2 * chord:  # the chord runs along the circumference: it says nothing of dr/dz
        return np.zeros(len(place))
    fit = np.polynomial.Polynomial.fit(z, radius, min(3, len(place) - 1))
    return fit.deriv()(z)

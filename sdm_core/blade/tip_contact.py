"""Which nodes of a solid blade's tip meet the casing, and in which direction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from sdm_core.blade.solid_mesh import SolidMesh
from sdm_core.blade.tip_line import Direction, TipLine, checked_direction
from sdm_core.errors import InvalidInput
from sdm_core.validation import number

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
    direction: Direction = "casing_normal"
    casing_slope: float | None = None

    def __post_init__(self) -> None:
        if isinstance(self.nodes, bool) or not isinstance(self.nodes, int) or not 2 <= self.nodes <= 201:
            raise InvalidInput("tip.nodes", self.nodes, "give a whole number of nodes from 2 to 201")
        if self.line not in LINES:
            raise InvalidInput("tip.line", self.line, f"give one of {', '.join(LINES)}")
        object.__setattr__(self, "direction", checked_direction(self.direction))
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
        names = ["LE", *(f"N{i}" for i in range(2, self.nodes)), "TE"]
        slope = casing_slope if self.casing_slope is None else self.casing_slope
        return TipLine.along(names, nodes, mesh.position_m[nodes], self.direction, casing_slope=slope)

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

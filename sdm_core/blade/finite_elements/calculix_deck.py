"""The same mesh, material and load as an input deck for CalculiX or Abaqus, for a second opinion."""

from __future__ import annotations

import numpy as np

from sdm_core.blade.finite_elements.solid_model import SolidModel

# Nodes of a C3D20 in half-element steps along chord, span and thickness from its lowest corner:
# four corners below, four above, then middles of edges below, above and between.
_CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
_MIDDLES = [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0)]
_C3D20 = np.array(
    [
        *_CORNERS,
        *((i, j, 2) for i, j, _ in _CORNERS),
        *_MIDDLES,
        *((i, j, 2) for i, j, _ in _MIDDLES),
        *((i, j, 1) for i, j, _ in _CORNERS),
    ]
)


def calculix_deck(model: SolidModel, speed_hz: float = 0.0, modes: int = 5) -> str:
    """Input deck: frequencies about the equilibrium at a rotor speed, SI units.

    Nodes are numbered from 1 in the order of the mesh, root clamped, turning about the z axis. Numbers
    take 20 characters, CalculiX reads no more.

    Parameters
    ----------
    speed_hz
        0: no static step.
    """
    material = model.material
    lines = ["*NODE, NSET=NALL"]
    lines += [f"{i}, {x:.13e}, {y:.13e}, {z:.13e}" for i, (x, y, z) in enumerate(model.mesh.position_m, 1)]
    lines += ["*ELEMENT, TYPE=C3D20, ELSET=EALL"]
    for i, nodes in enumerate(_elements(model) + 1, 1):
        row = [i, *nodes.tolist()]
        lines += [", ".join(map(str, row[:11])) + ",", ", ".join(map(str, row[11:]))]
    lines += ["*NSET, NSET=ROOT"]
    root = (model.mesh.root + 1).tolist()
    lines += [", ".join(map(str, root[i : i + 10])) + "," for i in range(0, len(root), 10)]
    lines += [
        "*MATERIAL, NAME=BLADE",
        "*ELASTIC",
        f"{material.youngs_modulus:.13e}, {material.poisson_ratio:.13e}",
        "*DENSITY",
        f"{material.density:.13e}",
        "*SOLID SECTION, ELSET=EALL, MATERIAL=BLADE",
        "*BOUNDARY",
        "ROOT, 1, 3",
    ]
    if speed_hz:
        square = (2 * np.pi * speed_hz) ** 2
        lines += [
            "*STEP, NLGEOM",
            "*STATIC",
            "1., 1.",
            "*DLOAD",
            f"EALL, CENTRIF, {square:.13e}, 0., 0., 0., 0., 0., 1.",
            "*END STEP",
        ]
    lines += ["*STEP, PERTURBATION" if speed_hz else "*STEP", "*FREQUENCY", f"{modes}", "*END STEP", ""]
    return "\n".join(lines)


def _elements(model: SolidModel) -> np.ndarray:
    """Nodes of each element in C3D20's order, shape (elements, 20)."""
    place, n = model.mesh.place, 2 * np.array(model.mesh.sizes) + 1
    number = np.full(tuple(n), -1)
    number[tuple(place.T)] = np.arange(len(place))
    lowest = place[model.mesh.basis.element_dofs].min(axis=0)  # (elements, 3)
    nodes = number[tuple((lowest[:, None, :] + _C3D20).transpose(2, 0, 1))]
    a, b, c, d = (model.mesh.position_m[nodes[0, i]] for i in (0, 1, 3, 4))
    if np.cross(b - a, c - a) @ (d - a) < 0:  # left-handed: bottom and top change places
        swap = [4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19]
        nodes = nodes[:, swap]
    return nodes

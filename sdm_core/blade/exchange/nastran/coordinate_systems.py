"""Coordinate systems of Nastran bulk data: rectangular, cylindrical and spherical (CORD2R, CORD2C, CORD2S).

A system is given by three points in the basic one: its origin A, B on its z axis, C in its xz plane. Layout:
Nastran Quick Reference Guide, CORD2R, CORD2C, CORD2S.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.sparse import csc_array, issparse, lil_array

from sdm_core.blade.exchange.nastran.bulk_data import Entry
from sdm_core.blade.exchange.parsing.fortran_fields import integer, real
from sdm_core.blade.matrix_model import DofMap, Matrix
from sdm_core.errors import DamagedFile, InvalidInput

KINDS = ("CORD2R", "CORD2C", "CORD2S")


@dataclass(frozen=True)
class CoordinateSystem:
    """One system.

    Parameters
    ----------
    kind
        ``CORD2R``, ``CORD2C`` or ``CORD2S``.
    origin
        Shape (3,).
    axes
        Its x, y, z unit vectors as columns, shape (3, 3).
    """

    kind: str
    origin: np.ndarray
    axes: np.ndarray

    def place(self, coordinates: np.ndarray) -> np.ndarray:
        """Basic x, y, z of a point given by r, θ, z or r, θ, φ (degrees) or x, y, z."""
        a, b, c = coordinates
        if self.kind == "CORD2C":
            theta = np.radians(b)
            local = np.array([a * np.cos(theta), a * np.sin(theta), c])
        elif self.kind == "CORD2S":
            theta, phi = np.radians((b, c))
            local = a * np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
        else:
            local = np.array([a, b, c])
        return self.origin + self.axes @ local

    def directions(self, where: str, place: np.ndarray) -> np.ndarray:
        """Its unit vectors at a point, as columns in basic x, y, z, shape (3, 3).

        Raises
        ------
        InvalidInput
            For a point on the z axis of a curved system.
        """
        if self.kind == "CORD2R":
            return self.axes
        x, y, z = self.axes.T @ (place - self.origin)
        rho = float(np.hypot(x, y))
        if rho <= 1e-9 * (1 + abs(z)):
            raise InvalidInput(where, "on the z axis of its system", "its directions are not defined there")
        cos, sin = x / rho, y / rho
        if self.kind == "CORD2C":
            local = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
        else:
            r = float(np.hypot(rho, z))
            s, c = rho / r, z / r
            local = np.array([[s * cos, c * cos, -sin], [s * sin, c * sin, cos], [c, -s, 0]])
        return self.axes @ local


def coordinate_systems(path: Path, systems: Sequence[Entry]) -> dict[int, CoordinateSystem]:
    """Systems by number.

    Raises
    ------
    DamagedFile
        For points that span no system, or numbers that are none.
    InvalidInput
        For a system given in another one.
    """
    out: dict[int, CoordinateSystem] = {}
    for entry in systems:
        where = f"{path.name}: line {entry.line}: {entry.kind}"
        number, reference = integer(where, entry.field(0)), integer(where, entry.field(1) or "0")
        if reference != 0:
            raise InvalidInput(where, f"given in system {reference}", "give systems in the basic one (0)")
        a, b, c = (
            np.array([real(where, entry.field(2 + 3 * p + k) or "0.0") for k in range(3)]) for p in range(3)
        )
        z, in_plane = b - a, c - a
        y = np.cross(z, in_plane)
        if number in out or not np.linalg.norm(y) > 1e-9 * np.linalg.norm(z) * np.linalg.norm(in_plane):
            raise DamagedFile(where, number, "give each system once, by three points that are not on a line")
        e3, e2 = z / np.linalg.norm(z), y / np.linalg.norm(y)
        out[number] = CoordinateSystem(entry.kind, a, np.column_stack((np.cross(e2, e3), e2, e3)))
    return out


def to_basic(
    where: str, matrices: Mapping[str, Matrix], dofs: DofMap, directions: Mapping[int, np.ndarray]
) -> dict[str, Matrix]:
    """Matrices whose rows at some nodes are along other directions, turned to the basic ones: T A Tᵀ.

    Raises
    ------
    InvalidInput
        For a node of which not all three translations (or rotations) are in the matrices.
    """
    turn = lil_array((len(dofs), len(dofs)))
    turn.setdiag(1.0)
    rows: dict[tuple[int, bool], dict[int, int]] = {}
    for i, (node, component) in enumerate(zip(dofs.node.tolist(), dofs.component.tolist(), strict=True)):
        if component and node in directions:
            rows.setdefault((node, component > 3), {})[(component - 1) % 3] = i
    for (node, _), triple in rows.items():
        if len(triple) != 3:
            raise InvalidInput(
                f"{where}: GRID {node}",
                f"{len(triple)} of 3 rows in a system of its own",
                "keep all three of the node, or give it in the basic system",
            )
        at = [triple[k] for k in range(3)]
        turn[np.ix_(at, at)] = directions[node]
    whole = csc_array(turn)
    out = {}
    for name, matrix in matrices.items():
        turned = whole @ csc_array(matrix) @ whole.T
        turned = (turned + turned.T) / 2 if abs(matrix - matrix.T).max() == 0 else turned
        out[name] = csc_array(turned) if issparse(matrix) else turned.toarray()
    return out

"""Structured meshes of 20-node quadratic hexahedra between hub and tip."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from skfem import Basis, MeshHex1
from skfem.element import Element, ElementHexS2

from sdm_core.errors import InvalidInput

# Quadrature exact to this order is 3 × 3 × 3 points: full integration of these elements.
QUADRATURE_ORDER = 5
MOST_NODES = 200_000

# x, y, z at every combination of chord, span and thickness coordinates: (s, h, t) -> (..., 3).
Shape = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


@dataclass(repr=False)
class MeshHexS2(MeshHex1):
    """Hexahedra with a node at every corner and in the middle of every edge."""

    elem: type[Element] = ElementHexS2


@dataclass(frozen=True)
class Subdivision:
    """Elements along the chord, the span and through the thickness."""

    chord: int = 24
    span: int = 32
    thickness: int = 2

    def __post_init__(self) -> None:
        for name in ("chord", "span", "thickness"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= 1000:
                raise InvalidInput(f"mesh.{name}", value, "give a whole number of elements from 1 to 1000")
        if self.node_count > MOST_NODES:
            raise InvalidInput(
                "mesh", f"{self.node_count:,} nodes", f"at most {MOST_NODES:,}: give fewer elements"
            )

    @property
    def node_count(self) -> int:
        """Of 20-node elements: corners and middles of edges."""
        a, b, c = self.chord, self.span, self.thickness
        corners = (a + 1) * (b + 1) * (c + 1)
        return corners + a * (b + 1) * (c + 1) + (a + 1) * b * (c + 1) + (a + 1) * (b + 1) * c


class InvertedElements(InvalidInput):
    """Elements of a mesh are turned inside out."""


@dataclass(frozen=True)
class SolidMesh:
    """A structured mesh and where its nodes lie in chord, span and thickness.

    Attributes
    ----------
    mesh
        scikit-fem's mesh; node numbers are its degrees of freedom.
    place
        Of each node on the half-element grid: along the chord (0 … 2·chord), the span and the
        thickness, shape (nodes, 3).
    """

    subdivision: Subdivision
    mesh: MeshHexS2
    place: np.ndarray
    _basis: Basis = field(repr=False)

    @classmethod
    def of(cls, shape: Shape, subdivision: Subdivision) -> SolidMesh:
        """Mesh of a solid given as a map from 0 ≤ s, h ≤ 1, −1 ≤ t ≤ 1.

        Raises
        ------
        InvertedElements
            Saying how many, and where the worst one lies.
        """
        n = subdivision
        fine = (2 * n.chord + 1, 2 * n.span + 1, 2 * n.thickness + 1)
        s, h = np.linspace(0, 1, fine[0]), np.linspace(0, 1, fine[1])
        points = shape(s, h, np.linspace(-1, 1, fine[2]))
        corner = MeshHex1.init_tensor(*(np.arange(0.0, size, 2) for size in fine))
        vertex = np.rint(corner.p).astype(int).T
        middle = (vertex[corner.edges[0]] + vertex[corner.edges[1]]) // 2
        place = np.concatenate((vertex, middle))
        mesh = MeshHexS2(points[tuple(place.T)].T.copy(), corner.t, sort_t=False)
        basis = Basis(mesh, ElementHexS2(), intorder=QUADRATURE_ORDER)
        solid = cls(n, mesh, place, basis)
        solid._check_elements()
        return solid

    @property
    def basis(self) -> Basis:
        """Scalar shape functions at the quadrature points."""
        return self._basis

    @property
    def node_count(self) -> int:
        return self.mesh.doflocs.shape[1]

    @property
    def position_m(self) -> np.ndarray:
        """x, y, z of the nodes, shape (nodes, 3)."""
        return self.mesh.doflocs.T

    @property
    def root(self) -> np.ndarray:
        """Nodes on the hub."""
        return np.flatnonzero(self.place[:, 1] == 0)

    def node_at(self, chord: int, span: int, thickness: int) -> int | None:
        """The node at a place of the half-element grid, None where 20-node elements have none."""
        found = np.flatnonzero((self.place == (chord, span, thickness)).all(axis=1))
        return int(found[0]) if len(found) else None

    def _check_elements(self) -> None:
        volume = self._basis.mapping.detDF(self._basis.X)  # (elements, quadrature points)
        # Chord, span and thickness may make a left-handed system: all elements turn the same way then.
        volume = volume * np.sign(volume.sum())
        worst = volume.min(axis=1) / np.abs(volume).mean(axis=1)
        bad = np.flatnonzero(~(worst > 1e-6))
        if len(bad) == 0:
            return
        i = bad[np.argmin(worst[bad])]
        span = 100 * self.place[self._basis.element_dofs[:, i]].mean(axis=0) / (2 * self.sizes)
        x, y, z = self.position_m[self._basis.element_dofs[:, i]].mean(axis=0)
        raise InvertedElements(
            "profile",
            f"{len(bad)} of {volume.shape[0]} elements inverted or without volume",
            f"the worst at {span[1]:.0f} % of the span, {span[0]:.0f} % of the chord, {span[2]:.0f} % of the "
            f"thickness, near r = {np.hypot(x, y):.4g} m, z = {z:.4g} m: sections cross there, have no "
            "thickness or turn too much between hub and tip",
        )

    @property
    def sizes(self) -> np.ndarray:
        """Elements along chord, span and thickness, shape (3,)."""
        return np.array([self.subdivision.chord, self.subdivision.span, self.subdivision.thickness])

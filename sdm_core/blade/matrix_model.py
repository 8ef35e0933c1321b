"""A blade as mass and stiffness matrices at one or more rotor speeds: reduced or full, ours or imported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg
from scipy.sparse import csc_array, issparse
from scipy.sparse.linalg import LinearOperator, eigsh

from sdm_core.blade.factorization import SymmetricFactor
from sdm_core.blade.modal import Blade, ModalState
from sdm_core.blade.tip_line import TipLine, cylindrical_frames
from sdm_core.errors import InvalidInput

Matrix = Any  # numpy array or scipy sparse array

# Above this many degrees of freedom the modes are found by shift and invert.
DENSE_UP_TO = 1500
TRANSLATIONS = (1, 2, 3)
MODAL = 0


@dataclass(frozen=True)
class DofMap:
    """What each row of the matrices is.

    Parameters
    ----------
    node
        Node number, shape (N,); 0 for a modal coordinate.
    component
        1, 2, 3 displacement along x, y, z; 4, 5, 6 rotation about them; 0 modal coordinate. Shape (N,).
    """

    node: np.ndarray
    component: np.ndarray

    def __post_init__(self) -> None:
        node, component = (np.array(values, dtype=int) for values in (self.node, self.component))
        if node.ndim != 1 or node.shape != component.shape:
            raise InvalidInput(
                "dofs", f"{node.shape} nodes, {component.shape} components", "give one component a node"
            )
        if ((component < 0) | (component > 6)).any():
            i = int(np.argmax((component < 0) | (component > 6)))
            raise InvalidInput(f"dofs.component[{i}]", int(component[i]), "give 1 to 6, or 0 for a modal one")
        physical = component != MODAL
        pairs = np.stack((node[physical], component[physical]))
        unique, count = np.unique(pairs, axis=1, return_counts=True)
        if (count > 1).any():
            twice = unique[:, int(np.argmax(count > 1))]
            raise InvalidInput("dofs", f"node {twice[0]} component {twice[1]} twice", "give every row once")
        for name, values in (("node", node), ("component", component)):
            values.setflags(write=False)
            object.__setattr__(self, name, values)

    def __len__(self) -> int:
        return len(self.node)

    def rows(self, nodes: Sequence[int]) -> np.ndarray:
        """Rows of the x, y, z displacements of nodes, shape (len(nodes), 3).

        Raises
        ------
        InvalidInput
            When the matrices do not hold all three of a node.
        """
        where = {
            (int(n), int(c)): i
            for i, (n, c) in enumerate(zip(self.node, self.component, strict=True))
            if c in TRANSLATIONS
        }
        out = np.empty((len(nodes), 3), dtype=int)
        for i, node in enumerate(nodes):
            for c in TRANSLATIONS:
                if (int(node), c) not in where:
                    there = np.unique(self.node[np.isin(self.component, TRANSLATIONS)])
                    known = ", ".join(map(str, there[:12])) + (", ..." if len(there) > 12 else "")
                    raise InvalidInput(
                        f"tip.nodes[{i}]",
                        node,
                        f"the matrices have no displacement {c} of this node: name some of {known}",
                    )
                out[i, c - 1] = where[int(node), c]
        return out


@dataclass(frozen=True)
class SpeedState:
    """The blade's stiffness about its equilibrium at one rotor speed.

    Parameters
    ----------
    speed_hz
        Rotor speed, Hz.
    stiffness
        Tangent stiffness with stress stiffening and spin softening, N/m, shape (N, N), symmetric.
    static_displacement
        Displacement from the shape at rest, in the coordinates of the model, m, shape (N,), where known.
    """

    speed_hz: float
    stiffness: Matrix
    static_displacement: np.ndarray | None = None


@dataclass(frozen=True)
class MatrixModel:
    """Mü + K(Ω)u = 0 at one or more rotor speeds ([SBL] 3.1).

    Parameters
    ----------
    name
        Free text.
    dofs
        What each row is.
    mass
        kg, shape (N, N), symmetric, dense or sparse.
    states
        Stiffness at each speed.
    node_position_m
        x, y, z of nodes by number, at least of the tip nodes.
    rotation_axis
        Unit vector; the axis passes through the origin.
    """

    name: str
    dofs: DofMap
    mass: Matrix
    states: tuple[SpeedState, ...]
    node_position_m: Mapping[int, tuple[float, float, float]]
    rotation_axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def modes(self, state: SpeedState, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The lowest modes at one of the speeds.

        Returns
        -------
        ω² in rad²/s², rising, shape (n,); mass-normalised shapes, shape (N, n).
        """
        return lowest_modes(state.stiffness, self.mass, count)

    def to_blade(
        self,
        tip: TipLine,
        *,
        damping_ratio: float | Sequence[float],
        modes: int = 5,
        name: str | None = None,
        design_speed_hz: float | None = None,
        mass_kg: float | None = None,
        material: dict[str, Any] | None = None,
    ) -> Blade:
        """The blade file's content: frequencies and tip mode shapes at each of the speeds.

        Raises
        ------
        InvalidInput
            For tip nodes the model does not hold, or a state that is not stable at rest (ω² ≤ 0).
        """
        rows = self.dofs.rows(tip.nodes)
        place = self.positions(tip.nodes)
        frames = cylindrical_frames(place, np.array(self.rotation_axis))
        states = []
        for i, state in enumerate(self.states):
            omega2, shape = self.modes(state, modes)
            loose = omega2 <= _rounding(state.stiffness, self.mass)
            if loose.any():
                raise InvalidInput(
                    f"states[{i}].stiffness",
                    f"mode {int(np.argmax(loose)) + 1} has ω² = {omega2.min():.3g}",
                    "the blade buckles or moves as a rigid body: clamp its root, check the stiffness",
                )
            at_tip = shape[rows].transpose(2, 0, 1)  # (n, r, 3)
            radial, tangential, axial = (
                np.einsum("nrx,rx->nr", at_tip, frames[:, axis]) for axis in range(3)
            )
            growth = untwist = None
            if state.static_displacement is not None:
                moved = state.static_displacement[rows]
                growth = np.einsum("rx,rx->r", moved, tip.contact_directions)
                untwist = _untwist(place, moved, frames)
            states.append(
                ModalState(
                    state.speed_hz,
                    np.sqrt(omega2) / (2 * np.pi),
                    np.einsum("nrx,rx->nr", at_tip, tip.contact_directions),
                    mode_shape_radial=radial,
                    mode_shape_tangential=tangential,
                    mode_shape_axial=axial,
                    tip_growth_m=growth,
                    untwist_rad=untwist,
                )
            )
        axis = np.array(self.rotation_axis)
        theta = np.arctan2(frames[:, 0] @ frames[0, 1], frames[:, 0] @ frames[0, 0])
        return Blade(
            name or self.name,
            tip.names,
            damping_ratio,
            states,
            tip.direction,
            design_speed_hz,
            mass_kg,
            np.einsum("rx,rx->r", place, frames[:, 0]).tolist(),
            (place @ axis).tolist(),
            material,
            theta.tolist(),
        )

    def positions(self, nodes: Sequence[int]) -> np.ndarray:
        """x, y, z of nodes, m, shape (len(nodes), 3)."""
        for i, node in enumerate(nodes):
            if int(node) not in self.node_position_m:
                raise InvalidInput(f"tip.nodes[{i}]", node, "the model gives no place of this node: add it")
        return np.array([self.node_position_m[int(node)] for node in nodes], dtype=float)


def lowest_modes(stiffness: Matrix, mass: Matrix, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The lowest modes of Kφ = ω²Mφ, by rising ω².

    Dense matrices are solved whole; sparse ones by the Lanczos method on (K − σM)⁻¹ with σ = 0, which
    a clamped blade allows.

    Returns
    -------
    ω², shape (n,); mass-normalised shapes, shape (N, n).

    Raises
    ------
    InvalidInput
        For a mass that is not positive definite, or a singular stiffness.

    Examples
    --------
    >>> omega2, shape = lowest_modes(np.diag([4.0, 9.0]), np.eye(2), 1)
    >>> omega2, abs(shape[:, 0])
    (array([4.]), array([1., 0.]))
    """
    size = stiffness.shape[0]
    count = min(count, size)
    if size <= DENSE_UP_TO or count >= size - 1:
        k, m = (x.toarray() if issparse(x) else np.asarray(x) for x in (stiffness, mass))
        try:
            omega2, shape = linalg.eigh(k, m, subset_by_index=(0, count - 1))
        except linalg.LinAlgError:
            return _by_compliance(k, m, count)
        return omega2, shape
    solve = SymmetricFactor(csc_array(stiffness)).solve
    inverse = LinearOperator((size, size), matvec=solve, dtype=float)
    # A fixed start, so that the same model gives the same shapes to the last bit.
    start = np.random.default_rng(0).standard_normal(size)
    omega2, shape = eigsh(csc_array(stiffness), count, csc_array(mass), sigma=0.0, OPinv=inverse, v0=start)
    rising = np.argsort(omega2)
    return omega2[rising], shape[:, rising]


def _by_compliance(k: np.ndarray, m: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The lowest modes as the largest 1/ω² of Mφ = (1/ω²)Kφ, where some directions have no mass."""
    size = len(k)
    try:
        compliance, shape = linalg.eigh(m, k, subset_by_index=(size - count, size - 1))
    except linalg.LinAlgError:
        raise InvalidInput(
            "mass",
            f"{size} × {size}",
            "it has directions without mass, and the stiffness does not hold the blade",
        ) from None
    if compliance[0] <= 0:
        raise InvalidInput("mass", f"{size} × {size}", f"it has fewer than {count} modes: ask for fewer")
    return 1.0 / compliance[::-1], shape[:, ::-1] / np.sqrt(compliance[::-1])


def _rounding(stiffness: Matrix, mass: Matrix) -> float:
    """ω² that rounding alone can make of a rigid body's 0: the largest ω², by its diagonal, times 1e-14."""
    k, m = stiffness.diagonal(), mass.diagonal()
    return 1e-14 * float((k[m > 0] / m[m > 0]).max(initial=0.0))


def _untwist(place: np.ndarray, moved: np.ndarray, frames: np.ndarray) -> float | None:
    """Turn of the tip's chord towards the axial direction, about the radius of its middle, rad."""
    if len(place) < 2:
        return None
    radial = frames[len(frames) // 2, 0]
    axial = frames[0, 2]
    tangential = np.cross(axial, radial)

    def stagger(points: np.ndarray) -> float:
        chord = points[-1] - points[0]
        return float(abs(np.arctan2(chord @ tangential, chord @ axial)))

    return stagger(place) - stagger(place + moved)

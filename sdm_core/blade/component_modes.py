"""Component mode synthesis: a finite-element blade reduced to its tip nodes and a few modes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import LinearOperator, eigsh

from sdm_core.blade.factorization import SymmetricFactor
from sdm_core.blade.finite_elements.equilibrium import Equilibrium
from sdm_core.blade.finite_elements.solid_model import SolidModel
from sdm_core.blade.matrix_model import MODAL, DofMap, MatrixModel, SpeedState, lowest_modes

# Directions of the modes of several speeds that carry less than this of the mass are the same direction.
_SAME_DIRECTION = 1e-13


@dataclass(frozen=True)
class CraigBampton:
    """Craig and Bampton's reduction with fixed-interface modes from several speeds ([SBL] 3.1, Eq. 15).

        u = [u_b; u_i] = [[1, 0], [Ψ_s(0), Ψ_c]] [u_b; q]

    The boundary displacements u_b stay as they are; Ψ_s = −K_ii⁻¹K_ib are the static modes at rest.
    Ψ_c holds, mass-orthonormalised together, from every speed of the states: the lowest modes with the
    boundary held; what the static modes there add to those at rest; and what the lowest free modes
    there add to both. The last are not in [SBL]: without them modes that bend the held line of nodes
    converge slowly (0.16 % on the fifth of rotor 37 with 15 held modes a speed), with them the reduced
    model has the full one's lowest modes at the speeds of its states. Each state's stiffness is projected as
    it is: nothing is fitted over speed (DESIGN, fact 9).

    Parameters
    ----------
    held_modes
        Modes with the boundary held, taken at each speed.
    free_modes
        Modes with the boundary free, taken at each speed.
    """

    held_modes: int = 10
    free_modes: int = 8

    def reduce(
        self,
        name: str,
        model: SolidModel,
        boundary_nodes: Sequence[int],
        equilibria: Sequence[Equilibrium],
        said: Callable[[str], None] = lambda what: None,
    ) -> MatrixModel:
        """The reduced model, its states at the speeds of the equilibria.

        Parameters
        ----------
        boundary_nodes
            Nodes kept, none of them clamped, shape (b,).
        equilibria
            The blade at each speed, by rising speed.

        Returns
        -------
        3b boundary displacements followed by the modal coordinates.
        """
        kept = model.rows(np.asarray(boundary_nodes)).ravel()
        inner = np.setdiff1d(np.arange(model.size), kept)
        at_rest = model.stiffness_at_rest() if equilibria[0].speed_hz else equilibria[0].stiffness
        mass = csc_array(model.mass[inner][:, inner])
        static, modes = np.zeros((len(inner), len(kept))), []
        stiffnesses = [at_rest] * bool(equilibria[0].speed_hz) + [each.stiffness for each in equilibria]
        for i, stiffness in enumerate(stiffnesses):
            said(f"static and fixed-interface modes, {i + 1} of {len(stiffnesses)} speeds")
            inside = csc_array(stiffness[inner][:, inner])
            factor = SymmetricFactor(inside)
            response = -factor.solve(stiffness[inner][:, kept].toarray())
            if i == 0:
                static = response
            else:
                modes.append(_unit(response - static, mass))
            modes.append(_held_modes(inside, mass, factor, self.held_modes))
        for each in equilibria:
            said(f"free modes at {each.speed_hz:.4g} Hz")
            free = lowest_modes(each.stiffness, model.mass, self.free_modes)[1]
            modes.append(_unit(free[inner] - static @ free[kept], mass))
        component = _orthonormal(np.hstack(modes), mass)
        basis = np.zeros((model.size, len(kept) + component.shape[1]))
        basis[kept, np.arange(len(kept))] = 1.0
        basis[inner, : len(kept)] = static
        basis[inner, len(kept) :] = component
        reduced_mass = _projected(model.mass, basis)
        states = []
        for each in equilibria:
            boundary = each.displacement[kept]
            inside = each.displacement[inner] - static @ boundary
            q = np.linalg.solve(component.T @ (mass @ component), component.T @ (mass @ inside))
            states.append(
                SpeedState(each.speed_hz, _projected(each.stiffness, basis), np.concatenate((boundary, q)))
            )
        nodes = np.asarray(boundary_nodes)
        modal = np.zeros(component.shape[1], dtype=int)
        dofs = DofMap(
            np.concatenate((np.repeat(nodes + 1, 3), modal)),  # node numbers count from 1; 0 is modal
            np.concatenate((np.tile([1, 2, 3], len(nodes)), modal + MODAL)),
        )
        position = model.mesh.position_m
        place = {
            int(n) + 1: (float(x), float(y), float(z))
            for n, (x, y, z) in zip(nodes, position[nodes], strict=True)
        }
        return MatrixModel(name, dofs, reduced_mass, tuple(states), place)


def _held_modes(stiffness: csc_array, mass: csc_array, factor: SymmetricFactor, count: int) -> np.ndarray:
    inverse = LinearOperator(stiffness.shape, matvec=factor.solve, dtype=float)
    # A fixed start, so that the same blade gives the same basis to the last bit.
    start = np.random.default_rng(0).standard_normal(stiffness.shape[0])
    return eigsh(stiffness, count, mass, sigma=0.0, OPinv=inverse, v0=start, tol=1e-9)[1]


def _unit(vectors: np.ndarray, mass: csc_array) -> np.ndarray:
    """Columns scaled to unit mass, so that none is dropped for being small."""
    size = np.sqrt(np.einsum("ij,ij->j", vectors, mass @ vectors))
    return vectors[:, size > 0] / size[size > 0]


def _orthonormal(vectors: np.ndarray, mass: csc_array) -> np.ndarray:
    """An M-orthonormal basis of the columns, directions that are the same dropped."""
    size, turn = np.linalg.eigh(vectors.T @ (mass @ vectors))
    own = size > _SAME_DIRECTION * size[-1]
    return vectors @ (turn[:, own] / np.sqrt(size[own]))


def _projected(matrix: csc_array, basis: np.ndarray) -> np.ndarray:
    reduced = basis.T @ (matrix @ basis)
    return 0.5 * (reduced + reduced.T)

"""Mass, internal forces and tangent stiffness of a solid clamped at its root (total Lagrangian)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array

from sdm_core.blade.finite_elements.material import Material
from sdm_core.blade.solid_mesh import SolidMesh

# Elements whose fields at quadrature points are held at once; an element matrix itself takes 29 kB.
_ELEMENTS_AT_ONCE = 512


@dataclass(frozen=True)
class SolidModel:
    """Mü + f(u) = Ω²S(X + u): a solid of St Venant-Kirchhoff material turning about the z axis.

    With F = 1 + ∂u/∂X, E = (FᵀF − 1)/2 and S = λ tr(E) 1 + 2μE, in the shape at rest,

        f_ai = ∫ ∂N_a/∂X_J F_iM S_MJ dV
        K_(ai)(bk) = ∫ ∂N_a/∂X_J [δ_ik S_JL + F_iM C_MJNL F_kN] ∂N_b/∂X_L dV

    The first term of K is the geometric stiffness (stress stiffening), and −Ω²S, with S the mass across
    the axis, the spin softening. Coriolis forces are left out: blades vibrate mainly along and across
    the axis, and the casing's contact is in the rotating frame.

    Degrees of freedom are x, y, z of each node that is not clamped, node by node.

    Attributes
    ----------
    mesh, material
        Shape at rest and material.
    """

    mesh: SolidMesh
    material: Material

    @cached_property
    def free_nodes(self) -> np.ndarray:
        """Node numbers, shape (nodes off the root,)."""
        free = np.ones(self.mesh.node_count, dtype=bool)
        free[self.mesh.root] = False
        return np.flatnonzero(free)

    @property
    def size(self) -> int:
        """Degrees of freedom, N."""
        return 3 * len(self.free_nodes)

    def rows(self, nodes: np.ndarray) -> np.ndarray:
        """Degrees of freedom of nodes, shape (len(nodes), 3); −1 where clamped."""
        where = np.full(self.mesh.node_count, -1)
        where[self.free_nodes] = np.arange(len(self.free_nodes))
        at = where[np.asarray(nodes)]
        return np.where(at[..., None] < 0, -1, 3 * at[..., None] + np.arange(3))

    @cached_property
    def mass(self) -> csc_array:
        """Consistent mass, kg, shape (N, N)."""
        return self._mass(np.ones(3))

    @cached_property
    def mass_across_axis(self) -> csc_array:
        """The mass's x and y rows: Ω² times it is the spin softening, N/m per (rad/s)²."""
        return self._mass(np.array([1.0, 1.0, 0.0]))

    @cached_property
    def centrifugal_load(self) -> np.ndarray:
        """Centrifugal force at rest's shape over Ω², kg m, shape (N,)."""
        across = np.ones(3)
        across[2] = 0.0
        moment = self._scalar_mass(clamped=True) @ self.mesh.position_m
        return (moment[self.free_nodes] * across).ravel()

    @cached_property
    def total_mass_kg(self) -> float:
        return float(self.material.density * self.mesh.basis.dx.sum())

    def stiffness_at_rest(self) -> csc_array:
        """Linear elastic stiffness, N/m, shape (N, N)."""
        return self.tangent(np.zeros(self.size))[1]

    def tangent(self, u: np.ndarray) -> tuple[np.ndarray, csc_array]:
        """Internal forces f(u), N, and their derivative K(u), N/m.

        Parameters
        ----------
        u
            Displacement from the shape at rest, m, shape (N,).
        """
        lam, mu = self.material.lame_lambda, self.material.shear_modulus
        one = np.eye(3)
        elastic = lam * np.einsum("ij,kl->ijkl", one, one)
        elastic += mu * (np.einsum("ik,jl->ijkl", one, one) + np.einsum("il,jk->ijkl", one, one))
        nodal = np.zeros((self.mesh.node_count, 3))
        nodal[self.free_nodes] = u.reshape(-1, 3)
        dofs = self.mesh.basis.element_dofs
        forces = np.zeros((self.mesh.node_count, 3))
        blocks = np.empty((dofs.shape[1], 60, 60))
        for part, gradient, dx in self._gradients():
            slope = np.einsum("eqaJ,eai->eqiJ", gradient, nodal[dofs[:, part].T])
            f = slope + one
            # (FᵀF − 1)/2 without the difference, whose rounding would exceed the loads of slender blades.
            green = 0.5 * (slope + slope.swapaxes(2, 3) + slope.swapaxes(2, 3) @ slope)
            trace = np.trace(green, axis1=2, axis2=3)
            stress = lam * trace[..., None, None] * one + 2 * mu * green
            first_piola = f @ stress
            weighted = gradient * dx[..., None, None]
            nodal_force = np.einsum("eqaJ,eqiJ->eai", weighted, first_piola, optimize=True)
            np.add.at(forces, dofs[:, part].T, nodal_force)
            moduli = np.einsum("eqiM,MJNL,eqkN->eqikJL", f, elastic, f, optimize=True)
            for i in range(3):
                moduli[:, :, i, i] += stress
            blocks[part] = _element_stiffness(weighted, moduli, gradient)
        return forces[self.free_nodes].ravel(), self._assembled(blocks)

    def _gradients(self) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
        """∂N/∂X of groups of elements, 1/m, shape (e, quadrature points, 20, 3), with the volumes."""
        basis = self.mesh.basis
        for start in range(0, basis.element_dofs.shape[1], _ELEMENTS_AT_ONCE):
            part = slice(start, start + _ELEMENTS_AT_ONCE)
            fields = np.stack([shape[0].grad[:, part] for shape in basis.basis])  # (20, 3, e, q)
            yield part, np.ascontiguousarray(fields.transpose(2, 3, 0, 1)), basis.dx[part]

    def _scalar_mass(self, clamped: bool) -> csc_array:
        """∫ ρ N_a N_b dV over all nodes, or the free ones."""
        basis = self.mesh.basis
        shapes = np.stack([np.broadcast_to(shape[0], basis.dx.shape) for shape in basis.basis])
        blocks = np.einsum("aeq,beq,eq->eab", shapes, shapes, self.material.density * basis.dx, optimize=True)
        dofs = basis.element_dofs.T
        rows = np.broadcast_to(dofs[:, :, None], blocks.shape).ravel()
        columns = np.broadcast_to(dofs[:, None, :], blocks.shape).ravel()
        count = self.mesh.node_count
        whole = csc_array((blocks.ravel(), (rows, columns)), shape=(count, count))
        return whole if clamped else whole[self.free_nodes][:, self.free_nodes]

    def _mass(self, components: np.ndarray) -> csc_array:
        scalar = self._scalar_mass(clamped=False).tocoo()
        kept = np.flatnonzero(components)
        rows = (3 * scalar.coords[0][:, None] + kept).ravel()
        columns = (3 * scalar.coords[1][:, None] + kept).ravel()
        values = np.repeat(scalar.data, len(kept))
        return csc_array((values, (rows, columns)), shape=(self.size, self.size))

    @cached_property
    def _pattern(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Which entries of the element matrices are kept, where each goes, and the sparse structure."""
        dofs = self.rows(self.mesh.basis.element_dofs.T).reshape(-1, 60)
        rows = np.broadcast_to(dofs[:, :, None], (len(dofs), 60, 60)).ravel()
        columns = np.broadcast_to(dofs[:, None, :], (len(dofs), 60, 60)).ravel()
        kept = (rows >= 0) & (columns >= 0)
        keys = columns[kept].astype(np.int64) * self.size + rows[kept]
        unique, target = np.unique(keys, return_inverse=True)
        indices = (unique % self.size).astype(np.int32)
        pointers = np.searchsorted(unique, np.arange(self.size + 1) * np.int64(self.size)).astype(np.int32)
        return kept, target.astype(np.int32), indices, pointers

    def _assembled(self, blocks: np.ndarray) -> csc_array:
        kept, target, indices, pointers = self._pattern
        data = np.bincount(target, weights=blocks.ravel()[kept], minlength=len(indices))
        return csc_array((data, indices, pointers), shape=(self.size, self.size))


def _element_stiffness(weighted: np.ndarray, moduli: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """∫ ∂N_a/∂X_J A_iJkL ∂N_b/∂X_L dV of each element, shape (e, 60, 60), rows (a, i)."""
    elements, points, nodes, _ = gradient.shape
    right = gradient.transpose(0, 1, 3, 2).reshape(elements, points * 3, nodes)
    out = np.empty((elements, nodes, 3, nodes, 3))
    for i in range(3):
        for k in range(i, 3):
            left = weighted @ moduli[:, :, i, k]  # (e, q, a, L)
            left = left.transpose(0, 2, 1, 3).reshape(elements, nodes, points * 3)
            out[:, :, i, :, k] = left @ right
            if k != i:
                out[:, :, k, :, i] = out[:, :, i, :, k].transpose(0, 2, 1)
    return out.reshape(elements, 60, 60)

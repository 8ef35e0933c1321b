"""One revolution of a motion, known at every instant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.time_domain.revolution_mesh import RevolutionMesh
from sdm_core.time_domain.runge_kutta import AT_NODES, dense_basis


@dataclass(frozen=True)
class Revolution:
    """The state over one revolution: a polynomial of degree 7 in each step.

    Attributes
    ----------
    mesh
        Its steps.
    ends
        States at their ends, shape (steps + 1, d).
    dense
        Terms of the dense output (`runge_kutta.dense_basis`), shape (steps, 7, d).
    """

    mesh: RevolutionMesh
    ends: np.ndarray
    dense: np.ndarray

    @classmethod
    def constant(cls, mesh: RevolutionMesh, state: np.ndarray) -> Revolution:
        """A state that was held for the whole revolution, shape (d,)."""
        many = len(mesh.steps)
        return cls(mesh, np.tile(state, (many + 1, 1)), np.zeros((many, AT_NODES.shape[1], len(state))))

    def at(self, times: np.ndarray) -> np.ndarray:
        """States at times from the beginning of the revolution, s in [0, τ], any shape (...,); (..., d)."""
        times = np.asarray(times, dtype=float)
        k = np.clip(np.searchsorted(self.mesh.ends, times, side="right") - 1, 0, len(self.mesh.steps) - 1)
        place = (times - self.mesh.ends[k]) / self.mesh.steps[k]
        return self.ends[k] + np.einsum("...t,...td->...d", dense_basis(place), self.dense[k])

    def at_stages(self, mesh: RevolutionMesh, coordinates: np.ndarray) -> np.ndarray:
        """Some coordinates at the stages of a mesh of the next revolution, shape (steps, 16, q)."""
        if mesh is not self.mesh:
            return self.at(mesh.stage_times)[..., coordinates]
        inside = np.einsum("st,ktd->ksd", AT_NODES, self.dense[:, :, coordinates])
        return inside + self.ends[:-1, None, coordinates]

    @property
    def largest(self) -> np.ndarray:
        """Largest modulus of each coordinate at the ends of steps, shape (d,)."""
        return np.abs(self.ends).max(axis=0)

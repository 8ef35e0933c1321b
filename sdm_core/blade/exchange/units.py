"""Unit systems of imported files, converted to SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import diags_array, issparse

from sdm_core.blade.matrix_model import MODAL, DofMap, Matrix
from sdm_core.errors import InvalidInput


@dataclass(frozen=True)
class Units:
    """A consistent system of units with the second.

    Parameters
    ----------
    name
        How callers name it.
    metres
        Metres in its length.
    kilograms
        Kilograms in its mass.
    """

    name: str
    metres: float
    kilograms: float

    def scale(self, dofs: DofMap) -> np.ndarray:
        """d with u_file = d u_SI for each degree of freedom, shape (N,).

        Rotations have no unit; a modal coordinate is scaled so that a modal mass of one stays one.
        """
        d = np.where(dofs.component <= 3, 1 / self.metres, 1.0)
        return np.where(dofs.component == MODAL, self._energy**-0.5, d)

    @property
    def _energy(self) -> float:
        return self.kilograms * self.metres**2

    def matrix(self, matrix: Matrix, dofs: DofMap) -> Matrix:
        """K or M in SI: uᵀAu is an energy, so A_SI = e D A D with e joules in the unit of energy."""
        if self.metres == 1.0 and self.kilograms == 1.0:
            return matrix
        d = self.scale(dofs)
        if issparse(matrix):
            scale = diags_array(d)
            return (scale @ matrix @ scale).tocsc() * self._energy
        return matrix * (d[:, None] * d[None, :]) * self._energy

    def displacement(self, vector: np.ndarray, dofs: DofMap) -> np.ndarray:
        """Displacements in SI."""
        return vector / self.scale(dofs)

    @property
    def mode_shape(self) -> float:
        """kg^-1/2 in the unit of a mass-normalised amplitude."""
        return float(self.kilograms**-0.5)


SI = Units("SI", 1.0, 1.0)
MM_T_S = Units("mm-t-s", 1e-3, 1e3)
SYSTEMS = {system.name: system for system in (SI, MM_T_S)}


def units_of(name: str) -> Units:
    """The system of a name: never guessed.

    Examples
    --------
    >>> units_of("mm-t-s").metres
    0.001
    """
    if name not in SYSTEMS:
        raise InvalidInput("units", name, f"give one of {', '.join(SYSTEMS)}")
    return SYSTEMS[name]

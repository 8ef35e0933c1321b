"""Rows without mass (incompatible modes, rotations of shells) condensed out of imported matrices."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, hstack, issparse
from scipy.sparse.linalg import splu

from sdm_core.blade.matrix_model import Matrix
from sdm_core.errors import InvalidInput

# Of the largest mass: what is smaller is rounding.
_NO_MASS = 1e-13
_COLUMNS_AT_ONCE = 500


def rows_without_mass(mass: Matrix) -> np.ndarray:
    """Which rows hold no mass at all, to rounding, shape (N,)."""
    size = abs(csc_array(mass)).max(axis=1)
    row = np.asarray(size.toarray() if issparse(size) else size).ravel()
    return row <= _NO_MASS * row.max(initial=0.0)


def condensed_mass(mass: Matrix, out: np.ndarray) -> Matrix:
    """The mass of the other rows."""
    return csc_array(mass)[~out][:, ~out] if issparse(mass) else mass[np.ix_(~out, ~out)]


def condensed(stiffness: Matrix, out: np.ndarray) -> Matrix:
    """K_aa − K_ab K_bb⁻¹ K_ba: rows b without mass follow the others statically, at every frequency.

    Raises
    ------
    InvalidInput
        When they are not held by their stiffness either.
    """
    sparse = csc_array(stiffness)
    kept, gone = sparse[~out], sparse[out]
    try:
        factor = splu(csc_array(gone[:, out]), permc_spec="MMD_AT_PLUS_A")
    except RuntimeError:
        raise InvalidInput(
            "mass",
            f"{out.sum()} rows without mass",
            "they have no stiffness of their own either: leave these rows out of the export",
        ) from None
    coupling = csc_array(gone[:, ~out])
    parts = []
    for i in range(0, coupling.shape[1], _COLUMNS_AT_ONCE):
        parts.append(csc_array(factor.solve(coupling[:, i : i + _COLUMNS_AT_ONCE].toarray())))
    reduced = csc_array(kept[:, ~out] - csc_array(kept[:, out]) @ csc_array(hstack(parts)))
    reduced = 0.5 * (reduced + reduced.T)
    return csc_array(reduced) if issparse(stiffness) else reduced.toarray()

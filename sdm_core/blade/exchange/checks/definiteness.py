"""Symmetry, definiteness and lowest frequencies of imported matrices, dense or sparse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg
from scipy.sparse import csc_array, diags_array, issparse
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from sdm_core.blade.matrix_model import DENSE_UP_TO, Matrix
from sdm_core.errors import InvalidInput

# A stiffness is symmetric to rounding; beyond this part of its largest entry it is another matrix.
LARGEST_ASYMMETRY = 1e-6
# Eigenvalues of rigid motion come out as rounding of the highest: below this share of ω²_max they are zero.
RIGID_SHARE = 1e-13
SHOWN_MODES = 6
# Of a mass scaled to a unit diagonal, what is no more than rounding.
NO_MASS = 1e-10


@dataclass(frozen=True)
class Spectrum:
    """Low end of Kφ = ω²Mφ.

    Parameters
    ----------
    unstable
        Number of modes with ω² < 0 beyond rounding.
    rigid
        Number with ω² = 0 to rounding.
    frequency_hz
        The lowest frequencies above those.
    """

    unstable: int
    rigid: int
    frequency_hz: np.ndarray


def entries(matrix: Matrix) -> np.ndarray:
    """The stored entries."""
    return matrix.data if issparse(matrix) else matrix.ravel()


def symmetrised(where: str, matrix: Matrix) -> tuple[Matrix, float]:
    """The symmetric part, and the largest difference across the diagonal relative to the largest entry.

    Raises
    ------
    InvalidInput
        For entries that are not finite, a zero matrix, or a difference beyond 1e-6.
    """
    values = entries(matrix)
    if not np.isfinite(values).all():
        raise InvalidInput(where, "NaN or infinity", "export the matrix again")
    largest = float(np.abs(values).max(initial=0.0))
    if largest == 0.0:
        raise InvalidInput(where, "all zero", "export the matrix again")
    if largest > 1e150:
        raise InvalidInput(
            where, f"an entry of {largest:.3g}", "no blade is so stiff or heavy: export it again"
        )
    difference = matrix - matrix.T
    defect = float(np.abs(entries(difference)).max(initial=0.0)) / largest
    if defect > LARGEST_ASYMMETRY:
        raise InvalidInput(
            where,
            f"unsymmetric by {defect:.2g} of its largest entry",
            "give symmetric matrices: without Coriolis, follower or contact terms, or the file is damaged",
        )
    return (matrix if defect == 0.0 else (matrix + matrix.T) / 2), defect


def check_mass(where: str, mass: Matrix, row_name: list[str]) -> None:
    """A mass has no negative direction; one without mass (incompatible modes have such) is allowed.

    Raises
    ------
    InvalidInput
        Naming a row without mass, or the number of negative eigenvalues.
    """
    diagonal = mass.diagonal()
    if (diagonal <= 0).any():
        i = int(np.argmax(diagonal <= 0))
        count = int((diagonal <= 0).sum())
        raise InvalidInput(
            where,
            f"{diagonal[i]:.3g} on the diagonal of {row_name[i]}, {count} such rows",
            "every row needs mass: condense massless rows (static condensation), or the file is cut off",
        )
    # Scaled to a unit diagonal, so that units and rotations do not decide.
    scale = diagonal**-0.5
    if issparse(mass) and mass.shape[0] > DENSE_UP_TO:
        negative = _negative(csc_array(mass + diags_array(NO_MASS * diagonal)))
    else:
        dense = (mass.toarray() if issparse(mass) else mass) * scale[:, None] * scale[None, :]
        negative = int((linalg.eigvalsh(dense) < -NO_MASS).sum())
    if negative:
        raise InvalidInput(
            where,
            f"{negative} negative eigenvalues",
            "a mass has none: is this the stiffness, or a damaged file?",
        )


def spectrum(where: str, stiffness: Matrix, mass: Matrix) -> Spectrum:
    """Unstable, rigid and lowest elastic modes."""
    size = mass.shape[0]
    if size <= DENSE_UP_TO:
        k, m = (x.toarray() if issparse(x) else x for x in (stiffness, mass))
        try:
            omega2 = linalg.eigh(k, m, eigvals_only=True)
        except (
            linalg.LinAlgError
        ):  # directions without mass: 1/ω² is found instead, which a held blade allows
            try:
                compliance = linalg.eigh(m, k, eigvals_only=True)
            except linalg.LinAlgError:
                raise InvalidInput(
                    where, f"{size} × {size}", "its modes cannot be computed: check mass, clamp the root"
                ) from None
            omega2 = 1.0 / compliance[compliance > NO_MASS * compliance.max()][::-1]
        zero = RIGID_SHARE * size * float(np.abs(omega2).max())
        elastic = omega2[omega2 > zero][:SHOWN_MODES]
        return Spectrum(
            int((omega2 < -zero).sum()), int((np.abs(omega2) <= zero).sum()), np.sqrt(elastic) / (2 * np.pi)
        )
    k, m = csc_array(stiffness), csc_array(mass)
    # No mode is above four times the largest ratio on the diagonal by more than the coupling of neighbours.
    zero = RIGID_SHARE * 10 * float((np.abs(k.diagonal()) / m.diagonal()).max()) * 4
    shifted = csc_array(k + zero * m)
    try:
        factor = splu(
            shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:
        raise InvalidInput(where, f"{size} × {size}", "it is singular: clamp the root") from None
    unstable = int((factor.U.diagonal() < 0).sum())
    inverse = LinearOperator((size, size), matvec=factor.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(size)
    omega2 = np.sort(
        eigsh(k, SHOWN_MODES + 6, m, sigma=-zero, OPinv=inverse, v0=start, return_eigenvectors=False)
    )
    elastic = omega2[omega2 > zero][:SHOWN_MODES]
    return Spectrum(unstable, int((np.abs(omega2) <= zero).sum()), np.sqrt(elastic) / (2 * np.pi))


def _negative(matrix: csc_array) -> int:
    """Number of negative eigenvalues by Sylvester's law, from the pivots of a symmetric factorisation."""
    try:
        factor = splu(
            matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:
        return 1
    return int((factor.U.diagonal() <= 0).sum())

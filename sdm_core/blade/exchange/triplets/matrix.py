"""Symmetric matrices from lines of row, column, value."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, csc_array

from sdm_core.blade.exchange.content import bounded_shape
from sdm_core.errors import DamagedFile


def matrix_of_triplets(path: Path, table: np.ndarray, *, size: int | None = None) -> csc_array:
    """A square matrix from rows (i, j, value), indices from 1; one triangle is mirrored.

    Parameters
    ----------
    path
        The file, for the error.
    table
        Shape (m, 3).
    size
        Order of the matrix where known; else the largest index.

    Raises
    ------
    DamagedFile
        For indices that are no whole numbers from 1, NaN or infinity, or an entry given twice.
    """
    if not np.isfinite(table).all():
        line = int(np.argmin(np.isfinite(table).all(axis=1)))
        raise DamagedFile(f"{path.name}: entry {line + 1}", "NaN or infinity", "export the file again")
    index = table[:, :2]
    bad = (index < 1) | (index != np.floor(index)) | (index > 2**31)
    if bad.any():
        line = int(np.argmax(bad.any(axis=1)))
        raise DamagedFile(
            f"{path.name}: entry {line + 1}",
            index[line].tolist(),
            "rows and columns are whole numbers from 1",
        )
    largest = int(index.max())
    order = bounded_shape(path, "matrix", size or largest, size or largest, sparse=True)[0]
    # Every degree of freedom has at least its diagonal entry: an order far beyond the entries is damage.
    if largest > order or order > len(table):
        raise DamagedFile(
            f"{path.name}: matrix",
            f"order {max(order, largest)} with {len(table)} entries",
            "the file is cut off or damaged: export it again",
        )
    i, j = (index[:, k].astype(np.int64) - 1 for k in (0, 1))
    values = table[:, 2]
    if (i <= j).all() or (i >= j).all():
        off = i != j
        values = np.concatenate((values, values[off]))
        i, j = np.concatenate((i, j[off])), np.concatenate((j, i[off]))
    # The conversion adds up what is given twice.
    matrix = csc_array(coo_array((values, (i, j)), shape=(order, order)))
    if matrix.nnz != len(values):
        raise DamagedFile(f"{path.name}: matrix", "an entry given twice", "give every entry once")
    matrix.eliminate_zeros()
    return matrix

"""Nastran OUTPUT4 files: writing, with every bit of a double."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.sparse import csc_array, issparse

from sdm_core.blade.exchange.content import arrays_of_model
from sdm_core.blade.matrix_model import Matrix, MatrixModel
from sdm_core.errors import InvalidInput

# 17 significant digits bring every double back to the last bit.
_DIGITS, _WIDTH, _PER_LINE = 16, 24, 3
_NUMBER = f"%{_WIDTH}.{_DIGITS}E"
_SQUARE, _RECTANGULAR, _SYMMETRIC, _DOUBLE = 1, 2, 6, 2


def write_op4(model: MatrixModel, path: Path, *, binary: bool = True) -> None:
    """Write a model as OP4: M, K1, K2, ..., and beside them SPEEDHZ, AXIS, DOFS, NODES, U1, ..., in SI.

    Sparse matrices are written as strings (``bigmat``), dense ones dense.
    """
    arrays = arrays_of_model(model)
    for name in arrays:
        if len(name) > 8:
            raise InvalidInput(
                "model.states", f"{len(model.states)} states", "OP4 names have 8 letters at most"
            )
    with path.open("wb") as file:
        for block in _binary(arrays) if binary else _ascii(arrays):
            file.write(block)


def _form(matrix: Matrix) -> int:
    if matrix.shape[0] != matrix.shape[1]:
        return _RECTANGULAR
    return _SYMMETRIC if abs(matrix - matrix.T).max() == 0 else _SQUARE


def _strings(matrix: Matrix) -> Iterator[tuple[int, list[tuple[int, np.ndarray]]]]:
    """Columns that hold anything, as (column, [(first row, values), ...]); rows and columns from 1."""
    sparse = csc_array(matrix)
    sparse.sort_indices()
    data, rows = np.ascontiguousarray(sparse.data, "<f8"), sparse.indices
    new = np.ones(len(rows) + 1, dtype=bool)
    new[1:-1] = np.diff(rows) != 1
    new[sparse.indptr] = True
    starts = np.flatnonzero(new)
    # Which of the starts opens a column.
    opens = np.searchsorted(starts, sparse.indptr).tolist()
    cuts, first = starts.tolist(), (rows[starts[:-1]] + 1).tolist()
    for j, (a, b) in enumerate(pairwise(opens)):
        if a < b:
            yield j + 1, [(first[k], data[cuts[k] : cuts[k + 1]]) for k in range(a, b)]


def _binary(arrays: Mapping[str, Matrix]) -> Iterator[bytes]:
    def record(*parts: bytes) -> bytes:
        body = b"".join(parts)
        return struct.pack("<i", len(body)) + body + struct.pack("<i", len(body))

    def words(*values: int) -> bytes:
        return struct.pack(f"<{len(values)}i", *values)

    pair = struct.Struct("<2i").pack
    for name, matrix in arrays.items():
        rows, columns = matrix.shape
        in_strings = issparse(matrix)
        yield record(
            words(columns, -rows if in_strings else rows, _form(matrix), _DOUBLE),
            name.ljust(8).encode("ascii"),
        )
        if in_strings:
            for column, strings in _strings(matrix):
                body = b"".join(pair(2 * len(v) + 1, first) + v.tobytes() for first, v in strings)
                yield record(words(column, 0, len(body) // 4), body)
        else:
            for column in range(1, columns + 1):
                values = np.ascontiguousarray(matrix[:, column - 1], "<f8")
                yield record(words(column, 1, 2 * rows), values.tobytes())
        yield record(words(columns + 1, 1, 2), struct.pack("<d", 1.0))


def _ascii(arrays: Mapping[str, Matrix]) -> Iterator[bytes]:
    def lines(values: np.ndarray) -> str:
        parts = [_NUMBER % value for value in values.tolist()]
        return "".join("".join(parts[i : i + _PER_LINE]) + "\n" for i in range(0, len(parts), _PER_LINE))

    for name, matrix in arrays.items():
        rows, columns = matrix.shape
        in_strings = issparse(matrix)
        sign = -1 if in_strings else 1
        head = f"{columns:8}{sign * rows:8}{_form(matrix):8}{_DOUBLE:8}{name:8}"
        yield f"{head}1P,{_PER_LINE}E{_WIDTH}.{_DIGITS}\n".encode("ascii")
        if in_strings:
            for column, strings in _strings(matrix):
                count = sum(2 * len(v) + 2 for _, v in strings)
                text = "".join(f"{2 * len(v) + 1:8}{first:8}\n{lines(v)}" for first, v in strings)
                yield f"{column:8}{0:8}{count:8}\n{text}".encode("ascii")
        else:
            for column in range(1, columns + 1):
                yield f"{column:8}{1:8}{rows:8}\n{lines(matrix[:, column - 1])}".encode("ascii")
        yield f"{columns + 1:8}{1:8}{1:8}\n{lines(np.ones(1))}".encode("ascii")

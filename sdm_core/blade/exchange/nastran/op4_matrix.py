"""A matrix of an OUTPUT4 file while it is read, text or binary (see `op4`)."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.sparse import csc_array

from sdm_core.blade.exchange.content import bounded_shape
from sdm_core.blade.matrix_model import Matrix
from sdm_core.errors import DamagedFile

# Numbers of a type: 1 real single, 2 real double, 3 and 4 complex.
REAL_SINGLE, REAL_DOUBLE = 1, 2
_NAME = re.compile(r"[A-Za-z_$][A-Za-z0-9_$]*")
CUT_OFF = "the file is cut off: export it again"


@dataclass
class Op4Matrix:
    """A matrix while its columns arrive as strings of values, which the reader keeps."""

    path: Path
    name: str
    rows: int
    columns: int
    string_columns: list[int] = field(default_factory=list)
    first_rows: list[int] = field(default_factory=list)
    lengths: list[int] = field(default_factory=list)
    last_column: int = 0
    in_strings: bool = False

    @property
    def where(self) -> str:
        return f"{self.path.name}: {self.name}"

    def begin(self, column: int) -> None:
        """The next column's record: columns rise."""
        if not self.last_column < column <= self.columns:
            raise DamagedFile(
                self.where,
                f"column {column} after {self.last_column} of {self.columns}",
                "the file is damaged: export it again",
            )
        self.last_column = column

    def put(self, first_row: int, length: int) -> None:
        """Values of the current column from a row on."""
        if first_row < 1 or length < 0 or first_row + length - 1 > self.rows:
            raise DamagedFile(
                self.where,
                f"{length} values from row {first_row} of {self.rows} on, in column {self.last_column}",
                "the file is damaged: export it again",
            )
        self.string_columns.append(self.last_column - 1)
        self.first_rows.append(first_row - 1)
        self.lengths.append(length)

    def finished(self, values: np.ndarray) -> Matrix:
        """The matrix of all values in the order they came; dense where it was written dense."""
        shape = bounded_shape(self.path, self.name, self.rows, self.columns, sparse=self.in_strings)
        length = np.array(self.lengths, dtype=np.int64)
        before = np.cumsum(length) - length
        i = np.arange(len(values)) + np.repeat(np.array(self.first_rows, dtype=np.int64) - before, length)
        j = np.repeat(np.array(self.string_columns, dtype=np.int64), length)
        if not np.isfinite(values).all():
            bad = int(np.argmin(np.isfinite(values)))
            raise DamagedFile(
                self.where, f"{values[bad]} in row {i[bad] + 1}, column {j[bad] + 1}", "export the file again"
            )
        # A dense matrix that is nearly empty is a damaged size as like as not: memory follows the file.
        if not self.in_strings and len(values) * 100 >= shape[0] * shape[1]:
            dense = np.zeros(shape)
            dense[i, j] = values
            return dense
        matrix = csc_array((values, (i, j)), shape=shape)
        if matrix.nnz != len(values):
            raise DamagedFile(self.where, "an entry given twice", "the file is damaged: export it again")
        return matrix


def checked_header(
    path: Path, columns: int, rows: int, form: int, kind: int, name: str
) -> tuple[Op4Matrix, bool]:
    """A matrix from its header, and whether it is ``bigmat``."""
    name = name.replace("\x00", " ").strip().replace(" ", "")
    where = f"{path.name}: {name or 'first matrix'}"
    if _NAME.fullmatch(name) is None:
        raise DamagedFile(
            f"{path.name}: name of a matrix", name, "this is no OP4 file, or a damaged one: export it again"
        )
    if kind in (3, 4):
        raise DamagedFile(where, f"type {kind}, complex", "give real matrices: without structural damping")
    if kind not in (REAL_SINGLE, REAL_DOUBLE):
        raise DamagedFile(where, f"type {kind}", "types are 1 to 4: this is no OP4 file, or a damaged one")
    if not 1 <= form <= 13:
        raise DamagedFile(where, f"form {form}", "this is no OP4 file, or a damaged one: export it again")
    bounded_shape(path, name, abs(rows), columns, sparse=True)
    return Op4Matrix(path, name, abs(rows), columns), rows < 0


def unpacked(word: int) -> tuple[int, int]:
    """Length in words and first row of a string that is not ``bigmat``: 65536 (length + 1) + row."""
    return (word >> 16) - 1, word & 0xFFFF

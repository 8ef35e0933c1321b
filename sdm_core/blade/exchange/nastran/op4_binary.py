"""Binary OUTPUT4: Fortran records, either byte order, 32 or 64 bit (see `op4`)."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sdm_core.blade.exchange.nastran.op4_matrix import CUT_OFF, REAL_SINGLE, checked_header, unpacked
from sdm_core.blade.matrix_model import Matrix
from sdm_core.errors import DamagedFile


class _Records:
    """Fortran unformatted records: each between two copies of its length."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.path, self.data, self.at = path, data, 0
        little = struct.unpack("<i", data[:4])[0]
        self.order = "<" if little in (24, 48) else ">"
        self.wide = struct.unpack(f"{self.order}i", data[:4])[0] == 48
        self.word = 8 if self.wide else 4
        self.integers = np.dtype(f"{self.order}i{self.word}")

    @property
    def done(self) -> bool:
        return self.at >= len(self.data)

    def next(self) -> bytes:
        start = self.at + 4
        if start > len(self.data):
            raise DamagedFile(self.path.name, f"an end after {len(self.data)} bytes", CUT_OFF)
        (length,) = struct.unpack(f"{self.order}i", self.data[self.at : start])
        end = start + length
        if length < 0 or end + 4 > len(self.data):
            raise DamagedFile(self.path.name, f"an end inside a record of {length} bytes", CUT_OFF)
        if self.data[end : end + 4] != self.data[self.at : start]:
            raise DamagedFile(
                self.path.name,
                f"a record at byte {self.at} whose two lengths differ",
                "the file is damaged: transfer it in binary mode and export it again",
            )
        self.at = end + 4
        return self.data[start:end]


def binary_matrices(path: Path, data: bytes) -> Iterator[tuple[str, Matrix]]:
    """All matrices of a binary OP4 file by name.

    Raises
    ------
    DamagedFile
        Where the records do not fit together.
    """
    records = _Records(path, data)
    while not records.done:
        yield _matrix(records)


def _matrix(records: _Records) -> tuple[str, Matrix]:
    path, word = records.path, records.word
    head = records.next()
    if len(head) != 6 * word:
        raise DamagedFile(path.name, f"a header of {len(head)} bytes", "the file is damaged: export it again")
    columns, rows, form, kind = np.frombuffer(head[: 4 * word], records.integers).tolist()
    name = head[4 * word :].decode("ascii", "replace")
    matrix, bigmat = checked_header(path, columns, rows, form, kind, name)
    size = 4 if kind == REAL_SINGLE and not records.wide else 8
    integer = "q" if records.wide else "i"
    header = struct.Struct(f"{records.order}3{integer}")
    string = struct.Struct(f"{records.order}{2 if bigmat else 1}{integer}")
    values = bytearray()
    while True:
        record = records.next()
        if len(record) < 3 * word:
            raise DamagedFile(matrix.where, f"a record of {len(record)} bytes", "the file is damaged")
        column, row, words = header.unpack_from(record)
        if column == matrix.columns + 1:
            numbers = np.frombuffer(values, f"{records.order}f{size}").astype(float)
            return matrix.name, matrix.finished(numbers)
        matrix.begin(column)
        if len(record) != (words + 3) * word:
            raise DamagedFile(
                matrix.where,
                f"{len(record) - 3 * word} bytes for {words} words in column {column}",
                "the file is damaged: export it again",
            )
        at = 3 * word
        if row > 0:
            if (len(record) - at) % size:
                raise DamagedFile(matrix.where, f"{words} words of numbers", "the file is damaged")
            matrix.put(row, (len(record) - at) // size)
            values += record[at:]
            continue
        matrix.in_strings = True
        while at < len(record):
            if at + string.size > len(record):
                raise DamagedFile(matrix.where, f"column {column}", "the file is damaged: export it again")
            packed = string.unpack_from(record, at)
            length, first = (packed[0] - 1, packed[1]) if bigmat else unpacked(packed[0])
            start = at + string.size
            at = start + length * word
            if length < 1 or at > len(record) or length * word % size:
                raise DamagedFile(
                    matrix.where,
                    f"a string of {length} words in column {column}",
                    "the file is damaged: export it again",
                )
            matrix.put(first, length * word // size)
            values += record[start:at]

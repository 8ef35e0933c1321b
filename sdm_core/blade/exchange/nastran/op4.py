"""Nastran OUTPUT4 files, ASCII and binary: reading.

A matrix is a header (columns, rows, form, type, name) and records of columns. A record is dense (first row,
then values without gaps), or strings of values with their first row each: ``bigmat`` where the number of rows
is written negative, else packed with the length into one word. The matrix ends with a record for
column n + 1. Layout: Nastran Quick Reference Guide, OUTPUT4; DMAP module OUTPUT4.

Written here rather than taken from a library: the known one loads a compiler and a plotting library,
allocates whatever a damaged header asks for, and takes many damaged files for other matrices.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from sdm_core.blade.exchange.content import FileContent, content_of_arrays
from sdm_core.blade.exchange.nastran.op4_binary import binary_matrices
from sdm_core.blade.exchange.nastran.op4_matrix import (
    CUT_OFF,
    REAL_SINGLE,
    Op4Matrix,
    checked_header,
    unpacked,
)
from sdm_core.blade.exchange.parsing.file_bytes import file_bytes
from sdm_core.blade.exchange.parsing.fortran_fields import integer, reals
from sdm_core.blade.matrix_model import Matrix
from sdm_core.errors import DamagedFile

_FORMAT = re.compile(r"(?:1P,?)?\s*(\d+)[EDed](\d+)\.(\d+)")


def read_op4(path: Path) -> FileContent:
    """All matrices of an OP4 file, ASCII or binary (either byte order, 32 or 64 bit).

    Matrices ``DOFS``, ``NODES``, ``SPEEDHZ``, ``AXIS``, ``U1``, ..., which `write_op4` adds, are read as what
    they are; other files need a companion map of degrees of freedom.

    Raises
    ------
    DamagedFile
        For a file cut off, damaged, complex or of another kind.
    """
    data = file_bytes(path)
    if len(data) >= 16 and data[:4] in _MARKERS:
        matrices = binary_matrices(path, data)
    else:
        try:
            text = data.decode("ascii")
        except UnicodeDecodeError:
            raise DamagedFile(
                path.name, "neither OP4 text nor a Fortran record", "this is no OP4 file: give one"
            ) from None
        matrices = _ascii_matrices(path, text)
    arrays: dict[str, Matrix] = {}
    for name, matrix in matrices:
        if name in arrays:
            raise DamagedFile(f"{path.name}: {name}", "twice in the file", "write every matrix once")
        arrays[name] = matrix
    if not arrays:
        raise DamagedFile(path.name, "no matrix", "this is no OP4 file, or an empty one: export it again")
    return content_of_arrays(path, arrays)


# Length of the first Fortran record: four integers and a name of two words.
_MARKERS = {size.to_bytes(4, order) for size in (24, 48) for order in ("little", "big")}


def _ascii_matrices(path: Path, text: str) -> Iterator[tuple[str, Matrix]]:
    lines = text.split("\n")
    at = 0
    while at < len(lines):
        if not lines[at].strip():
            at += 1
            continue
        name, matrix, at = _ascii_matrix(path, lines, at)
        yield name, matrix


@dataclass(frozen=True)
class _NumberFormat:
    per_line: int
    width: int


def _ascii_header(path: Path, head: str, where: str) -> tuple[Op4Matrix, bool, int, _NumberFormat]:
    """The matrix, whether it is ``bigmat``, words of a number, and the format of numbers."""
    wide = head.endswith("|I16")
    edge = (0, 16, 32, 40, 48, 56) if wide else (0, 8, 16, 24, 32, 40)
    head = head.removesuffix("|I16")
    columns, rows, form, kind = (integer(where, head[a:b]) for a, b in pairwise(edge[:5]))
    matrix, bigmat = checked_header(path, columns, rows, form, kind, head[edge[4] : edge[5]])
    said = head[edge[5] :].strip() or "1P,5E16.9"
    match = _FORMAT.fullmatch(said)
    if match is None or not (1 <= int(match[1]) <= 40 and 8 <= int(match[2]) <= 80):
        raise DamagedFile(where, said, "there should be a format such as 1P,3E23.16")
    return matrix, bigmat, 1 if kind == REAL_SINGLE else 2, _NumberFormat(int(match[1]), int(match[2]))


def _ascii_matrix(path: Path, lines: list[str], at: int) -> tuple[str, Matrix, int]:
    matrix, bigmat, words, layout = _ascii_header(path, lines[at].rstrip(), f"{path.name}: line {at + 1}")
    texts: list[str] = []

    def line(i: int) -> str:
        if i >= len(lines):
            raise DamagedFile(matrix.where, f"an end at line {len(lines)}", CUT_OFF)
        return lines[i]

    def numbers(i: int, count: int) -> int:
        """Take the lines of `count` numbers from line i on; the line after them."""
        if not 0 <= count <= matrix.rows:
            raise DamagedFile(
                f"{path.name}: line {i}",
                f"{count} numbers in a column of {matrix.rows}",
                "the file is damaged: export it again",
            )
        while count > 0:
            here = min(count, layout.per_line)
            text = line(i)[: here * layout.width]
            if len(text) < here * layout.width:
                raise DamagedFile(f"{path.name}: line {i + 1}", text.strip()[-40:], CUT_OFF)
            texts.append(text)
            count, i = count - here, i + 1
        return i

    at += 1
    while True:
        where, record = f"{path.name}: line {at + 1}", line(at)
        half = 16 if len(record.rstrip()) > 24 else 8
        column, row, count = (integer(where, record[k * half : (k + 1) * half]) for k in range(3))
        at += 1
        if column == matrix.columns + 1:
            # One number stands in the closing record.
            reals(f"{path.name}: line {at + 1}", line(at), layout.width, 1)
            values = reals(matrix.where, "".join(texts), layout.width, sum(matrix.lengths))
            return matrix.name, matrix.finished(values), at + 1
        matrix.begin(column)
        if row > 0:
            at = numbers(at, count)
            matrix.put(row, count)
            continue
        if row < 0 or count < 1:
            raise DamagedFile(where, record.strip(), "the file is damaged: export it again")
        matrix.in_strings = True
        while count > 0:
            where, string = f"{path.name}: line {at + 1}", line(at)
            if bigmat:
                half = 16 if len(string.rstrip()) > 16 else 8
                length, first = integer(where, string[:half]) - 1, integer(where, string[half : 2 * half])
                count -= length + 2
            else:
                length, first = unpacked(integer(where, string))
                count -= length + 1
            if length < 1 or length % words or count < 0:
                raise DamagedFile(
                    where, f"a string of {length} words", "the file is damaged: export it again"
                )
            at = numbers(at + 1, length // words)
            matrix.put(first, length // words)

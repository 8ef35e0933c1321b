"""MATLAB files of version 5 (``save -v6`` and ``-v7``): reading.

The file is a tree of elements, each a type, a length and data; lengths are checked against what holds them
before anything is allocated. Objects, functions and other things that are not numbers, text, cells or
structures are named and left alone. Layout: MathWorks, MAT-File Format.
"""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from sdm_core.blade.exchange.content import bounded_shape
from sdm_core.blade.exchange.parsing.file_bytes import LARGEST_FILE_BYTES
from sdm_core.errors import DamagedFile

_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXT = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _CHAR, _SPARSE = 1, 2, 4, 5
_NUMERIC = range(6, 16)
_COMPLEX = 0x0800
_DEEPEST = 20
CUT_OFF = "the file is cut off or damaged: save it again"


@dataclass(frozen=True)
class Unread:
    """A variable that holds no numbers, text, cells or structure."""

    kind: str


@dataclass(frozen=True)
class _Element:
    kind: int
    data: bytes


def read_mat5(path: Path, data: bytes) -> dict[str, Any]:
    """Variables by name: arrays, sparse arrays, text (one string a row), lists (cells), dicts (structures).

    Raises
    ------
    DamagedFile
        For a file cut off or damaged.
    """
    reader = _Reader(path, "<" if data[126:128] == b"IM" else ">")
    out: dict[str, Any] = {}
    for element in reader.elements(data[128:]):
        if element.kind == _COMPRESSED:
            inflate = zlib.decompressobj()
            whole = inflate.decompress(element.data, LARGEST_FILE_BYTES)
            if not inflate.eof:
                raise DamagedFile(path.name, "compressed data without end", CUT_OFF)
            inner = list(reader.elements(whole))
        else:
            inner = [element]
        for part in inner:
            if part.kind != _MATRIX:
                raise DamagedFile(path.name, f"an element of type {part.kind}", CUT_OFF)
            name, value = reader.variable(part.data, 0)
            if name in out:
                raise DamagedFile(f"{path.name}: {name}", "twice in the file", CUT_OFF)
            if name:  # the nameless one holds MATLAB's own objects
                out[name] = value
    return out


class _Reader:
    def __init__(self, path: Path, order: str) -> None:
        self.path, self.order = path, order

    def elements(self, data: bytes) -> list[_Element]:
        """The elements that fill `data`."""
        out, at = [], 0
        while at < len(data):
            if at + 8 > len(data):
                if not any(data[at:]):
                    break
                raise DamagedFile(self.path.name, f"{len(data) - at} bytes over", CUT_OFF)
            kind, length = (int(x) for x in np.frombuffer(data[at : at + 8], f"{self.order}u4"))
            if kind >> 16:  # at most four bytes of data stand in the tag itself
                kind, length, start, following = kind & 0xFFFF, kind >> 16, at + 4, at + 8
                if length > 4:
                    raise DamagedFile(self.path.name, f"a small element of {length} bytes", CUT_OFF)
            else:
                start = at + 8
                # Everything is padded to eight bytes, compressed data are not.
                following = start + (length if kind == _COMPRESSED else -(-length // 8) * 8)
            if start + length > len(data):
                raise DamagedFile(
                    self.path.name, f"{length} bytes declared, {len(data) - start} there", CUT_OFF
                )
            out.append(_Element(kind, data[start : start + length]))
            at = following
        return out

    def variable(self, data: bytes, depth: int) -> tuple[str, Any]:
        """Name and value of one array."""
        if depth > _DEEPEST:
            raise DamagedFile(self.path.name, f"cells nested {depth} deep", CUT_OFF)
        if not data:
            return "", np.empty((0, 0))
        parts = self.elements(data)
        if not parts or parts[0].kind != 6 or len(parts[0].data) != 8:
            raise DamagedFile(self.path.name, "an array without flags", CUT_OFF)
        flags = int(np.frombuffer(parts[0].data, f"{self.order}u4")[0])
        kind = flags & 0xFF
        if kind in (3, 16, 17):
            name = parts[1].data.decode("latin-1") if len(parts) > 1 else ""
            if kind == 3 and len(parts) > 2:
                name = parts[2].data.decode("latin-1")
            return name, Unread({3: "an object", 16: "a function", 17: "an object"}[kind])
        if len(parts) < 3 or parts[1].kind != 5 or parts[2].kind not in (1, 2):
            raise DamagedFile(self.path.name, "an array without size or name", CUT_OFF)
        shape = tuple(int(x) for x in self._numbers(parts[1]))
        name = parts[2].data.decode("latin-1")
        if len(shape) < 2 or len(shape) > 8 or min(shape) < 0:
            raise DamagedFile(f"{self.path.name}: {name}", f"size {shape}", CUT_OFF)
        return name, self._value(name, kind, flags, shape, parts[3:], depth)

    def _value(
        self, name: str, kind: int, flags: int, shape: tuple[int, ...], parts: list[_Element], depth: int
    ) -> Any:
        where = f"{self.path.name}: {name or 'a cell'}"
        count = math.prod(shape)
        if kind in _NUMERIC or kind == _SPARSE:
            if flags & _COMPLEX:
                return Unread("complex numbers")
            if kind == _SPARSE:
                return self._sparse(where, shape, parts)
            values = self._numbers(parts[0]) if parts else np.empty(0)
            if values.size != count:
                raise DamagedFile(where, f"{values.size} numbers for size {shape}", CUT_OFF)
            return values.reshape(shape, order="F")
        if kind == _CHAR:
            text = "" if not parts else self._text(where, parts[0])
            if len(text) != count:
                raise DamagedFile(where, f"{len(text)} letters for size {shape}", CUT_OFF)
            return [text[i :: shape[0]] for i in range(shape[0])] if count else [""]
        if kind == _CELL:
            if len(parts) != count:
                raise DamagedFile(where, f"{len(parts)} cells for size {shape}", CUT_OFF)
            return [self.variable(part.data, depth + 1)[1] for part in parts]
        if kind == _STRUCT:
            return self._struct(where, count, parts, depth)
        raise DamagedFile(where, f"class {kind}", CUT_OFF)

    def _struct(self, where: str, count: int, parts: list[_Element], depth: int) -> Any:
        length = self._numbers(parts[0]) if parts else np.empty(0)
        if len(parts) < 2 or length.size != 1 or length[0] < 1 or len(parts[1].data) % int(length[0]):
            raise DamagedFile(where, "a structure without names", CUT_OFF)
        step = int(length[0])
        raw = [parts[1].data[i : i + step] for i in range(0, len(parts[1].data), step)]
        names = [name.split(b"\0")[0].decode("latin-1") for name in raw]
        if len(parts) - 2 != count * len(names):
            raise DamagedFile(where, f"{len(parts) - 2} fields for {count} × {len(names)}", CUT_OFF)
        values = [self.variable(part.data, depth + 1)[1] for part in parts[2:]]
        rows = [
            dict(zip(names, values[i : i + len(names)], strict=True))
            for i in range(0, len(values), max(len(names), 1))
        ]
        return rows[0] if count == 1 and rows else rows

    def _sparse(self, where: str, shape: tuple[int, ...], parts: list[_Element]) -> Any:
        if len(shape) != 2 or len(parts) < 3:
            raise DamagedFile(where, "a sparse matrix without its three parts", CUT_OFF)
        bounded_shape(self.path, where.rpartition(": ")[2], *shape, sparse=True)
        rows, starts, values = (self._numbers(part) for part in parts[:3])
        return checked_sparse(where, shape, values, rows, starts)

    def _numbers(self, element: _Element) -> np.ndarray:
        if element.kind not in _NUMBERS:
            raise DamagedFile(self.path.name, f"numbers of type {element.kind}", CUT_OFF)
        return np.frombuffer(element.data, self.order + _NUMBERS[element.kind])

    def _text(self, where: str, element: _Element) -> str:
        if element.kind not in _TEXT:
            raise DamagedFile(where, f"text of type {element.kind}", CUT_OFF)
        coding = _TEXT[element.kind]
        if coding in ("utf-16", "utf-32"):
            coding += "-le" if self.order == "<" else "-be"
        return element.data.decode(coding)


def checked_sparse(
    where: str, shape: tuple[int, ...], values: np.ndarray, rows: np.ndarray, starts: np.ndarray
) -> csc_array:
    """A matrix from compressed columns that fit together.

    Raises
    ------
    DamagedFile
        Where they do not: the libraries below trust them blindly.
    """
    starts, rows = np.asarray(starts).ravel(), np.asarray(rows).ravel()
    values = np.asarray(values).ravel()
    good = starts.size == shape[1] + 1 and starts.dtype.kind in "iu" and rows.dtype.kind in "iu"
    good = good and values.dtype.kind in "iuf"
    if good:
        starts = starts.astype(np.int64)
        count = int(starts[-1])
        good = starts[0] == 0 and bool((np.diff(starts) >= 0).all()) and count <= min(rows.size, values.size)
    if good:
        rows = rows[:count].astype(np.int64)
        good = count == 0 or (rows.min() >= 0 and rows.max() < shape[0])
    if not good:
        raise DamagedFile(where, "compressed columns that do not fit together", CUT_OFF)
    matrix = csc_array((values[:count].astype(float), rows, starts), shape=shape)
    if not matrix.has_canonical_format:
        matrix.sum_duplicates()
        if matrix.nnz != count:
            raise DamagedFile(where, "an entry given twice", CUT_OFF)
    return matrix

"""Universal files (UFF, .unv): datasets, nodes, units.

A dataset stands between lines of ``-1`` in the first six columns and starts with its number. Read here are
15 and 2411 (nodes), 55 (data at nodes), 58 (functions at nodes), 151 (header) and 164 (units). Layout:
Structural Dynamics Research Laboratory, University of Cincinnati, Universal File Format. Written here because
the known library writes frequencies and nodes with fewer digits than the format has room for.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from sdm_core.blade.exchange.content import Positions
from sdm_core.blade.exchange.parsing.file_bytes import file_bytes
from sdm_core.blade.exchange.parsing.fortran_fields import integer, real
from sdm_core.errors import DamagedFile

_MARK = re.compile(rb" {4}-1\s*")
_BINARY = re.compile(r"\s*(\d+)b")
CUT_OFF = "the file is cut off or damaged: export it again"


@dataclass(frozen=True)
class Dataset:
    """One dataset: its number, its lines without marks, and where it stands."""

    number: int
    lines: tuple[str, ...]
    where: str

    def line(self, i: int) -> str:
        """Line i from 0 after the number."""
        if i >= len(self.lines):
            raise DamagedFile(self.where, f"{len(self.lines)} lines", CUT_OFF)
        return self.lines[i]

    def integers(self, i: int, *widths: int) -> list[int]:
        """Whole numbers in fixed fields of a line; blank ones are 0."""
        line, out, at = self.line(i), [], 0
        for width in widths:
            out.append(integer(f"{self.where}, line {i + 1}", line[at : at + width].strip() or "0"))
            at += width
        return out

    def reals(self, i: int, width: int, count: int) -> list[float]:
        """Reals in fixed fields of a line.

        Raises
        ------
        DamagedFile
            For fields that are missing or no numbers.
        """
        line = self.line(i)
        if len(line.rstrip()) <= (count - 1) * width:
            raise DamagedFile(f"{self.where}, line {i + 1}", f"a line of {len(line)} characters", CUT_OFF)
        return [real(f"{self.where}, line {i + 1}", line[k * width : (k + 1) * width]) for k in range(count)]

    def id_values(self) -> dict[str, str]:
        """``WORD value`` pairs of the five identification lines, as `write_universal` writes them."""
        words = [word for line in self.lines[:5] for word in line.split()]
        return {a: b for a, b in pairwise(words) if a.isupper()}


def datasets(path: Path) -> Iterator[Dataset]:
    """All datasets of a universal file; binary ones are skipped by their declared length.

    Raises
    ------
    DamagedFile
        When a dataset has no end, or there is none.
    """
    data = file_bytes(path)
    at, seen = 0, 0

    def line() -> bytes | None:
        nonlocal at
        if at >= len(data):
            return None
        end = data.find(b"\n", at)
        end = len(data) if end < 0 else end
        out, at = data[at:end], end + 1
        return out.rstrip(b"\r")

    while (raw := line()) is not None:
        if _MARK.fullmatch(raw) is None:
            if raw.strip() and seen == 0:
                raise DamagedFile(
                    path.name, f"a first line {raw[:30]!r}", "this is no universal file: give one"
                )
            if raw.strip():
                raise DamagedFile(path.name, f"text {raw[:30]!r} between datasets", CUT_OFF)
            continue
        seen += 1
        number_line = line()
        if number_line is None:
            raise DamagedFile(path.name, "a dataset without number", CUT_OFF)
        head = number_line.decode("latin-1")
        binary = _BINARY.match(head)
        if binary is not None:
            # Number of header lines and of bytes follow in fields of six and twelve.
            count, length = integer(path.name, head[19:31]), integer(path.name, head[31:43])
            for _ in range(count):
                line()
            at += length
            if length < 0 or at > len(data) or _MARK.fullmatch(line() or b"") is None:
                raise DamagedFile(f"{path.name}: dataset {binary[1]}b", f"{length} bytes declared", CUT_OFF)
            continue
        where = f"{path.name}: dataset {head.strip()[:12]}, number {seen}"
        number = integer(where, head)
        lines = []
        while True:
            body = line()
            if body is None:
                raise DamagedFile(where, "no end", CUT_OFF)
            if _MARK.fullmatch(body):
                break
            lines.append(body.decode("latin-1"))
        yield Dataset(number, tuple(lines), where)
    if seen == 0:
        raise DamagedFile(path.name, "no dataset", "this is no universal file: give one")


def node_places(dataset: Dataset) -> Positions:
    """Places of dataset 15 (one line a node) or 2411 (two, with all digits of a double)."""
    places: Positions = {}
    lines = 1 if dataset.number == 15 else 2
    if len(dataset.lines) % lines:
        raise DamagedFile(dataset.where, f"{len(dataset.lines)} lines", CUT_OFF)
    for i in range(0, len(dataset.lines), lines):
        (node,) = dataset.integers(i, 10)
        if dataset.number == 15:
            line = dataset.line(i)
            if len(line.rstrip()) <= 66:
                raise DamagedFile(dataset.where, f"a line of {len(line)} characters", CUT_OFF)
            x, y, z = (real(dataset.where, line[40 + 13 * k : 53 + 13 * k]) for k in range(3))
        else:
            x, y, z = dataset.reals(i + 1, 25, 3)
        if node < 1 or node in places:
            raise DamagedFile(dataset.where, f"node {node}", "give every node one place, numbers from 1")
        places[node] = (x, y, z)
    return places


def length_factor(dataset: Dataset) -> float:
    """Length units of the file per metre (dataset 164): 1 for metres, 1000 for millimetres."""
    return dataset.reals(1, 25, 1)[0]

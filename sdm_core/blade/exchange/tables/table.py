"""Tables an engineer writes in a spreadsheet: comma or semicolon, decimal point, ``#`` comments."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sdm_core.blade.exchange.parsing.file_bytes import file_text, whole_lines
from sdm_core.blade.exchange.parsing.fortran_fields import real
from sdm_core.errors import DamagedFile

_REMARK = re.compile(r"#\s*(\w+)\s*=\s*(.*)")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")


@dataclass(frozen=True)
class Table:
    """Cells of a table as text.

    Parameters
    ----------
    header
        Column names in lower case; empty when the first row is of numbers.
    rows
        Cells, blanks stripped, every row as long as the first.
    lines
        Line of each row in the file.
    remarks
        ``# key = value`` lines.
    """

    path: Path
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    remarks: dict[str, str] = field(default_factory=dict)

    def where(self, row: int, column: int) -> str:
        """Place of a cell for an error."""
        named = f"column {self.header[column]}" if self.header else f"column {column + 1}"
        return f"{self.path.name}: line {self.lines[row]}, {named}"

    def number(self, row: int, column: int) -> float:
        """One cell as a finite number."""
        cell = self.rows[row][column]
        if _DECIMAL_COMMA.fullmatch(cell):
            raise DamagedFile(self.where(row, column), cell, "write numbers with a decimal point")
        return real(self.where(row, column), cell)

    def column(self, name: str, *, blank: bool = False) -> np.ndarray:
        """A column as numbers, shape (rows,); NaN for empty cells where `blank` allows them."""
        j = self.header.index(name)
        return np.array(
            [np.nan if blank and not row[j] else self.number(i, j) for i, row in enumerate(self.rows)]
        )

    def whole(self, name: str) -> np.ndarray:
        """A column as whole numbers from 0, shape (rows,)."""
        j, values = self.header.index(name), self.column(name)
        bad = (values != np.floor(values)) | (values < 0) | (values > 2**53)
        if bad.any():
            i = int(np.argmax(bad))
            raise DamagedFile(self.where(i, j), self.rows[i][j], "give a whole number")
        return values.astype(np.int64)

    def numbers(self) -> np.ndarray:
        """All cells as numbers, shape (rows, columns)."""
        try:
            values = np.array(self.rows, dtype=float)
        except ValueError:
            values = np.full((1, 1), np.nan)
        if not np.isfinite(values).all():
            for i, row in enumerate(self.rows):
                for j in range(len(row)):
                    self.number(i, j)
        return values


def read_table(path: Path) -> Table:
    """A table of a CSV file.

    Raises
    ------
    DamagedFile
        For ragged rows, binary content, UTF-16, a file cut off or empty.
    """
    text = file_text(path, "a CSV table")
    whole_lines(path, text)
    remarks: dict[str, str] = {}
    kept: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), 1):
        # A spreadsheet may put a remark in quotes, and empty cells behind it.
        bare = line.strip().strip('"')
        if bare.startswith("#"):
            match = _REMARK.fullmatch(bare.replace('""', '"').rstrip(',;"' if "{" not in bare else ",;"))
            if match:
                remarks[match[1].lower()] = match[2].strip()
        elif line.strip(" \t,;"):
            kept.append((number, line))
    if not kept:
        raise DamagedFile(path.name, "no row", "the file is empty or cut off")
    first = kept[0][1]
    separator = ";" if ";" in first else "\t" if "\t" in first else ","
    try:
        cells = [
            tuple(cell.strip() for cell in row)
            for row in csv.reader((line for _, line in kept), delimiter=separator)
        ]
    except csv.Error as error:
        raise DamagedFile(path.name, str(error), "this is no CSV table: export it again") from None
    if len(cells) != len(kept):
        raise DamagedFile(path.name, "quotes that do not close", "the table is damaged: export it again")
    for (number, _), row in zip(kept, cells, strict=True):
        if len(row) != len(cells[0]):
            raise DamagedFile(
                f"{path.name}: line {number}",
                f"{len(row)} cells, {len(cells[0])} in the first row",
                "give every row as many cells; with decimal commas, write points",
            )
    numeric = all(_is_number(cell) for cell in cells[0])
    start = 0 if numeric else 1
    header = () if numeric else tuple(cell.lower() for cell in cells[0])
    if len(set(header)) != len(header):
        raise DamagedFile(f"{path.name}: header", ", ".join(header), "name every column once")
    lines = tuple(number for number, _ in kept)
    if len(cells) == start:
        raise DamagedFile(path.name, "a header only", "the file is cut off: export it again")
    return Table(path, header, tuple(cells[start:]), lines[start:], remarks)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def write_table(
    path: Path, header: Sequence[str], rows: Sequence[Sequence[object]], remarks: dict[str, str] | None = None
) -> None:
    """Write a table; floats with all their digits."""
    with path.open("w", encoding="utf-8", newline="") as file:
        for key, value in (remarks or {}).items():
            file.write(f"# {key} = {value}\n")
        out = csv.writer(file, lineterminator="\n")
        if header:
            out.writerow(header)
        out.writerows([repr(cell) if isinstance(cell, float) else cell for cell in row] for row in rows)

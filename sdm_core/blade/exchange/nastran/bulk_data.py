"""Entries of Nastran bulk data: small field, large field and free field, with their continuations.

Layout: Nastran Quick Reference Guide, "Bulk Data Entries".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sdm_core.errors import DamagedFile


@dataclass(frozen=True)
class Entry:
    """One bulk data entry.

    Parameters
    ----------
    kind
        Its name in capitals, without the star of the large field.
    fields
        Data fields, blanks stripped; whole lines of them, so that positions count.
    line
        Number of its first line in the file.
    """

    kind: str
    fields: tuple[str, ...]
    line: int

    def field(self, i: int) -> str:
        """Data field i from 0, empty where the entry is shorter."""
        return self.fields[i] if i < len(self.fields) else ""


def entries(path: Path, text: str) -> Iterator[Entry]:
    """All entries in order; what stands before ``BEGIN BULK`` is skipped, ``ENDDATA`` ends them.

    Raises
    ------
    DamagedFile
        For a continuation that continues nothing.
    """
    lines = text.splitlines()
    first = next((i + 1 for i, line in enumerate(lines) if line.upper().split()[:2] == ["BEGIN", "BULK"]), 0)
    kind, fields, start = "", [], 0
    for number, raw in enumerate(lines[first:], first + 1):
        line = raw.partition("$")[0].rstrip()
        if not line:
            continue
        name, data = _split(line)
        if name.strip("+*") == "" or name.startswith(("+", "*")):
            if not kind:
                raise DamagedFile(
                    f"{path.name}: line {number}", line[:40], "it continues no entry: the file is damaged"
                )
            fields += data
            continue
        if kind:
            yield Entry(kind, tuple(fields), start)
        kind, fields, start = name.rstrip("*").upper(), data, number
        if kind == "ENDDATA":
            return
    if kind:
        yield Entry(kind, tuple(fields), start)


def _split(line: str) -> tuple[str, list[str]]:
    if "," in line:
        name, *data = (part.strip() for part in line.split(","))
        count = 4 if "*" in name else 8
        # The tenth field of a line is a mark for the continuation, no data.
        return name, (data + [""] * count)[:count]
    line = line.expandtabs(8)
    name = line[:8].strip()
    width, count = (16, 4) if "*" in name else (8, 8)
    return name, [line[8 + i * width : 8 + (i + 1) * width].strip() for i in range(count)]


def field_text(value: float, width: int = 16) -> str:
    """A real number in `width` characters with as many digits as fit.

    Sixteen characters hold 14 digits of a magnitude from 1e-1 to 1e13 and at least 10 of any other:
    Nastran's exponent needs no letter, and none at all where the point stands among the digits.

    Examples
    --------
    >>> field_text(-123456789.0123456), field_text(1.2345678901234567e-5)
    ('-123456789.01235', '1.234567890123-5')
    """
    if value == 0.0:
        return "0.0"
    room = width - (value < 0)
    exponent = int(f"{value:.15E}".partition("E")[2])
    # Rounding may need one more digit before the point, or in the exponent.
    for digits in (room - 2, room - 3, room - 4):
        if 0 <= exponent <= room - 3:
            text = f"{value:.{digits - exponent}f}"
            text += "" if "." in text else "."  # without a point Nastran reads an integer
        elif -3 <= exponent < 0:
            text = f"{value:.{digits + 1}f}".replace("0.", ".", 1)
        else:
            decimals = digits - len(f"{exponent:+d}")
            mantissa, _, rounded = f"{value:.{decimals}E}".partition("E")
            text = f"{mantissa}{int(rounded):+d}"
        if len(text) <= width:
            return text
    raise AssertionError(f"{value!r} in {width} characters")

"""Numbers in the fixed fields that Fortran programs write."""

from __future__ import annotations

import re

import numpy as np

from sdm_core.errors import DamagedFile

# 1.5, -1.5E+03, 1.5D3, and Nastran's 1.5+3 without the letter; never NaN, Infinity or hexadecimal.
_REAL = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[EeDdQq]\s*([+-]?\d+)|([+-]\d+))?")


def real(where: str, text: str) -> float:
    """A real number as Fortran or Nastran writes it.

    Examples
    --------
    >>> real("x", " -1.25D+02"), real("x", "7.-3")
    (-125.0, 0.007)
    """
    match = _REAL.fullmatch(text.strip())
    if match is None:
        raise DamagedFile(where, text.strip(), "there should be a number: export the file again")
    mantissa, exponent, bare = match.groups()
    value = float(f"{mantissa}e{exponent or bare or 0}")
    if not np.isfinite(value):
        raise DamagedFile(where, text.strip(), "there should be a finite number: export the file again")
    return value


def integer(where: str, text: str) -> int:
    """A whole number in a field; blanks around it."""
    stripped = text.strip()
    if re.fullmatch(r"[+-]?\d{1,18}", stripped) is None:
        raise DamagedFile(where, stripped, "there should be a whole number: export the file again")
    return int(stripped)


def reals(where: str, text: str, width: int, count: int) -> np.ndarray:
    """`count` finite reals from fields of `width` characters without gaps.

    Raises
    ------
    DamagedFile
        For text that is too short, or a field that is no finite number.
    """
    text = text[: count * width]
    if len(text) < count * width:
        raise DamagedFile(where, f"{len(text) // width} of {count} numbers", "the file is cut off")
    if count == 0:
        return np.empty(0)
    raw = text.upper().replace("D", "E").encode("ascii", "replace")
    # What numpy takes for a number beyond these characters (NaN, infinity, 1_0) is none here.
    if not raw.translate(None, b"+-.0123456789E "):
        try:
            values = np.frombuffer(raw, dtype=f"S{width}").astype(float)
        except ValueError:
            values = np.full(1, np.nan)
        if np.isfinite(values).all():
            return values
    return np.array([real(where, text[i : i + width]) for i in range(0, len(text), width)])

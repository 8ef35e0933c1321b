"""Checks of numbers at construction, so that inner loops carry none."""

from __future__ import annotations

from typing import Any

import numpy as np

from sdm_core.errors import InvalidInput

# Beyond these no blade, rotor or liner exists, and squares of them still fit a double.
FREQUENCY_LIMITS_HZ = (1e-3, 1e7)
SPEED_LIMITS_HZ = (1e-6, 1e6)
KE_LIMIT = 1e15
AMPLITUDE_LIMIT = 1e6
WEIGHT_LIMIT = 1e6
LARGEST_DAMPING = 0.999_999


def number(field: str, value: Any, low: float, high: float, unit: str, *, open_low: bool = False) -> float:
    """`value` as a float within [low, high] (or (low, high]).

    Raises
    ------
    InvalidInput
        Naming the field, the value and the range.
    """
    remedy = (
        f"give a finite number {'above' if open_low else 'from'} {low:g} up to {high:g}{unit and ' ' + unit}"
    )
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.number):
        raise InvalidInput(field, value, remedy)
    try:
        x = float(value)
    except (OverflowError, TypeError):
        raise InvalidInput(field, value, remedy) from None
    if not np.isfinite(x) or x > high or x < low or (open_low and x <= low):
        raise InvalidInput(field, value, remedy)
    return x


def whole(field: str, value: Any, low: int, high: int) -> int:
    """`value` as an integer within [low, high].

    Raises
    ------
    InvalidInput
        Naming the field, the value and the range.
    """
    right = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not right or not low <= value <= high:
        raise InvalidInput(field, value, f"give a whole number from {low:,} to {high:,}")
    return int(value)


def vector(
    field: str, values: Any, low: float, high: float, unit: str, *, open_low: bool = False
) -> np.ndarray:
    """`values` as a one-dimensional, read-only float array of finite numbers within the limits."""
    if isinstance(values, str | bytes | dict) or not hasattr(values, "__len__"):
        raise InvalidInput(field, values, "give a list of numbers")
    if len(values) == 0:
        raise InvalidInput(field, "[]", "give at least one number")
    array = _plain_numbers(values)
    if array is not None and array.ndim == 1:
        bad = ~np.isfinite(array) | (array > high) | (array < low)
        if open_low:
            bad |= array <= low
        if bad.any():
            i = int(np.argmax(bad))
            number(f"{field}[{i}]", float(array[i]), low, high, unit, open_low=open_low)
        out = array.astype(float)
    else:
        out = np.array(
            [number(f"{field}[{i}]", v, low, high, unit, open_low=open_low) for i, v in enumerate(values)]
        )
    out.setflags(write=False)
    return out


def _plain_numbers(values: Any) -> np.ndarray | None:
    """Floats as an array, at once; None for what has to be looked at one by one, so that it is named."""
    if isinstance(values, np.ndarray):
        return values if values.dtype.kind == "f" else None
    if not isinstance(values, list | tuple) or not {int, float}.issuperset(map(type, values)):
        return None
    try:
        return np.array(values, dtype=float)
    except OverflowError:  # an integer beyond every double
        return None


def matrix(field: str, rows: Any, columns: int | None, low: float, high: float, unit: str) -> np.ndarray:
    """`rows` as a two-dimensional, read-only float array, every row of the same length."""
    if isinstance(rows, str | bytes | dict) or not hasattr(rows, "__len__"):
        raise InvalidInput(field, rows, "give a list of rows of numbers")
    if len(rows) == 0:
        raise InvalidInput(field, "[]", "give at least one row")
    parsed = [vector(f"{field}[{i}]", row, low, high, unit) for i, row in enumerate(rows)]
    width = len(parsed[0]) if columns is None else columns
    for i, row in enumerate(parsed):
        if len(row) != width:
            raise InvalidInput(f"{field}[{i}]", f"a row of {len(row)}", f"give {width} numbers in every row")
    out = np.array(parsed)
    out.setflags(write=False)
    return out


def speeds(field: str, values: Any) -> np.ndarray:
    """Rotor speeds in Hz: positive and finite."""
    return vector(field, values, *SPEED_LIMITS_HZ, "Hz")


def stiffnesses(field: str, values: Any) -> np.ndarray:
    """Specific force coefficients K_e in N/m: finite, zero allowed."""
    return vector(field, values, 0.0, KE_LIMIT, "N/m")

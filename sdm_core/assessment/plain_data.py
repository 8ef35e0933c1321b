"""Answers as JSON would have them: dataclasses by field, arrays as lists, what is not finite as null."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np


def plain(value: Any) -> Any:
    """`value` in dicts, lists, strings, finite numbers, booleans and None.

    Examples
    --------
    >>> plain({"ke": np.array([1.0, np.nan])})
    {'ke': [1.0, None]}
    """
    if isinstance(value, Enum):
        return str(value.value)
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, dict):
        return {str(key): plain(entry) for key, entry in value.items()}
    return [plain(entry) for entry in value]

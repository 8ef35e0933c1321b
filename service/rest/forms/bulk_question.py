"""A question of which the long arrays come in binary, and the rest as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sdm_core.errors import InvalidInput

QUESTION = "question"
COLUMNS = ("speed_hz", "ke")


def joined(question: Any, columns: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """The whole question: what the JSON says, and the columns as float arrays.

    Raises
    ------
    InvalidInput
        Where the JSON is no object, a column is none of `COLUMNS`, is given twice, or is not one row of
        real numbers.
    """
    if not isinstance(question, dict):
        raise InvalidInput(QUESTION, question, "give a JSON object: the question without its arrays")
    for name, column in columns.items():
        if name not in COLUMNS:
            raise InvalidInput(name, f"an array of {column.dtype}", f"the arrays are {', '.join(COLUMNS)}")
        if name in question:
            raise InvalidInput(name, "given twice", f"give it as an array or in {QUESTION}, not in both")
        if column.ndim != 1 or column.dtype.kind not in "iuf":
            found = f"{column.dtype} of shape {column.shape}"
            raise InvalidInput(name, found, "give one row of real numbers")
    return question | {name: column.astype(float) for name, column in columns.items()}

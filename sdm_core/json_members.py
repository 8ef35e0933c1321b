"""JSON text in which no object names a member twice."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from sdm_core.errors import InvalidInput

_LONGEST_NAME = 100  # characters, in an error


@dataclass(frozen=True)
class _Repeated:
    """Stands in the parsed value for an object that names this member twice."""

    name: str


def parse_json(text: str | bytes) -> Any:
    """The value of a JSON text, as `json.loads` reads it.

    The standard leaves open what a repeated name means (RFC 8259 section 4). `json.loads` takes the last and
    drops the others, so that a blade with two `damping_ratio` would be screened with the one further down.

    Raises
    ------
    InvalidInput
        Naming a member that is there twice, with its place in the value.
    ValueError, RecursionError
        As `json.loads`.

    Examples
    --------
    >>> parse_json('{"states": [{"speed_hz": 0, "speed_hz": 1}]}')
    Traceback (most recent call last):
        ...
    sdm_core.errors.InvalidInput: states[0].speed_hz = given twice: give it once: one would be dropped unseen
    """
    repeated = False

    def members(pairs: list[tuple[str, Any]]) -> Any:
        nonlocal repeated
        found = dict(pairs)
        if len(found) == len(pairs):
            return found
        repeated = True
        return _Repeated(_first_repeated([name for name, _ in pairs]))

    # Called once an object and never for an array, where the numbers of a blade are.
    data = json.loads(text, object_pairs_hook=members)
    if repeated:
        field = next(_places(data))
        raise InvalidInput(field, "given twice", "give it once: one would be dropped unseen")
    return data


def _first_repeated(names: list[str]) -> str:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            break
        seen.add(name)
    return name


def _places(data: Any) -> Iterator[str]:
    """Where members are repeated; without recursion, since a text may be nested deep."""
    waiting: list[tuple[str, Any]] = [("", data)]
    while waiting:
        place, value = waiting.pop()
        if isinstance(value, _Repeated):
            yield f"{place}.{value.name[:_LONGEST_NAME]}".removeprefix(".")
        elif isinstance(value, dict):
            inside = [(f"{place}.{name[:_LONGEST_NAME]}".removeprefix("."), v) for name, v in value.items()]
            waiting += reversed(inside)
        elif isinstance(value, list):
            inside = [
                (f"{place}[{i}]", v) for i, v in enumerate(value) if isinstance(v, dict | list | _Repeated)
            ]
            waiting += reversed(inside)

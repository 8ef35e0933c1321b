"""What may stand in a field of a pydantic model, in words: for refusals, and for the page of settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen
from pydantic.fields import FieldInfo

_KINDS: Mapping[Any, str] = {bool: "true or false", str: "text", Path: "a path", dict: "a JSON object"}
_OTHER = "what /docs shows for it"


def may_be(field: FieldInfo) -> str:
    """What a field takes, apart from null.

    Examples
    --------
    >>> from service.settings import Settings
    >>> may_be(Settings.model_fields["audit_share_of_time"]), may_be(Settings.model_fields["auth"])
    ('a number from 0 to 1', 'one of auto, on, off')
    """
    return _words(field.annotation, field.metadata)


def remedy_for(field: FieldInfo) -> str:
    """What to do about a value that a field does not take.

    pydantic's own words name types of Python and of its own, and never all that the field may be.
    """
    return f"give {may_be(field)}" if field.is_required() else f"give {may_be(field)}, or leave it out"


def nearest(name: str, known: Sequence[str]) -> str | None:
    """The known name that somebody may have meant."""
    return next(iter(get_close_matches(name, known, 1)), None)


def _words(kind: Any, metadata: Sequence[Any]) -> str:
    origin = get_origin(kind)
    if origin is Annotated:
        inner, *more = get_args(kind)
        return _words(inner, [*metadata, *more])
    if origin in (Union, UnionType):
        (inner,) = (one for one in get_args(kind) if one is not NoneType)
        return _words(inner, metadata)
    if origin is Literal:
        return f"one of {', '.join(get_args(kind))}"
    if kind in (int, float):
        return f"{'a whole number' if kind is int else 'a number'}{_range(metadata)}"
    longest = next((limit.max_length for limit in metadata if isinstance(limit, MaxLen)), None)
    return _KINDS.get(origin or kind, _OTHER) + (
        "" if longest is None else f" of at most {longest} characters"
    )


def _range(metadata: Sequence[Any]) -> str:
    low = next((f"{limit.ge}" for limit in metadata if isinstance(limit, Ge)), None)
    high = next((f"{limit.le}" for limit in metadata if isinstance(limit, Le)), None)
    above = next((f" above {limit.gt}" for limit in metadata if isinstance(limit, Gt)), "")
    below = next((f" below {limit.lt}" for limit in metadata if isinstance(limit, Lt)), "")
    if low is not None and high is not None:
        return f" from {low} to {high}"
    if low is not None:
        return f" from {low} up{below and f' to{below}'}"
    return above + below if high is None else f"{above} up to {high}"

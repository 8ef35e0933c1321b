"""Which form of an answer the client takes (RFC 9110, section 12.5.1)."""

from __future__ import annotations

from collections.abc import Sequence

from service.rest.errors import NotAcceptable


def best_form(accept: str | None, offered: Sequence[str]) -> str:
    """The media type among `offered` that `accept` likes best, the earlier one where it likes two alike.

    Raises
    ------
    NotAcceptable
        When it takes none of them.

    Examples
    --------
    >>> best_form("image/*;q=0.5, application/json;q=0.1", ["application/json", "image/png"])
    'image/png'
    """
    if accept is None or not accept.strip():
        return offered[0]
    ranges = [_media_range(part) for part in accept.split(",")]
    liking = [_quality(form, ranges) for form in offered]
    if max(liking) <= 0:
        raise NotAcceptable("Accept", accept, f"accept one of {', '.join(offered)}")
    return offered[liking.index(max(liking))]


def form_or_first(accept: str | None, offered: Sequence[str]) -> str:
    """As `best_form`, but the first where `accept` takes none.

    For paths that answered JSON whatever was accepted before they had other forms.

    Examples
    --------
    >>> form_or_first("text/html", ["application/json", "application/x-npz"])
    'application/json'
    """
    try:
        return best_form(accept, offered)
    except NotAcceptable:
        return offered[0]


def _media_range(text: str) -> tuple[str, float]:
    name, *parameters = (part.strip().lower() for part in text.split(";"))
    for parameter in parameters:
        if parameter.startswith("q="):
            try:
                return name, min(max(float(parameter[2:]), 0.0), 1.0)
            except ValueError:
                return name, 0.0
    return name, 1.0


def _quality(form: str, ranges: Sequence[tuple[str, float]]) -> float:
    """The quality of the narrowest range that covers `form`; 0 when none does."""
    for covering in (form, form.split("/")[0] + "/*", "*/*"):
        found = [quality for name, quality in ranges if name == covering]
        if found:
            return max(found)
    return 0.0

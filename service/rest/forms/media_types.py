"""Which form a body has, by its Content-Type."""

from __future__ import annotations

from service.rest.errors import UnsupportedForm

JSON, NPZ, BYTES, PNG = "application/json", "application/x-npz", "application/octet-stream", "image/png"
ARROW = "application/vnd.apache.arrow.stream"
BULK = (NPZ, ARROW)
# Nothing, or what tools send that were not told: curl the type of a web form, fetch() plain text.
_TAKEN_AS_JSON = {"", "text/json", "text/plain", "application/x-www-form-urlencoded", JSON}


def body_form(content_type: str | None, taken: tuple[str, ...]) -> str:
    """The media type among `taken` that a body is to be read as.

    Raises
    ------
    UnsupportedForm
        For any other.

    Examples
    --------
    >>> body_form("application/problem+json; charset=utf-8", (JSON,))
    'application/json'
    """
    name = (content_type or "").partition(";")[0].strip().lower()
    form = JSON if name in _TAKEN_AS_JSON or name.endswith("+json") else name
    if form not in taken:
        raise UnsupportedForm("Content-Type", content_type, f"send {' or '.join(taken)}")
    return form

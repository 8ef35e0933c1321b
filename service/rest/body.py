"""The body of a request: read up to a limit, and parsed as JSON."""

from __future__ import annotations

import json
from typing import Any

import anyio
from starlette.requests import Request

from sdm_core.errors import InvalidInput
from sdm_core.json_members import parse_json
from service.rest.limits import SlowBody
from service.settings import Settings
from service.sizes import TooLarge

# A blade is six containers deep; deeper than this no question is.
DEEPEST = 32


async def whole_body(request: Request, settings: Settings) -> bytes:
    """The body, refused as soon as it is known to be too long.

    Raises
    ------
    TooLarge
        When the length announced, or what has arrived so far, is over the limit.
    SlowBody
        When the body takes longer than `body_timeout_s`.
    """
    limit = settings.max_body_bytes
    announced = request.headers.get("content-length", "")
    if announced.isdecimal() and int(announced) > limit:
        raise _too_long(f"{announced} bytes", limit)
    body = bytearray()
    try:
        with anyio.fail_after(settings.body_timeout_s):
            async for chunk in request.stream():
                body += chunk
                if len(body) > limit:
                    raise _too_long(f"over {limit} bytes", limit)
    except TimeoutError:
        arrived = f"{len(body)} bytes in {settings.body_timeout_s:g} s"
        raise SlowBody("body", arrived, "send the body without pauses, or split the request") from None
    return bytes(body)


def parsed(body: bytes) -> Any:
    """The JSON value of a body.

    NaN, Infinity and numbers too large for a double come through as floats: the check of the
    field that holds one then names it, which a parser cannot.

    Raises
    ------
    InvalidInput
        When it is not one whole JSON value in UTF-8, names a member of an object twice, or is nested deeper
        than any question.

    Examples
    --------
    >>> parsed(b'{"ke": [1e3, NaN]}')
    {'ke': [1000.0, nan]}
    """
    try:
        text = body.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        found = f"byte {body[error.start]:#04x} at {error.start}"
        raise InvalidInput("body", found, "send JSON as UTF-8, not compressed") from None
    try:
        data = parse_json(text)
    except InvalidInput:
        raise
    except json.JSONDecodeError as error:
        raise _not_json(text, error) from None
    except RecursionError:
        raise _too_deep() from None
    except ValueError:  # only left: integers longer than Python converts
        raise InvalidInput("body", "an integer of thousands of digits", "give finite numbers") from None
    _check_depth(data)
    if "\\ud" in text.lower():
        _check_characters(data)
    return data


def _not_json(text: str, error: json.JSONDecodeError) -> InvalidInput:
    if not text.strip():
        return InvalidInput("body", "empty", "send a JSON object, such as the examples in /docs")
    where = f"line {error.lineno} column {error.colno}"
    if error.pos >= len(text.rstrip()):
        return InvalidInput("body", f"ends at {where}", "send the whole JSON object: it is cut off there")
    near = text[max(0, error.pos - 10) : error.pos + 20]
    return InvalidInput("body", repr(near), f"send one JSON object: {error.msg} at {where}")


def _check_depth(data: Any) -> None:
    level = [data] if isinstance(data, dict | list) else []
    for _ in range(DEEPEST):
        inside = (item.values() if isinstance(item, dict) else item for item in level)
        level = [child for children in inside for child in children if isinstance(child, dict | list)]
        if not level:
            return
    raise _too_deep()


def _check_characters(data: Any) -> None:
    try:
        json.dumps(data, ensure_ascii=False).encode()
    except UnicodeEncodeError as error:
        found = repr(error.object[error.start])
        raise InvalidInput("body", found, "leave out half surrogate pairs: they are not characters") from None


def _too_deep() -> InvalidInput:
    return InvalidInput(
        "body", f"nested deeper than {DEEPEST} levels", "send a flat object such as the examples in /docs"
    )


def _too_long(found: str, limit: int) -> TooLarge:
    return TooLarge("body", found, f"send at most {limit} bytes: split the request")

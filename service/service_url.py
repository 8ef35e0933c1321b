"""The address of a service, as somebody typed it."""

from __future__ import annotations

import re
from typing import Any
from urllib.parse import urlsplit

from sdm_core.errors import InvalidInput

_USER = re.compile(r"(?:(?<=//)|^)[^/@]*@")
_EXAMPLE = "http://127.0.0.1:8000"


def checked_service_url(url: Any, field: str = "base_url") -> str:
    """The address, without a slash at its end, where a service can be there.

    Parameters
    ----------
    field
        Where it was given, for errors.

    Raises
    ------
    InvalidInput
        Naming what is wrong; a password in it is not repeated.

    Examples
    --------
    >>> checked_service_url("http://rub.example:8000/")
    'http://rub.example:8000'
    >>> checked_service_url("rub.example:8000")
    Traceback (most recent call last):
        ...
    sdm_core.errors.InvalidInput: base_url = rub.example:8000: give http:// or https:// first: http://rub.example:8000
    """
    if not isinstance(url, str):
        raise InvalidInput(field, url, f"give the service's address as text, e.g. {_EXAMPLE}")
    text = url.strip()
    shown = _USER.sub("...@", text)
    if not text:
        raise InvalidInput(field, "empty", f"give the service's address, e.g. {_EXAMPLE}")
    if "://" not in text and _fault_of(f"http://{text}") is None:
        raise InvalidInput(field, shown, f"give http:// or https:// first: http://{shown}")
    if (fault := _fault_of(text)) is not None:
        raise InvalidInput(field, shown, f"{fault}: give http://HOST:PORT or https://HOST, e.g. {_EXAMPLE}")
    return text.rstrip("/")


def _fault_of(url: str) -> str | None:
    """What is wrong with a URL of a service; None where nothing is."""
    if not url.isprintable() or " " in url:
        return "no address has spaces or control characters in it"
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        return "ports are whole numbers from 1 to 65535, and an IPv6 address stands in [ ]"
    if parts.scheme not in ("http", "https"):
        return "a service speaks http or https"
    if not parts.hostname or port == 0:
        return "it names no host" if port != 0 else "there is no port 0"
    return "leave out what follows ? and #" if parts.query or parts.fragment else None

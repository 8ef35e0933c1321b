"""The service that only its own machine can reach, and so asks for no keys."""

from __future__ import annotations

import ipaddress
from functools import lru_cache
from urllib.parse import urlsplit

from starlette.datastructures import Headers

from service.rest.access import NotAllowed

_REMEDY = "ask from this machine, not through a web page or a proxy; or set RUBSCREEN_AUTH to on, or to off"


@lru_cache(maxsize=1024)
def is_loopback(host: str) -> bool:
    """Whether an address, or ``localhost``, leads to this machine alone.

    Examples
    --------
    >>> [is_loopback(host) for host in ("127.8.0.1", "::1", "localhost", "0.0.0.0", "::", "10.0.0.7", "x")]
    [True, True, True, False, False, False, False]
    """
    address = _address(host)
    return host == "localhost" if address is None else address.is_loopback


@lru_cache(maxsize=1024)
def from_elsewhere(host: str) -> bool:
    """Whether an address is one that other machines may reach; transports without addresses have none.

    Examples
    --------
    >>> [from_elsewhere(host) for host in ("127.0.0.1", "10.0.0.7", "testserver")]
    [False, True, False]
    """
    address = _address(host)
    return address is not None and not address.is_loopback


@lru_cache(maxsize=4096)
def network_of(host: str) -> str:
    """Whom to count an address as: with IPv6 one customer commonly has 2^64 addresses.

    Examples
    --------
    >>> network_of("192.0.2.7"), network_of("2001:db8::7")
    ('192.0.2.7', '2001:db8::/64')
    """
    address = _address(host)
    if isinstance(address, ipaddress.IPv6Address) and address.ipv4_mapped is None:
        return str(ipaddress.ip_network((address, 64), strict=False))
    return host


def check_not_lured(headers: Headers) -> None:
    """Refuse what a web page from elsewhere makes the browser of this machine send.

    A browser reaches the loopback for every page it shows. It tells whose page it is (`Origin`), unless the
    page's own name was made to lead to the loopback, which then stands in `Host`. Names without a dot are
    nobody's on the internet.

    Raises
    ------
    NotAllowed
        Naming the header.

    Examples
    --------
    >>> check_not_lured(Headers({"Host": "127.0.0.1:8000", "Origin": "http://127.0.0.1:8000"}))
    """
    host = headers.get("host", "")
    try:
        name = urlsplit(f"//{host}").hostname or ""
    except ValueError:
        name = host
    if "." in name and _address(name) is None and not name.endswith(".localhost"):
        raise NotAllowed("Host", host, _REMEDY)
    origin = headers.get("origin")
    if origin is not None and origin.partition("://")[2] != host:
        raise NotAllowed("Origin", origin, _REMEDY)


def _address(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return None
    mapped = getattr(address, "ipv4_mapped", None)
    return address if mapped is None else mapped

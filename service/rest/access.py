"""Who calls, and what a route asks of them: `READ`, `SUBMIT` and `ADMIN` stand on routers and routes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fastapi import Depends
from fastapi.routing import iter_route_contexts
from starlette.requests import Request
from starlette.routing import BaseRoute

from sdm_core.errors import InvalidInput
from service.roles import Role

# They tell nothing that is worth a key, and a probe has none.
HEALTH_PATHS = frozenset({"/healthz", "/readyz"})
DOCUMENT_PATHS = frozenset({"/docs", "/docs/oauth2-redirect", "/openapi.json"})
# Plain files that anybody may have: what the page shows, it asks for with the key of whoever looks.
PAGE_PATHS = frozenset({"/", "/page"})
_ASSETS = ("/docs/assets/", "/page/")

HOW_TO_SEND = "`Authorization: Bearer KEY` or `X-API-Key: KEY`"


class NotAuthenticated(InvalidInput):
    """Nobody knows who calls: no key came, or one of no use."""

    @property
    def headers(self) -> dict[str, str]:
        """How to say who one is (RFC 9110 section 11.6.1, RFC 6750 section 3)."""
        error = "" if self.value == MISSING else ', error="invalid_token"'
        return {"WWW-Authenticate": f'Bearer realm="rubscreen"{error}'}


class NotAllowed(InvalidInput):
    """Who calls is known, and may not do this."""


MISSING = "missing"


@dataclass(frozen=True)
class Caller:
    """Who calls.

    Attributes
    ----------
    key_id
        The public part of the key; None where the service asks for none.
    name
        As the key was given.
    role
        What the caller may do.
    max_active_jobs
        The key's own limit; None is the service's.
    """

    key_id: str | None
    name: str
    role: Role
    max_active_jobs: int | None = None


ANONYMOUS = Caller(None, "anonymous", Role.admin)


class Guard:
    """Lets a request pass whose caller has a role, or one above it.

    Raises
    ------
    NotAllowed
        When the caller's role is not enough.
    """

    def __init__(self, role: Role) -> None:
        self.role = role

    async def __call__(self, request: Request) -> None:
        caller = the_caller(request)
        if not caller.role.covers(self.role):
            found = f"{caller.role.value!r} of key {caller.key_id} ({caller.name})"
            raise NotAllowed("role", found, f"send a key with {needed(self.role)}")


READ = Depends(Guard(Role.read))
SUBMIT = Depends(Guard(Role.submit))
ADMIN = Depends(Guard(Role.admin))


def the_caller(request: Request) -> Caller:
    """Who sent the request, as the gate found out."""
    caller = request.state.caller
    assert isinstance(caller, Caller)
    return caller


def is_open(path: str) -> bool:
    """Whether a path needs no key: health, documentation, and the files of the chart page.

    Examples
    --------
    >>> is_open("/healthz"), is_open("/v1/models"), is_open("/docs/assets/../../v1/models")
    (True, False, False)
    """
    if path in HEALTH_PATHS or path in DOCUMENT_PATHS or path in PAGE_PATHS:
        return True
    return path.startswith(_ASSETS) and ".." not in path


def guarded_routes(routes: Sequence[BaseRoute]) -> list[tuple[Any, Role]]:
    """The routes of an application that ask for a role, each with the highest one it asks for.

    A route is as FastAPI tells of it: `path_format`, `path_regex`, `methods`.
    """
    found = []
    for route in iter_route_contexts(routes):
        dependant = getattr(route, "dependant", None)
        guards = [d.call for d in dependant.dependencies if isinstance(d.call, Guard)] if dependant else []
        if guards:
            found.append((route, max((guard.role for guard in guards), key=list(Role).index)))
    return found


def role_of(scope: Mapping[str, Any]) -> Role | None:
    """The role that the route of a request asks for; None where there is no such route."""
    for route, role in guarded_routes(scope["app"].routes):
        if scope["method"] in route.methods and route.path_regex.match(scope["path"]):
            return role
    return None


def needed(role: Role | None) -> str:
    """What a caller lacks, in words.

    Examples
    --------
    >>> needed(Role.submit), needed(Role.admin), needed(None)
    ('role submit or admin', 'role admin', 'any role')
    """
    if role is None:
        return "any role"
    return "role " + " or ".join(other.value for other in Role if other.covers(role))

"""Parameters of the query that a route does not have, or that come twice, are refused.

A filter that is passed over in silence shows everything as if it had fitted. Questions have no query, so
their routes do not ask for this; those of jobs, results and uploads do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fastapi import Depends
from fastapi.routing import iter_route_contexts
from starlette.requests import Request
from starlette.routing import BaseRoute

from sdm_core.errors import InvalidInput
from service.field_values import nearest

_LONGEST_NAME = 100  # characters, in a refusal


async def _check_query(request: Request) -> None:
    known = [parameter.alias for parameter in request.scope["route"].dependant.query_params]
    given = request.query_params
    for name in given:
        values = given.getlist(name)
        field = name[:_LONGEST_NAME] or "query"
        if name not in known:
            raise InvalidInput(field, values[0], _remedy(name, known))
        if len(values) > 1:
            raise InvalidInput(field, ", ".join(values), "give it once")


def _remedy(name: str, known: Sequence[str]) -> str:
    if not known:
        return "leave it out: there are no parameters here"
    meant = nearest(name, known)
    instead = "leave it out" if meant is None else f"leave it out, or give {meant}"
    return f"{instead}: the parameters are {', '.join(known)}"


KNOWN_QUERY = Depends(_check_query)
"""On a route or router: only the parameters that the route declares, each once."""


def routes_of_known_query(routes: Sequence[BaseRoute]) -> list[Any]:
    """The routes of an application under `KNOWN_QUERY`, as FastAPI tells of them."""
    return [
        route
        for route in iter_route_contexts(routes)
        if any(d.call is _check_query for d in getattr(getattr(route, "dependant", None), "dependencies", ()))
    ]

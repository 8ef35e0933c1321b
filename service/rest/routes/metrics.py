"""``GET /metrics``."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from service.operation.metrics import CONTENT_TYPE
from service.rest.access import READ
from service.rest.openapi import problems
from service.rest.routes.request import the_desk

router = APIRouter(tags=["health"], dependencies=[READ])


@router.get(
    "/metrics",
    response_class=Response,
    responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}, **problems(500)},
)
def metrics(request: Request) -> Response:  # not async: counting jobs asks the database
    """What Prometheus scrapes."""
    return Response(the_desk(request).metrics.exposition(), media_type=CONTENT_TYPE)

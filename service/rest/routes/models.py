"""``GET /v1/models``."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.requests import Request

from service.rest.access import READ
from service.rest.openapi import problems
from service.rest.routes.request import the_desk
from service.rest.schemas import Model, Models

router = APIRouter(prefix="/v1", tags=["models"], dependencies=[READ])


@router.get("/models", responses=problems(500))
def models(request: Request) -> Models:  # not async: it reads files
    """The surrogates there are, the one that answers first."""
    desk = the_desk(request)
    return Models(
        models=[Model(id=m.id, active=m.active, card=m.card, damage=m.damage) for m in desk.models()],
        loading=desk.model.loading,
        fault=desk.fault,
    )

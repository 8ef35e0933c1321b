"""``GET /healthz`` and ``/readyz``."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.requests import Request

from sdm_core.version import __version__
from service.rest.openapi import problems
from service.rest.routes.request import the_desk
from service.rest.schemas import Alive, Ready

router = APIRouter(tags=["health"])


@router.get("/healthz")
async def alive() -> Alive:
    """The process runs and its event loop turns."""
    return Alive(version=__version__)


@router.get("/readyz", responses=problems(500, 503))
async def ready(request: Request) -> Ready:
    """The model is loaded, and surrogate and exact core just gave a known answer."""
    desk = the_desk(request)
    answers = await desk.check()
    return Ready(model=answers.model, solver=answers.solver, loading=desk.model.loading, fault=desk.fault)

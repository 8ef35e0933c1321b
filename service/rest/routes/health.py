"""``GET /healthz`` and ``/readyz``."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.requests import Request

from sdm_core.version import __version__
from service.rest.openapi import problems
from service.rest.routes.request import the_desk
from service.rest.schemas import Alive, CheckReply, Ready

router = APIRouter(tags=["health"])


@router.get("/healthz")
async def alive() -> Alive:
    """The process runs and its event loop turns."""
    return Alive(version=__version__)


@router.get("/readyz", responses=problems(500, 503))
async def ready(request: Request) -> Ready:
    """Surrogate and exact core gave a known answer a second ago at most; database and disk are well."""
    desk, readiness = the_desk(request), request.state.readiness
    checks = {
        name: CheckReply(ok=found.ok, needed=found.needed, detail=found.detail)
        for name, found in (await readiness.checks()).items()
    }
    return Ready(
        model=desk.answering,
        solver=readiness.solver,
        loading=desk.model.loading,
        fault=desk.fault,
        checks=checks,
    )

"""``POST /v1/campbell``, ``/v1/lobes``, ``/v1/damping``: a blade over a range of rotor speeds, exactly."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from sdm_core.assessment.campbell import campbell_diagram
from sdm_core.assessment.mode_lobes import lobe_owners
from sdm_core.assessment.needed_damping import needed_damping
from sdm_core.assessment.unstable_speeds import unstable_speeds
from sdm_core.lobe_tips import least_critical_ke
from service.rest.access import READ
from service.rest.assessment_questions import (
    CAMPBELL_EXAMPLE,
    DAMPING_EXAMPLE,
    LOBES_EXAMPLE,
    MOST_LOBES,
    CampbellQuestion,
    DampingQuestion,
    LobesQuestion,
)
from service.rest.assessment_schemas import (
    CampbellReply,
    DampingReply,
    LobesReply,
    campbell_to_dict,
    damping_to_dict,
    lobes_to_dict,
)
from service.rest.body import parsed
from service.rest.forms.media_types import JSON
from service.rest.known_query import KNOWN_QUERY
from service.rest.openapi import problems, request_body
from service.rest.replies import to_json
from service.rest.routes.request import TheJson, the_desk

router = APIRouter(prefix="/v1", tags=["assessment"], dependencies=[READ, KNOWN_QUERY])


@router.post(
    "/campbell",
    response_model=CampbellReply,
    openapi_extra=request_body(CampbellQuestion, CAMPBELL_EXAMPLE),
    responses=problems(408, 413, 415, 422, 500, 503),
)
async def campbell(request: Request, body: TheJson) -> Response:
    """Natural frequencies over rotor speed, and the speeds at which engine orders meet them."""
    desk = the_desk(request)

    def answer() -> bytes:
        ask = CampbellQuestion.read(parsed(body), desk.settings)
        found = campbell_diagram(ask.blade, ask.speed_range_hz, engine_orders=ask.engine_orders)
        return to_json(campbell_to_dict(found))

    return Response(await desk.work.run(answer, request), media_type=JSON)


@router.post(
    "/lobes",
    response_model=LobesReply,
    openapi_extra=request_body(LobesQuestion, LOBES_EXAMPLE),
    responses=problems(408, 413, 415, 422, 500, 503),
)
async def deepest_lobes(request: Request, body: TheJson) -> Response:
    """Tips of the deepest lobes over a range of speeds, by the exact core, and the mode that owns each.

    Tips fall between the speeds of any grid: each is searched for. With arcs of contact a search takes
    seconds.
    """
    desk = the_desk(request)

    def answer() -> bytes:
        ask = LobesQuestion.read(parsed(body), desk.settings)
        # All of them where speeds are asked about: an unstable range may be as narrow as a lobe's tip.
        count = ask.count if ask.ke_liner is None else MOST_LOBES
        tips = least_critical_ke(ask.blade, ask.contact, *ask.speed_range_hz, ask.ke_max, count=count)
        unstable = None
        if ask.ke_liner is not None:
            deep = [tip.speed_hz for tip in tips if tip.ke <= ask.ke_liner]
            unstable = unstable_speeds(ask.blade, ask.contact, ask.speed_range_hz, ask.ke_liner, deep)
        owners = lobe_owners(ask.blade, ask.contact, tips[: ask.count], ask.ke_max)
        return to_json(lobes_to_dict(ask, owners, unstable))

    return Response(await desk.work.run(answer, request), media_type=JSON)


@router.post(
    "/damping",
    response_model=DampingReply,
    openapi_extra=request_body(DampingQuestion, DAMPING_EXAMPLE),
    responses=problems(408, 413, 415, 422, 500, 503),
)
async def damping_needed(request: Request, body: TheJson) -> Response:
    """The factor on every damping ratio with which no lobe of a range of speeds comes below `ke`."""
    desk = the_desk(request)

    def answer() -> bytes:
        ask = DampingQuestion.read(parsed(body), desk.settings)
        return to_json(damping_to_dict(needed_damping(ask.blade, ask.contact, ask.speed_range_hz, ask.ke)))

    return Response(await desk.work.run(answer, request), media_type=JSON)

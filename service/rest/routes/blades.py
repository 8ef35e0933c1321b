"""``POST /v1/blades``."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from service.rest import replies
from service.rest.access import READ
from service.rest.blade_question import BladeQuestion
from service.rest.blade_reply import built_reply, checked_reply
from service.rest.body import parsed
from service.rest.known_query import KNOWN_QUERY
from service.rest.openapi import problems, request_body
from service.rest.profile_schema import BLADES_EXAMPLE
from service.rest.routes.request import TheJson, the_desk
from service.rest.schemas import BladeReply

router = APIRouter(prefix="/v1", tags=["blades"], dependencies=[READ, KNOWN_QUERY])


@router.post(
    "/blades",
    response_model=BladeReply,
    openapi_extra=request_body(BladeQuestion, BLADES_EXAMPLE),
    responses=problems(408, 413, 415, 422, 500, 503),
)
async def make_blade(request: Request, body: TheJson) -> Response:
    """Build a blade file from a profile by finite elements, or check one made of modal data."""
    desk = the_desk(request)

    def answer() -> bytes:
        ask = BladeQuestion.read(parsed(body), desk.settings)
        if ask.shape is not None:
            return replies.to_json(built_reply(ask.shape, verify=ask.verify))
        assert ask.blade is not None
        return replies.to_json(checked_reply(ask.blade))

    return Response(await desk.work.run(answer, request), media_type="application/json")

"""``POST /v1/stability``, ``/v1/boundary``, ``/v1/sensitivities``, ``/v1/map``."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from service.answerer import Answerer
from service.rest import replies
from service.rest.access import READ
from service.rest.forms.media_types import ARROW, BULK, BYTES, JSON, NPZ, PNG
from service.rest.forms.npz_replies import points_to_npz, sensitivities_to_npz
from service.rest.known_query import KNOWN_QUERY
from service.rest.negotiation import best_form, form_or_first
from service.rest.openapi import problems, request_body
from service.rest.question_schemas import (
    BOUNDARY_EXAMPLE,
    MAP_EXAMPLE,
    POINTS_EXAMPLE,
    SENSITIVITIES_EXAMPLE,
)
from service.rest.questions import BoundaryQuestion, MapQuestion, PointsQuestion, SensitivitiesQuestion
from service.rest.routes.request import TheGrid, TheQuestion, the_desk
from service.rest.schemas import BoundaryReply, MapReply, PointsReply, SensitivitiesReply
from training.answers import MapAnswers, PointAnswers

POINTS_FORMS, SENSITIVITIES_FORMS = (JSON, *BULK), (JSON, NPZ)
MAP_FORMS = (JSON, NPZ, BYTES, PNG)
VARY = {"Vary": "Accept"}
_BINARY = {"schema": {"type": "string", "format": "binary"}}

router = APIRouter(prefix="/v1", tags=["stability"], dependencies=[READ, KNOWN_QUERY])


@router.post(
    "/stability",
    response_model=PointsReply,
    openapi_extra=request_body(PointsQuestion, POINTS_EXAMPLE, *BULK),
    responses={
        200: {"content": dict.fromkeys(BULK, _BINARY)},
        **problems(408, 413, 415, 422, 500, 503),
    },
)
async def is_it_stable(request: Request, body: TheQuestion) -> Response:
    """Is the blade stable at these points (speed, K_e)?

    For many points question and answer may be npz or an Arrow stream, by `Content-Type` and `Accept`.
    """
    desk = the_desk(request)
    form = form_or_first(request.headers.get("accept"), POINTS_FORMS)

    def answer() -> bytes:
        ask = PointsQuestion.read(body.parsed(desk.settings), desk.settings)
        answerer = desk.answerer(ask.policy)
        found = answerer.points(ask.blade, ask.contact, ask.speed_hz, ask.ke, ask.policy, ask.alpha)
        return _points(found, form)

    return Response(await desk.work.run(answer, request), media_type=form, headers=VARY)


@router.post(
    "/boundary",
    response_model=BoundaryReply,
    openapi_extra=request_body(BoundaryQuestion, BOUNDARY_EXAMPLE, *BULK),
    responses=problems(408, 413, 415, 422, 500, 503),
)
async def where_is_the_boundary(request: Request, body: TheQuestion) -> Response:
    """From which K_e on is the blade unstable at these speeds?"""
    desk = the_desk(request)

    def answer() -> bytes:
        ask = BoundaryQuestion.read(body.parsed(desk.settings), desk.settings)
        answerer = desk.answerer(ask.policy)
        found = answerer.boundary(ask.blade, ask.contact, ask.speed_hz, ask.ke_max, ask.policy, ask.alpha)
        return replies.to_json(replies.boundary_to_dict(found))

    return Response(await desk.work.run(answer, request), media_type=JSON)


@router.post(
    "/sensitivities",
    response_model=SensitivitiesReply,
    openapi_extra=request_body(SensitivitiesQuestion, SENSITIVITIES_EXAMPLE, *BULK),
    responses={200: {"content": {NPZ: _BINARY}}, **problems(408, 413, 415, 422, 500, 503)},
)
async def what_moves_the_boundary(request: Request, body: TheQuestion) -> Response:
    """By how much do frequencies, damping, amplitudes, weights, speed and arcs move the boundary?

    By `Accept` as JSON or npz.
    """
    desk = the_desk(request)
    form = form_or_first(request.headers.get("accept"), SENSITIVITIES_FORMS)

    def answer() -> bytes:
        ask = SensitivitiesQuestion.read(body.parsed(desk.settings), desk.settings)
        answerer = desk.answerer(ask.policy)
        found = answerer.sensitivities(
            ask.blade, ask.contact, ask.speed_hz, ask.ke_max, ask.policy, ask.alpha
        )
        if form == NPZ:
            return sensitivities_to_npz(found)
        return replies.to_json(replies.sensitivities_to_dict(found))

    return Response(await desk.work.run(answer, request), media_type=form, headers=VARY)


@router.post(
    "/map",
    response_model=MapReply,
    openapi_extra=request_body(MapQuestion, MAP_EXAMPLE, NPZ),
    responses={
        200: {"content": {NPZ: _BINARY, BYTES: _BINARY, PNG: _BINARY}},
        **problems(406, 408, 413, 415, 422, 500, 503),
    },
)
async def map_of_stability(request: Request, body: TheGrid) -> Response:
    """Where in the plane of speed and K_e is the blade stable?

    By `Accept`: JSON, the arrays as npz (numpy; no pickle), or a chart as PNG.
    """
    desk = the_desk(request)
    form = best_form(request.headers.get("accept"), MAP_FORMS)

    def answer() -> bytes:
        ask = MapQuestion.read(body.parsed(desk.settings), desk.settings)
        if form == PNG:
            ask.check_chartable()
        answerer = desk.answerer(ask.policy)
        found = answerer.map(ask.blade, ask.contact, ask.speed_hz, ask.ke, ask.policy, ask.alpha)
        if form == JSON:
            return replies.to_json(replies.map_to_dict(found, ask.fields))
        if form == PNG:
            return _chart(answerer, ask, found)
        return replies.map_to_npz(found, ask.fields)

    return Response(await desk.work.run(answer, request), media_type=form, headers=VARY)


def _points(found: PointAnswers, form: str) -> bytes:
    if form == NPZ:
        return points_to_npz(found)
    if form == ARROW:
        # Here, not above: a service that is never asked for Arrow need not load it.
        from service.rest.forms.arrow_replies import points_to_arrow

        return points_to_arrow(found)
    return replies.to_json(replies.points_to_dict(found))


def _chart(answerer: Answerer, ask: MapQuestion, found: MapAnswers) -> bytes:
    # Here, not above: only charts need matplotlib, and it takes a second to load.
    from service.screening.charts import map_png

    boundary = None
    if ask.contact.permanent:  # with arcs a boundary costs more than the map
        ke_max = float(ask.ke[-1])
        boundary = answerer.boundary(ask.blade, ask.contact, ask.speed_hz, ke_max, ask.policy, ask.alpha)
    return map_png(ask.blade, ask.contact, found, boundary)

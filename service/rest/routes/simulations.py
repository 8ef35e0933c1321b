"""``/v1/simulations``: blades that rub their liner in time, as durable jobs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

from fastapi import APIRouter, Header, Query
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from sdm_core.errors import InvalidInput
from service.jobs.errors import NotSimulated
from service.jobs.job import SIMULATION, Job
from service.jobs.simulation.chunk import chunks_of
from service.jobs.simulation.results import outcome_of
from service.rest import replies
from service.rest.accepting import accept_simulation, checked_idempotency_key, simulation_job
from service.rest.access import READ, SUBMIT, the_caller
from service.rest.body import parsed
from service.rest.forms.media_types import JSON, NPZ, PNG
from service.rest.job_schemas import JobReply, JobsReply
from service.rest.known_query import KNOWN_QUERY
from service.rest.negotiation import best_form
from service.rest.openapi import problems, request_body
from service.rest.routes.jobs import (
    cancelled,
    job_response,
    jobs_page,
    progress_events,
    retried,
    the_jobs,
)
from service.rest.routes.request import TheJson, the_desk
from service.rest.simulation_question import SIMULATION_EXAMPLE, SimulationQuestion
from service.rest.simulation_schemas import SimulationReply
from service.simulation.outcome import SimulationOutcome

_BINARY = {"schema": {"type": "string", "format": "binary"}}
_VARY = {"Vary": "Accept"}

router = APIRouter(prefix="/v1/simulations", tags=["simulations"], dependencies=[KNOWN_QUERY])


@router.post(
    "",
    status_code=202,
    response_model=JobReply,
    openapi_extra=request_body(SimulationQuestion, SIMULATION_EXAMPLE),
    responses=problems(408, 409, 413, 415, 422, 500, 503, 507),
    dependencies=[SUBMIT],
)
async def simulate(
    request: Request, body: TheJson, idempotency_key: Annotated[str | None, Header()] = None
) -> Response:
    """Integrate a blade's rub of its abradable liner in time, at one rotor speed or at many, as a job.

    Answered 202 once the job is on the disk: it is then run to its end, whatever becomes of this process.
    With an `Idempotency-Key` the same request sent twice is one job.
    """
    desk, service, caller = the_jobs(request), the_desk(request), the_caller(request)

    def accept() -> tuple[Job, bool]:
        key = checked_idempotency_key(idempotency_key)
        ask = SimulationQuestion.read(parsed(body), service.settings)
        job = simulation_job(ask, caller, body, key)
        records = desk.jobs.records
        before = records.of_request(job)
        if before is not None:
            return before, False
        active = 0 if caller.key_id is None else records.active(caller.key_id)
        service.access.quota.check_job_quota(caller, active, records.active())
        return accept_simulation(ask.order, job, desk.jobs)

    job, _ = await service.work.run(accept, request)
    return job_response(job, 202)


@router.get("", response_model=JobsReply, responses=problems(404, 422, 500, 503), dependencies=[READ])
def list_simulations(
    request: Request, limit: str | None = None, after: str | None = None, state: str | None = None
) -> Response:
    """Simulations, newest first."""
    return jobs_page(request, SIMULATION, limit, after, state)


@router.get("/{job_id}", response_model=JobReply, responses=problems(404, 500, 503), dependencies=[READ])
def see_simulation(request: Request, job_id: str) -> Response:
    """A simulation: its state and how far it is."""
    return job_response(the_jobs(request).jobs.get(job_id, SIMULATION))


@router.delete("/{job_id}", response_model=JobReply, responses=problems(404, 500, 503), dependencies=[SUBMIT])
def cancel_simulation(request: Request, job_id: str) -> Response:
    """Cancel a simulation; speeds that are there stay. One that is over stays as it is."""
    return cancelled(request, job_id, SIMULATION)


@router.post(
    "/{job_id}/retry",
    status_code=202,
    response_model=JobReply,
    responses=problems(404, 409, 500, 503),
    dependencies=[SUBMIT],
)
def retry_simulation(request: Request, job_id: str) -> Response:
    """Run a simulation that is over once more: speeds that are stored and whole are not simulated again."""
    return retried(request, job_id, SIMULATION)


@router.get(
    "/{job_id}/events",
    response_class=StreamingResponse,
    responses={200: {"content": {"text/event-stream": {}}}, **problems(404, 500, 503)},
    dependencies=[READ],
)
def simulation_events(request: Request, job_id: str) -> StreamingResponse:
    """Progress as server-sent events: `progress` at a change; `done`, `failed` or `cancelled` at the end."""
    desk = the_jobs(request)
    return progress_events(request, desk, desk.jobs.get(job_id, SIMULATION))


@router.get(
    "/{job_id}/results",
    response_model=SimulationReply,
    responses={200: {"content": {NPZ: _BINARY}}, **problems(404, 406, 422, 500, 503)},
    dependencies=[READ],
)
async def simulation_results(request: Request, job_id: str) -> Response:
    """Figures by speed as JSON, every array as npz; of the speeds there are while the job runs."""
    desk, service = the_jobs(request), the_desk(request)

    def make() -> Response:
        job = desk.jobs.get(job_id, SIMULATION)
        form = best_form(request.headers.get("accept"), (JSON, NPZ))
        folder = desk.jobs.folders.of(job.id)
        outcome = outcome_of(folder)
        if form == NPZ:
            name = {"Content-Disposition": f'attachment; filename="simulation-{job.id[:8]}.npz"'}
            return Response(outcome.to_npz(), media_type=NPZ, headers=_VARY | name)
        speeds = sum(len(part) for _, part in chunks_of(folder.request()))
        complete = job.state.finished and len(outcome.speeds.speed_hz) == speeds
        document = {"job": job.id, "complete": complete, **outcome.to_dict()}
        return Response(replies.to_json(document), media_type=JSON, headers=_VARY)

    return await service.work.run(make, request)


@router.get(
    "/{job_id}/wear_map.png",
    response_class=Response,
    responses={200: {"content": {PNG: _BINARY}}, **problems(404, 422, 500, 503)},
    dependencies=[READ],
)
async def simulation_wear_map(
    request: Request,
    job_id: str,
    node: Annotated[str | None, Query(description="A contact node; the first where left out.")] = None,
) -> Response:
    """Worn depth over speed and angle under one contact node, of a simulation at many speeds."""

    def draw(outcome: SimulationOutcome) -> bytes:
        from service.simulation.wear_map_chart import wear_map_png

        if node is not None and node not in outcome.order.nodes:
            raise InvalidInput("node", node, f"give a contact node: {', '.join(outcome.order.nodes)}")
        return wear_map_png(outcome, node)

    return await _picture(request, job_id, draw, of_one=False)


@router.get(
    "/{job_id}/spectrum.png",
    response_class=Response,
    responses={200: {"content": {PNG: _BINARY}}, **problems(404, 422, 500, 503)},
    dependencies=[READ],
)
async def simulation_spectrum(request: Request, job_id: str) -> Response:
    """Tip vibration over speed and frequency on Campbell's diagram, of a simulation at many speeds."""

    def draw(outcome: SimulationOutcome) -> bytes:
        from service.simulation.spectrum_map_chart import spectrum_map_png

        return spectrum_map_png(outcome)

    return await _picture(request, job_id, draw, of_one=False)


@router.get(
    "/{job_id}/response.png",
    response_class=Response,
    responses={200: {"content": {PNG: _BINARY}}, **problems(404, 422, 500, 503)},
    dependencies=[READ],
)
async def simulation_response(request: Request, job_id: str) -> Response:
    """Displacement, contact force and energy over the revolutions, of a simulation at one speed."""

    def draw(outcome: SimulationOutcome) -> bytes:
        from service.simulation.response_chart import response_png

        return response_png(outcome)

    return await _picture(request, job_id, draw, of_one=True)


@router.get(
    "/{job_id}/worn_profile.png",
    response_class=Response,
    responses={200: {"content": {PNG: _BINARY}}, **problems(404, 422, 500, 503)},
    dependencies=[READ],
)
async def simulation_worn_profile(request: Request, job_id: str) -> Response:
    """What is left of the liner round the casing, of a simulation at one speed."""

    def draw(outcome: SimulationOutcome) -> bytes:
        from service.simulation.worn_profile_chart import worn_profile_png

        return worn_profile_png(outcome)

    return await _picture(request, job_id, draw, of_one=True)


async def _picture(
    request: Request, job_id: str, draw: Callable[[SimulationOutcome], bytes], *, of_one: bool
) -> Response:
    desk, service = the_jobs(request), the_desk(request)

    def make() -> bytes:
        job = desk.jobs.get(job_id, SIMULATION)
        outcome = outcome_of(desk.jobs.folders.of(job.id))
        if outcome.order.single != of_one:
            many = f"{job.id}, of {len(outcome.order.speed_hz)} speeds"
            there = "response.png and worn_profile.png" if not of_one else "wear_map.png and spectrum.png"
            raise NotSimulated("id", many, f"ask for {there}")
        return draw(outcome)

    return Response(await service.work.run(make, request), media_type=PNG)

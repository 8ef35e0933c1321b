"""``/v1/trainings``: retraining as durable jobs, asked for or by the calendar."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Annotated, Any

from fastapi import APIRouter, Header
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from sdm_core.errors import InvalidInput
from service.jobs.errors import NotTrained
from service.jobs.job import TRAINING, Job
from service.jobs.training.process import RESULT
from service.rest import replies
from service.rest.accepting import accept_training, checked_idempotency_key, new_job, seed_of
from service.rest.access import ADMIN, READ, the_caller
from service.rest.body import parsed
from service.rest.forms.media_types import JSON
from service.rest.job_schemas import JobReply, JobsReply, ScheduleReply, TrainedReply
from service.rest.known_query import KNOWN_QUERY
from service.rest.openapi import problems, request_body
from service.rest.routes.jobs import cancelled, job_response, jobs_page, progress_events, retried, the_jobs
from service.rest.routes.request import TheJson, the_desk
from service.rest.training_question import (
    SCHEDULE_EXAMPLE,
    TRAINING_EXAMPLE,
    ScheduleQuestion,
    TrainingQuestion,
)

router = APIRouter(prefix="/v1/trainings", tags=["models"], dependencies=[KNOWN_QUERY])


@router.post(
    "",
    status_code=202,
    response_model=JobReply,
    openapi_extra=request_body(TrainingQuestion, TRAINING_EXAMPLE),
    responses=problems(408, 409, 413, 415, 422, 500, 503, 507),
    dependencies=[ADMIN],
)
async def retrain(
    request: Request, body: TheJson, idempotency_key: Annotated[str | None, Header()] = None
) -> Response:
    """Train a new model, as a job; it becomes the active one unless the promotion gate refuses it."""
    desk, service = the_jobs(request), the_desk(request)
    caller = the_caller(request)

    def accept() -> tuple[Job, bool]:
        key = checked_idempotency_key(idempotency_key)
        ask = TrainingQuestion.read(parsed(body), service.settings)
        _check_served(request, ask)
        job = new_job(TRAINING, caller, body, key, name=ask.name, priority=ask.priority)
        before = desk.jobs.records.of_request(job)
        if before is not None:
            return before, False
        records = desk.jobs.records
        active = 0 if caller.key_id is None else records.active(caller.key_id)
        service.access.quota.check_job_quota(caller, active, records.active())
        return accept_training(ask.request(seed_of(job)), job, desk.jobs)

    job, _ = await service.work.run(accept, request)
    return job_response(job, 202)


@router.get("", response_model=JobsReply, responses=problems(404, 422, 500, 503), dependencies=[READ])
def list_trainings(
    request: Request, limit: str | None = None, after: str | None = None, state: str | None = None
) -> Response:
    """Trainings, newest first."""
    return jobs_page(request, TRAINING, limit, after, state)


@router.put(
    "/schedule",
    response_model=ScheduleReply,
    openapi_extra=request_body(ScheduleQuestion, SCHEDULE_EXAMPLE),
    responses=problems(408, 413, 415, 422, 500, 503),
    dependencies=[ADMIN],
)
async def schedule_trainings(request: Request, body: TheJson) -> Response:
    """Train again and again, by the calendar. A time missed while no service ran is made up for."""
    desk, service, caller = the_jobs(request), the_desk(request), the_caller(request)

    def put() -> Response:
        ask = ScheduleQuestion.read(parsed(body), service.settings)
        try:
            training = TrainingQuestion.read(ask.training, service.settings)
        except InvalidInput as error:
            raise error.under("training") from None
        _check_served(request, training)
        asked = replace(training.request(0), seed=training.seed or 0).to_dict()
        owner = {"owner": caller.key_id, "owner_name": None if caller.key_id is None else caller.name}
        desk.jobs.calendar.schedule(ask.cron, ask.timezone, {"training": asked, **owner})
        return _schedule(request)

    return await service.work.run(put, request)


@router.get("/schedule", response_model=ScheduleReply, responses=problems(500, 503), dependencies=[READ])
def see_schedule(request: Request) -> Response:
    """When trainings are next."""
    return _schedule(request)


@router.delete("/schedule", response_model=ScheduleReply, responses=problems(500, 503), dependencies=[ADMIN])
def drop_schedule(request: Request) -> Response:
    """Train by the calendar no longer."""
    the_jobs(request).jobs.calendar.unschedule()
    return _schedule(request)


@router.get("/{job_id}", response_model=JobReply, responses=problems(404, 500, 503), dependencies=[READ])
def see_training(request: Request, job_id: str) -> Response:
    """A training: its state and how far it is."""
    return job_response(the_jobs(request).jobs.get(job_id, TRAINING))


@router.get(
    "/{job_id}/result", response_model=TrainedReply, responses=problems(404, 500, 503), dependencies=[READ]
)
def training_result(request: Request, job_id: str) -> Response:
    """The model that came of it, whether it was promoted, and its figures."""
    jobs = the_jobs(request).jobs
    job = jobs.get(job_id, TRAINING)
    try:
        found: dict[str, Any] = json.loads((jobs.folders.of(job.id).path / RESULT).read_bytes())
    except (OSError, ValueError):
        raise NotTrained("id", f"{job.id}, {job.state.value}", "wait until it is done") from None
    return Response(replies.to_json(found), media_type=JSON)


@router.delete("/{job_id}", response_model=JobReply, responses=problems(404, 500, 503), dependencies=[ADMIN])
def cancel_training(request: Request, job_id: str) -> Response:
    """Cancel a training; labels that are there stay. One that is over stays as it is."""
    return cancelled(request, job_id, TRAINING)


@router.post(
    "/{job_id}/retry",
    status_code=202,
    response_model=JobReply,
    responses=problems(404, 409, 500, 503),
    dependencies=[ADMIN],
)
def retry_training(request: Request, job_id: str) -> Response:
    """Run a training that is over once more, from the labels that are there."""
    return retried(request, job_id, TRAINING)


@router.get(
    "/{job_id}/events",
    response_class=StreamingResponse,
    responses={200: {"content": {"text/event-stream": {}}}, **problems(404, 500, 503)},
    dependencies=[READ],
)
def training_events(request: Request, job_id: str) -> StreamingResponse:
    """Progress as server-sent events: `progress` at a change; `done`, `failed` or `cancelled` at the end."""
    desk = the_jobs(request)
    return progress_events(request, desk, desk.jobs.get(job_id, TRAINING))


def _check_served(request: Request, ask: TrainingQuestion) -> None:
    if ask.with_served and the_desk(request).settings.served_answers_folder is None:
        raise InvalidInput("with_served", "true", "start the service with --keep-answers FOLDER")


def _schedule(request: Request) -> Response:
    found = the_jobs(request).jobs.calendar.scheduled()
    document = {
        "cron": None if found is None else found.cron,
        "timezone": None if found is None else found.timezone,
        "next": None if found is None else found.coming.isoformat(),
        "training": None if found is None else found.context["training"],
    }
    return Response(replies.to_json(document), media_type=JSON)

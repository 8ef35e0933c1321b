"""``/v1/screenings``: batches of blades as durable jobs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from typing import Annotated
from urllib.parse import urlencode

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from fastapi import APIRouter, Header, Query
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from sdm_core.blade import blade_to_dict
from sdm_core.errors import InvalidInput
from service.jobs.job import SCREENING, Job
from service.jobs.screening import pictures
from service.jobs.screening.chunk_content import ScreenedBlade
from service.jobs.screening.rankings import Ranking
from service.jobs.screening.results import SCHEMA, to_csv, to_parquet, to_rows
from service.rest import replies
from service.rest.accepting import (
    accept_screening,
    checked_idempotency_key,
    screening_job,
)
from service.rest.access import READ, SUBMIT, the_caller
from service.rest.body import parsed
from service.rest.forms.media_types import JSON
from service.rest.job_schemas import JobReply, JobsReply, ResultsReply
from service.rest.known_query import KNOWN_QUERY
from service.rest.negotiation import best_form
from service.rest.openapi import problems, request_body
from service.rest.routes.jobs import (
    cancelled,
    checked_limit,
    job_response,
    jobs_page,
    progress_events,
    retried,
    the_jobs,
)
from service.rest.routes.request import TheJson, the_desk
from service.rest.screening_question import SCREENING_EXAMPLE, ScreeningQuestion
from service.screening.screen import USUAL_CONTACTS, VERDICTS

CSV, PARQUET, HTML, PNG = "text/csv", "application/vnd.apache.parquet", "text/html", "image/png"
MOST_ROWS = 1000
_BINARY = {"schema": {"type": "string", "format": "binary"}}
_VARY = {"Vary": "Accept"}

router = APIRouter(prefix="/v1/screenings", tags=["screenings"], dependencies=[KNOWN_QUERY])


@router.post(
    "",
    status_code=202,
    response_model=JobReply,
    openapi_extra=request_body(ScreeningQuestion, SCREENING_EXAMPLE),
    responses=problems(404, 408, 409, 413, 415, 422, 500, 503, 507),
    dependencies=[SUBMIT],
)
async def screen_a_batch(
    request: Request, body: TheJson, idempotency_key: Annotated[str | None, Header()] = None
) -> Response:
    """Screen many blades under many contacts, as a job.

    Answered 202 once the job is on the disk: it is then run to its end, whatever becomes of this process.
    With an `Idempotency-Key` the same request sent twice is one job.
    """
    desk, service = the_jobs(request), the_desk(request)
    caller = the_caller(request)

    def accept() -> tuple[Job, bool]:
        key = checked_idempotency_key(idempotency_key)
        ask = ScreeningQuestion.read(parsed(body), service.settings)
        job = screening_job(ask, caller, body, key)
        before = desk.jobs.records.of_request(job)
        if before is not None:
            return before, False
        records = desk.jobs.records
        active = 0 if caller.key_id is None else records.active(caller.key_id)
        service.access.quota.check_job_quota(caller, active, records.active())
        model = service.model_for_jobs(ask.policy)
        service.check_alpha(ask.policy, ask.alpha)
        return accept_screening(ask, job, desk.jobs, desk.uploads, service.settings, model)

    job, _ = await service.work.run(accept, request)
    return job_response(job, 202)


@router.get("", response_model=JobsReply, responses=problems(404, 422, 500, 503), dependencies=[READ])
def list_screenings(
    request: Request,
    limit: str | None = None,
    after: str | None = None,
    state: str | None = None,
) -> Response:
    """Screenings, newest first."""
    return jobs_page(request, SCREENING, limit, after, state)


@router.get("/{job_id}", response_model=JobReply, responses=problems(404, 500, 503), dependencies=[READ])
def see_screening(request: Request, job_id: str) -> Response:
    """A screening: its state and how far it is."""
    return job_response(the_jobs(request).jobs.get(job_id, SCREENING))


@router.delete("/{job_id}", response_model=JobReply, responses=problems(404, 500, 503), dependencies=[SUBMIT])
def cancel_screening(request: Request, job_id: str) -> Response:
    """Cancel a screening; results that are there stay. One that is over stays as it is."""
    return cancelled(request, job_id, SCREENING)


@router.post(
    "/{job_id}/retry",
    status_code=202,
    response_model=JobReply,
    responses=problems(404, 409, 500, 503),
    dependencies=[SUBMIT],
)
def retry_screening(request: Request, job_id: str) -> Response:
    """Run a screening that is over once more: what is stored and whole is not computed again."""
    return retried(request, job_id, SCREENING)


@router.get(
    "/{job_id}/events",
    response_class=StreamingResponse,
    responses={200: {"content": {"text/event-stream": {}}}, **problems(404, 500, 503)},
    dependencies=[READ],
)
def screening_events(request: Request, job_id: str) -> StreamingResponse:
    """Progress as server-sent events: `progress` at a change; `done`, `failed` or `cancelled` at the end."""
    desk = the_jobs(request)
    return progress_events(request, desk, desk.jobs.get(job_id, SCREENING))


@router.get(
    "/{job_id}/results",
    response_model=ResultsReply,
    responses={
        200: {"content": {CSV: {"schema": {"type": "string"}}, PARQUET: _BINARY}},
        **problems(404, 406, 422, 500, 503),
    },
    dependencies=[READ],
)
async def screening_results(
    request: Request,
    job_id: str,
    offset: str | None = None,
    limit: str | None = None,
    contact: Annotated[str | None, Query(description="A contact of the job, by its name.")] = None,
    verdict: Annotated[str | None, Query(description=f"One of: {', '.join(VERDICTS)}.")] = None,
    meets_criteria: Annotated[str | None, Query(description="true or false.")] = None,
) -> Response:
    """The ranking, safest first: JSON by pages, CSV or Parquet whole; of what is there while the job runs."""
    desk, service = the_jobs(request), the_desk(request)

    def make() -> Response:
        job = desk.jobs.get(job_id, SCREENING)
        form = best_form(request.headers.get("accept"), (JSON, CSV, PARQUET))
        many = checked_limit(limit, MOST_ROWS, 100)
        first = checked_limit(offset, 10**8, 0, "offset", least=0)
        folder = desk.jobs.folders.of(job.id)
        ranking, contacts = desk.rankings.of(folder), folder.request()["contacts"]
        asked = {"contact": contact, "verdict": verdict, "meets_criteria": meets_criteria}
        if form != JSON:
            table = _filtered(ranking.columns(SCHEMA.names), asked, contacts)
            content = to_csv(table) if form == CSV else to_parquet(table, ranking.unscreened)
            suffix = "csv" if form == CSV else "parquet"
            name = {"Content-Disposition": f'attachment; filename="screening-{job.id[:8]}.{suffix}"'}
            return Response(content, media_type=form, headers=_VARY | name)
        places, following = _places(ranking, asked, contacts), None
        if first + many < len(places):
            query = {k: v for k, v in asked.items() if v is not None}
            query |= {"offset": str(first + many), "limit": str(many)}
            following = f"/v1/screenings/{job.id}/results?{urlencode(query)}"
        document = {
            "job": job.id,
            "complete": ranking.complete and job.state.finished,
            "total": len(places),
            "offset": first,
            "results": to_rows(ranking.at(places[first : first + many])),
            "not_screened": [vars(blade) for blade in ranking.unscreened[:1000]],
            "next": following,
        }
        return Response(replies.to_json(document), media_type=JSON, headers=_VARY)

    # In the queue of work: a table of many thousand rows takes a second to write as CSV.
    return await service.work.run(make, request)


@router.get(
    "/{job_id}/report",
    response_class=Response,
    responses={200: {"content": {HTML: {"schema": {"type": "string"}}}}, **problems(404, 422, 500, 503)},
    dependencies=[READ],
)
async def screening_report(request: Request, job_id: str, sheets: str | None = None) -> Response:
    """One page to read and print: the ranking, and a sheet for each of the riskiest blades (`sheets`, 50)."""
    desk, service = the_jobs(request), the_desk(request)
    many = checked_limit(sheets, pictures.MOST_SHEETS, 50, "sheets")

    def make() -> bytes:
        job = desk.jobs.get(job_id, SCREENING)
        folder = desk.jobs.folders.of(job.id)
        made = job.finished_at or datetime.now(UTC)
        card, ranking = service.card(folder.request()["model"]), desk.rankings.of(folder)
        return pictures.report(folder, ranking, sheets=many, card=card, made=made)

    page = await service.work.run(make, request)
    policy = {"Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'; img-src data:"}
    return Response(page, media_type=HTML, headers=policy)


@router.get(
    "/{job_id}/blades/{index}",
    response_class=Response,
    responses={
        200: {"content": {JSON: {"schema": {"type": "object", "title": "Blade file"}}}},
        **problems(404, 422, 500, 503),
    },
    dependencies=[READ],
)
async def screened_blade(request: Request, job_id: str, index: str) -> Response:
    """The blade file (`rubscreen/blade/1`) of a screened blade; of a profile, what was built of it."""

    def make(blade: ScreenedBlade) -> bytes:
        return replies.to_json(blade_to_dict(blade.blade))

    return await _of_blade(request, job_id, index, make, JSON)


@router.get(
    "/{job_id}/blades/{index}/map.png",
    response_class=Response,
    responses={200: {"content": {PNG: _BINARY}}, **problems(404, 422, 500, 503)},
    dependencies=[READ],
)
async def screening_map(request: Request, job_id: str, index: str, contact: str) -> Response:
    """The stability map of one blade under one contact."""

    def make(blade: ScreenedBlade) -> bytes:
        return pictures.map_chart(pictures.contact_result(blade, contact))

    return await _of_blade(request, job_id, index, make, PNG)


@router.get(
    "/{job_id}/blades/{index}/boundaries.png",
    response_class=Response,
    responses={200: {"content": {PNG: _BINARY}}, **problems(404, 422, 500, 503)},
    dependencies=[READ],
)
async def screening_boundaries(request: Request, job_id: str, index: str) -> Response:
    """The first crossings of one blade under every contact."""
    return await _of_blade(request, job_id, index, pictures.boundaries_chart, PNG)


async def _of_blade(
    request: Request, job_id: str, index: str, make: Callable[[ScreenedBlade], bytes], form: str
) -> Response:
    desk, service = the_jobs(request), the_desk(request)

    def answer() -> bytes:
        job = desk.jobs.get(job_id, SCREENING)
        place = checked_limit(index, 10**8, 0, "index", least=0)
        return make(pictures.screened_blade(desk.jobs.folders.of(job.id), place))

    return Response(await service.work.run(answer, request), media_type=form)


def _places(ranking: Ranking, asked: dict[str, str | None], contacts: Iterable[str] | None) -> np.ndarray:
    """Where the rows that fit are in the ranking; it reads no more than the filters look at."""
    if all(value is None for value in asked.values()):
        return np.arange(ranking.rows)
    columns = ranking.columns(["rank", "contact_name", "verdict", "meets_criteria"])
    return _filtered(columns, asked, contacts)["rank"].to_numpy() - 1


def _filtered(table: pa.Table, asked: dict[str, str | None], contacts: Iterable[str] | None) -> pa.Table:
    """The rows that fit the filters.

    Parameters
    ----------
    contacts
        Names of those of the job; None where it has the usual ones of each blade.

    Raises
    ------
    InvalidInput
        For a filter that no row of any such job could fit.
    """
    if (contact := asked["contact"]) is not None:
        names = list(USUAL_CONTACTS if contacts is None else contacts)
        if contact not in names and contact not in pc.unique(table["contact_name"]).to_pylist():
            raise InvalidInput("contact", contact, f"give a contact of this job: {', '.join(names)}")
        table = table.filter(pc.equal(table["contact_name"], contact))
    if (verdict := asked["verdict"]) is not None:
        if verdict not in VERDICTS:
            raise InvalidInput("verdict", verdict, f"give one of {', '.join(VERDICTS)}")
        table = table.filter(pc.equal(table["verdict"], verdict))
    if (meets := asked["meets_criteria"]) is not None:
        if meets not in ("true", "false"):
            raise InvalidInput("meets_criteria", meets, "give true or false")
        table = table.filter(pc.equal(table["meets_criteria"], meets == "true"))
    return table

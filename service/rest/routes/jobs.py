"""What routes about jobs share: whose they are, and how their progress is told."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any
from urllib.parse import urlencode

import orjson
from anyio import to_thread
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from sdm_core.errors import InvalidInput
from service.jobs.job import Job, State
from service.rest import replies
from service.rest.access import Caller, NotAllowed, the_caller
from service.rest.errors import NotReady
from service.rest.forms.media_types import JSON
from service.rest.job_desk import JobDesk
from service.rest.routes.request import the_desk
from service.roles import Role

_LOOK_EVERY_S, _STILL_THERE_S = 0.5, 15.0
MOST_JOBS = 200


def the_jobs(request: Request) -> JobDesk:
    """The jobs of the service.

    Raises
    ------
    NotReady
        Where it has no data folder.
    """
    desk = the_desk(request)
    if desk.jobs is None:
        raise NotReady(
            "data_folder", "none", "start the service with --data FOLDER, so that it can keep jobs"
        )
    return desk.jobs


def checked_limit(text: str | None, most: int, usual: int, field: str = "limit", least: int = 1) -> int:
    """A whole number of the query, from `least` up.

    Raises
    ------
    InvalidInput
    """
    if text is None:
        return usual
    if len(text) > 9 or not text.isascii() or not text.isdecimal() or not least <= int(text) <= most:
        raise InvalidInput(field, text, f"give {least} to {most}")
    return int(text)


def checked_states(text: str | None) -> tuple[State, ...]:
    """States of the query, separated by commas.

    Raises
    ------
    InvalidInput
    """
    if text is None:
        return ()
    known = {state.value: state for state in State}
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in known:
            raise InvalidInput("state", text, f"give one or more of {', '.join(known)}")
    return tuple(known[name] for name in names)


def check_owner(job: Job, caller: Caller) -> None:
    """Let a job be changed by who asked for it, and by an administrator.

    Raises
    ------
    NotAllowed
    """
    if caller.role is not Role.admin and caller.key_id != job.owner:
        raise NotAllowed("id", f"{job.id} of {job.owner_name}", "ask its owner or an administrator")


def progress_events(request: Request, desk: JobDesk, job: Job) -> StreamingResponse:
    """The job as server-sent events: at once, at every change, now and then without, and when it is over."""
    closing = the_desk(request).closing

    async def events() -> AsyncIterator[bytes]:
        said, silent_s = None, 0.0
        while True:
            now = await to_thread.run_sync(desk.jobs.get, job.id, job.kind)
            document = now.to_dict()
            # The time left changes by itself; alone it is no news.
            news = {**document, "progress": {**document["progress"], "remaining_s": None}}
            if news != said:
                said, silent_s = news, 0.0
                name = now.state.value if now.state.finished else "progress"
                yield b"event: %s\ndata: %s\n\n" % (name.encode(), orjson.dumps(document))
            if now.state.finished or closing.is_set():
                return
            await asyncio.sleep(_LOOK_EVERY_S)
            silent_s += _LOOK_EVERY_S
            if silent_s >= _STILL_THERE_S:  # or a proxy takes the connection for dead
                said = None

    headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
    return StreamingResponse(events(), media_type="text/event-stream", headers=headers)


def job_response(job: Job, status: int = 200) -> Response:
    """The job document, and where it is."""
    where = {"Location": f"/v1/{job.kind}s/{job.id}"}
    return Response(replies.to_json(job.to_dict()), status, media_type=JSON, headers=where)


def jobs_page(
    request: Request, kind: str, limit: str | None, after: str | None, state: str | None
) -> Response:
    """Jobs of a kind, newest first."""
    desk = the_jobs(request)
    many, states = checked_limit(limit, MOST_JOBS, 50), checked_states(state)
    found = desk.jobs.records.page(kind, states=states, limit=many + 1, after=after)
    following = None
    if len(found) > many:
        query: dict[str, Any] = {"limit": many, "after": found[many - 1].id}
        query |= {} if state is None else {"state": state}
        following = f"/v1/{kind}s?{urlencode(query)}"
    document = {"jobs": [desk.jobs.as_it_is(job).to_dict() for job in found[:many]], "next": following}
    return Response(replies.to_json(document), media_type=JSON)


def cancelled(request: Request, job_id: str, kind: str) -> Response:
    """Cancel a job of one's own."""
    jobs = the_jobs(request).jobs
    check_owner(jobs.get(job_id, kind), the_caller(request))
    return job_response(jobs.cancel(job_id, kind))


def retried(request: Request, job_id: str, kind: str) -> Response:
    """Run a job of one's own again, where the quota has room for it."""
    jobs, caller = the_jobs(request).jobs, the_caller(request)
    check_owner(jobs.get(job_id, kind), caller)
    active = 0 if caller.key_id is None else jobs.records.active(caller.key_id)
    the_desk(request).access.quota.check_job_quota(caller, active, jobs.records.active())
    return job_response(jobs.retry(job_id, kind), 202)

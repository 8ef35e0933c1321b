"""The conversations about jobs of any kind: seen, waited for, listed, cancelled, run again."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar
from urllib.parse import quote, urlencode

from pydantic import ValidationError

from sdm_core.errors import InvalidInput
from service.client.conversations import one
from service.client.job_status import JobNotDone, JobStatus, StillUnderWay
from service.client.message import Conversation, Listening, Message, Pause
from service.client.problem import ServiceProblem
from service.jobs.job import State
from service.rest.job_schemas import JobReply, JobsReply

T = TypeVar("T")
SCREENINGS, TRAININGS, SIMULATIONS = "/v1/screenings", "/v1/trainings", "/v1/simulations"
Watch = Callable[[JobStatus], None]
"""Told a job at every change."""

# The service says something every 15 s: after this time a proxy keeps the events, or the connection is dead.
_SILENT_S = 25.0
# Between two looks where no events come.
_POLL_S = 3.0
# Clients of a service that is started again do not all come at once.
_AGAIN_S, _LONGEST_AGAIN_S = 1.0, 10.0
_TRIES = 5


def job(path: str, job_id: str) -> Conversation[JobStatus]:
    """``GET /v1/screenings/{id}``, and so for the other kinds."""
    return status_of(Message.get(job_path(path, job_id)))


def cancel(path: str, job_id: str) -> Conversation[JobStatus]:
    """``DELETE``; a job that is over stays as it is, so asking twice does no harm."""
    return status_of(Message("DELETE", job_path(path, job_id)))


def retry(path: str, job_id: str) -> Conversation[JobStatus]:
    """``POST .../retry``, acted on once: where the answer is lost, the job's attempt tells whether it was."""
    before = yield from job(path, job_id)
    message = Message("POST", f"{job_path(path, job_id)}/retry", repeatable=False)
    for tries_left in reversed(range(_TRIES)):
        try:
            return (yield from status_of(message))
        except ServiceProblem as problem:
            if not problem.temporary or not tries_left:
                raise
            yield Pause((problem.retry_after_s or 0.0) + random.uniform(0.2, 1.0) * _AGAIN_S)
        now = yield from job(path, job_id)
        if now.attempt > before.attempt:
            return now
    raise AssertionError("the last try returns or raises")


def status_of(message: Message) -> Conversation[JobStatus]:
    """The job that a message is answered with."""
    return JobStatus.of((yield from one(message, JobReply)))


@dataclass(frozen=True)
class Page:
    """Some of the jobs there are, and the path of the next page; None where this is the last."""

    jobs: tuple[JobStatus, ...]
    next: str | None


def first_page(path: str, state: str | Iterable[str] | None) -> str:
    """The path of the first page of jobs in the states given, or of all."""
    query = {"limit": "200"}
    if state is not None:
        query["state"] = state if isinstance(state, str) else ",".join(state)
    return f"{path}?{urlencode(query)}"


def page(path: str) -> Conversation[Page]:
    """One page of a list of jobs."""
    reply = yield from one(Message.get(path), JobsReply)
    return Page(tuple(JobStatus.of(job) for job in reply.jobs), reply.next)


def until_over(
    path: str, job_id: str, watch: Watch | None, timeout_s: float | None, patience_s: float
) -> Conversation[JobStatus]:
    """Wait for the end of a job by its events, and by asking where these do not come.

    A stream that breaks, a service that is not there for a while, and one that is started again are waited
    out, as long as it is not away for longer than `patience_s` at a time.

    Raises
    ------
    JobNotDone
        When it failed or was cancelled.
    StillUnderWay
        When it is not over after `timeout_s`.
    ServiceProblem
        When there is no such job, or the service stays away.
    """
    began = time.monotonic()
    end = began + (float("inf") if timeout_s is None else timeout_s)
    last: JobStatus | None = None
    heard = 0

    def take(status: JobStatus) -> bool:
        nonlocal last, heard
        heard += 1
        if watch is not None and (last is None or status.document != last.document):
            watch(status)
        last = status
        return status.finished or time.monotonic() >= end

    def hear(data: str) -> bool:
        try:
            return take(JobStatus.of(JobReply.model_validate_json(data, extra="ignore")))
        except (ValidationError, ValueError):
            return False  # of a later service, or cut off: the next look tells

    events, answered, again_s = True, began, _AGAIN_S
    while True:
        try:
            take((yield from job(path, job_id)))
        except ServiceProblem as problem:
            away_s = time.monotonic() - answered
            if not problem.temporary or away_s > patience_s:
                raise
            yield Pause((problem.retry_after_s or 0.0) + random.uniform(0.2, 1.0) * again_s)
            again_s = min(2.0 * again_s, _LONGEST_AGAIN_S)
            continue
        assert last is not None
        answered, again_s = time.monotonic(), _AGAIN_S
        if last.finished:
            break
        left_s = end - answered
        if left_s <= 0.0:
            assert timeout_s is not None
            raise StillUnderWay(last, timeout_s)
        if not events:
            yield Pause(min(_POLL_S, left_s))
            continue
        heard = 0
        try:
            yield Listening(f"{job_path(path, job_id)}/events", hear, min(_SILENT_S, left_s))
        except ServiceProblem as problem:
            # Nothing comes through a proxy that keeps it, or another page does: the job is asked for instead.
            events = bool(problem.temporary or heard or left_s < _SILENT_S)
        if last.finished:
            break
        # Nothing heard: refused for being one stream too many, or ended at once. Another look does not hurry.
        rest_s = random.uniform(0.2, 1.0) * _AGAIN_S if heard else _POLL_S
        yield Pause(min(rest_s, max(0.0, end - time.monotonic())))
    if last.state is not State.DONE:
        raise JobNotDone(last)
    return last


def job_path(path: str, job_id: str) -> str:
    """Where a job is.

    Raises
    ------
    InvalidInput
        For an identifier that is empty: that would be the list of all.
    """
    if not job_id:
        raise InvalidInput("id", job_id, "give the id of a job")
    return f"{path}/{quote(job_id, safe='')}"

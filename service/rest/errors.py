"""Every error as a problem document (RFC 9457), from one table of exceptions."""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from sqlalchemy.exc import SQLAlchemyError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from sdm_core.errors import (
    Cancelled,
    DamagedFile,
    InvalidInput,
    ModesNotTracked,
    OutOfSpeedRange,
    TooMuchWork,
)
from service.jobs.errors import (
    NoRoom,
    NoSuchJob,
    NoSuchUpload,
    NotScreened,
    NotSimulated,
    NotTrained,
    OtherRequest,
    TooManyUploads,
    UnderWay,
    UploadTooLarge,
)
from service.records.database import does_not_answer, is_out_of_room
from service.rest.access import NotAllowed, NotAuthenticated
from service.rest.job_quota import TooManyJobs
from service.rest.limits import Busy, SlowBody
from service.rest.rate_limits import TooManyRequests
from service.sizes import TooLarge

PROBLEM_JSON = "application/problem+json"
logger = logging.getLogger("rubscreen.service")


class NotReady(InvalidInput):
    """The service lacks something it needs for this answer."""


class Leaving(NotReady):
    """The service is about to stop."""


class NotAcceptable(InvalidInput):
    """No form of the answer is one the client takes."""


class UnsupportedForm(InvalidInput):
    """The body has a form that is not taken here."""


class NoSuchModel(InvalidInput):
    """There is no model of this name."""


class ModelNotChanged(InvalidInput):
    """Another model cannot become the active one as things are."""


class PromotionNotAllowed(ModelNotChanged):
    """The gate refused a promotion.

    Attributes
    ----------
    members
        Of the problem document, beside its usual ones.
    """

    def __init__(self, model: str, reasons: tuple[str, ...]) -> None:
        why = "; ".join(reasons)
        remedy = f'it is worse than the active one ({why}); {{"force": true}} promotes it all the same'
        super().__init__("model", model, remedy)
        self.members = {"reasons": list(reasons)}


@dataclass(frozen=True)
class Kind:
    """A kind of problem: the last part of its `type`, its title and its HTTP status."""

    name: str
    title: str
    status: int
    retry_after_s: int | None = None

    @property
    def type(self) -> str:
        """The problem's `type`: a name, so that nothing has to be reachable."""
        return f"urn:rubscreen:problem:{self.name}"


# The first class that fits counts, so the narrower ones stand first.
KINDS: tuple[tuple[type[InvalidInput], Kind], ...] = (
    (NotAuthenticated, Kind("not-authenticated", "It is not known who asks", 401)),
    (NotAllowed, Kind("not-allowed", "The caller may not do this", 403)),
    (TooManyJobs, Kind("too-many-jobs", "The caller has as many jobs as it may", 429)),
    (TooManyRequests, Kind("too-many-requests", "The caller sends more requests than it may", 429)),
    (NoSuchJob, Kind("no-such-job", "There is no such job", 404)),
    (NoSuchUpload, Kind("no-such-upload", "There is no such upload", 404)),
    (NotScreened, Kind("not-screened", "There is no result of this blade", 404)),
    (NotSimulated, Kind("not-simulated", "There is no such result of the simulation", 404)),
    (NotTrained, Kind("not-trained", "There is no model of this training", 404)),
    (OtherRequest, Kind("other-request", "The idempotency key belongs to another request", 409)),
    (UnderWay, Kind("under-way", "The job is not over", 409)),
    (UploadTooLarge, Kind("too-large", "The request is too large", 413)),
    (NoRoom, Kind("no-room", "The service has no room left on its disk", 507)),
    (TooManyUploads, Kind("upload-quota", "The caller's files take up as much as they may", 507)),
    (TooLarge, Kind("too-large", "The request is too large", 413)),
    (TooMuchWork, Kind("too-much-work", "More exact work than one call may ask for", 413)),
    (SlowBody, Kind("slow-body", "The body did not arrive in time", 408)),
    (Busy, Kind("busy", "The service is busy", 503, retry_after_s=5)),
    (Leaving, Kind("draining", "The service is about to stop", 503, retry_after_s=5)),
    (NotReady, Kind("not-ready", "The service is not ready to answer this", 503, retry_after_s=30)),
    (DamagedFile, Kind("damaged-file", "A file of the service is damaged", 503)),
    (NotAcceptable, Kind("not-acceptable", "No such form of the answer", 406)),
    (UnsupportedForm, Kind("unsupported-media-type", "No such form of the body is taken", 415)),
    (NoSuchModel, Kind("no-such-model", "There is no such model", 404)),
    (PromotionNotAllowed, Kind("promotion-refused", "The model is worse than the active one", 409)),
    (ModelNotChanged, Kind("model-not-changed", "The active model cannot be changed so", 409)),
    (OutOfSpeedRange, Kind("out-of-speed-range", "The modal data do not reach this speed", 422)),
    (ModesNotTracked, Kind("modes-not-tracked", "Modes cannot be followed between the states", 422)),
    (InvalidInput, Kind("invalid-input", "The request cannot be used", 422)),
)


def kind_of(error: InvalidInput) -> Kind:
    """The kind of problem an exception of the core or of the service is."""
    return next(kind for exception, kind in KINDS if isinstance(error, exception))


class Problem(Response):
    """A problem document.

    Beside the members of RFC 9457 it carries `field` (where, as the caller wrote it), `value` (what
    was found there), `remedy` (what to do) and `request_id` (to find the request in the log).
    """

    media_type = PROBLEM_JSON

    def __init__(
        self,
        kind: Kind,
        scope: Mapping[str, Any],
        field: str,
        value: str,
        remedy: str,
        headers: Mapping[str, str] | None = None,
        members: Mapping[str, Any] | None = None,
    ) -> None:
        document = {
            "type": kind.type,
            "title": kind.title,
            "status": kind.status,
            "detail": f"{field} = {value}: {remedy}",
            "instance": scope["path"],
            "field": field,
            "value": value,
            "remedy": remedy,
            "request_id": scope.get("state", {}).get("request_id"),
            **(members or {}),
        }
        extra = dict(headers or {})
        if kind.retry_after_s is not None:
            extra["Retry-After"] = str(kind.retry_after_s)
        # The standard encoder, in ASCII: what it quotes may hold characters no UTF-8 can carry.
        super().__init__(json.dumps(document).encode(), kind.status, extra)


def unexpected(scope: Mapping[str, Any], error: Exception) -> Problem:
    """The problem that answers a fault of the service itself; what it was stays in the log."""
    kind = Kind("internal-error", "The service failed", 500)
    return Problem(
        kind, scope, "service", type(error).__name__, "report it with the request_id and the request's body"
    )


def problem_of(error: InvalidInput, scope: Mapping[str, Any]) -> Problem:
    """The problem document that says what is wrong, with the headers and members that go with it."""
    headers, members = getattr(error, "headers", None), getattr(error, "members", None)
    return Problem(kind_of(error), scope, error.field, error.value, error.remedy, headers, members)


def _answer_invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, InvalidInput)
    return problem_of(error, request.scope)


def _answer_unreadable(request: Request, error: Exception) -> Response:
    """A parameter of path, query or header that FastAPI itself could not read.

    Each is declared as text, which any text is: it can only be missing.
    """
    assert isinstance(error, RequestValidationError)
    fault = error.errors()[0]
    where, *names = (str(part) for part in fault["loc"])
    field = ".".join(names) or "request"
    if fault["type"] == "missing":
        found = InvalidInput(field, "missing", f"give it in the {where}; /docs shows what it may be")
    else:
        found = InvalidInput(field, fault["input"], "see /docs for what it may be")
    return problem_of(found, request.scope)


def _answer_http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    headers = error.headers or {}
    if error.status_code == HTTPStatus.NOT_FOUND:
        kind = Kind("no-such-path", "There is nothing at this path", 404)
        return Problem(kind, request.scope, "path", request.url.path, "see /docs for the paths there are")
    if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        kind = Kind("method-not-allowed", "The path does not take this method", 405)
        remedy = f"use {headers.get('Allow', 'another method')}"
        return Problem(kind, request.scope, "method", request.method, remedy, headers)
    kind = Kind("http-error", HTTPStatus(error.status_code).phrase, error.status_code)
    return Problem(kind, request.scope, "request", str(error.detail), "see /docs for what is taken", headers)


def _answer_gone(request: Request, error: Exception) -> Response:
    # Nobody reads this; it keeps a client that hangs up from being logged as a fault of ours.
    kind = Kind("body-cut-off", "The connection ended before the body did", 400)
    return Problem(kind, request.scope, "body", "cut off", "send the whole body")


def _answer_stopped(request: Request, error: Exception) -> Response:
    kind = Kind("stopped", "The work was stopped", 503, retry_after_s=5)
    return Problem(kind, request.scope, "service", str(error), "send the request again later")


def _answer_database(request: Request, error: Exception) -> Response:
    assert isinstance(error, SQLAlchemyError)
    if not does_not_answer(error):
        logger.error("the database refuses what it was asked", exc_info=error)
        return unexpected(request.scope, error)
    logger.error("the database: %s", error)
    if is_out_of_room(error):
        kind = Kind("no-room", "The service has no room left on its disk", 507)
        return Problem(kind, request.scope, "database", "the disk is full", "make room on it")
    kind = Kind("database", "The database does not answer", 503, retry_after_s=10)
    return Problem(kind, request.scope, "database", type(error).__name__, "send the request again later")


def install(app: FastAPI) -> None:
    """Answer every exception of the table, and the framework's own, with a problem document."""
    app.add_exception_handler(InvalidInput, _answer_invalid)
    app.add_exception_handler(HTTPException, _answer_http)
    app.add_exception_handler(RequestValidationError, _answer_unreadable)
    app.add_exception_handler(ClientDisconnect, _answer_gone)
    app.add_exception_handler(Cancelled, _answer_stopped)
    app.add_exception_handler(SQLAlchemyError, _answer_database)

"""``/v1/models``: which there are, which answers, and another in its place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from datetime import UTC, datetime
from math import exp
from pathlib import Path

from fastapi import APIRouter
from starlette.requests import Request

from sdm_core.errors import InvalidInput
from service.audit.tally import FALSE_ALARM, LARGEST_LOG, Promise
from service.records import audits
from service.records.audits import Audited
from service.rest.access import ADMIN, READ
from service.rest.body import parsed
from service.rest.desk import Desk
from service.rest.errors import ModelNotChanged, NoSuchModel, PromotionNotAllowed
from service.rest.known_query import KNOWN_QUERY
from service.rest.model_schemas import (
    Activation,
    AuditReply,
    ModelAudits,
    ModelChange,
    ModelHistory,
    PromotionQuestion,
)
from service.rest.models_folder import models_folder
from service.rest.openapi import problems, request_body
from service.rest.questions import read_question
from service.rest.routes.request import TheJson, the_desk
from service.rest.schemas import Model, Models
from training import activation, promotion
from training.registry import SHIPPED, is_model, model_entry

router = APIRouter(prefix="/v1", tags=["models"], dependencies=[READ, KNOWN_QUERY])


@router.get("/models", responses=problems(500))
def models(request: Request) -> Models:  # not async: it reads files
    """The surrogates there are, the one that answers first."""
    desk = the_desk(request)
    return Models(
        models=[Model(id=m.id, active=m.active, card=m.card, damage=m.damage) for m in desk.models()],
        loading=desk.model.loading,
        fault=desk.fault,
    )


@router.get("/models/history", responses=problems(500))
def model_history(request: Request) -> ModelHistory:
    """Which model was active when, oldest first, and what spoke against those that were forced."""
    changes = activation.history(models_folder(the_desk(request).settings))
    return ModelHistory(changes=[Activation.model_validate(asdict(change)) for change in changes])


@router.get("/models/{model_id}", responses=problems(404, 422, 500))
def one_model(request: Request, model_id: str) -> Model:
    """One surrogate with its card."""
    desk = the_desk(request)
    _check_there(desk, model_id)
    found = model_entry(model_id, models_folder(desk.settings), desk.answering)
    return Model(id=found.id, active=found.active, card=found.card, damage=found.damage)


@router.get("/models/{model_id}/audits", responses=problems(404, 422, 500, 503))
def model_audits(request: Request, model_id: str) -> ModelAudits:
    """What audits of its confident answers have counted, as of a second ago or so, for each promise."""
    desk = the_desk(request)
    _check_there(desk, model_id)
    known = _audited(desk)
    mine = sorted((promise, seen) for promise, seen in known.items() if promise.model == model_id)
    return ModelAudits(
        model=model_id,
        auditing=desk.auditor is not None,
        alarm=any(seen.alarmed_at is not None for _, seen in mine),
        alarm_at=1.0 / FALSE_ALARM,
        audits=[
            AuditReply(
                contact=promise.contact,
                alpha=promise.alpha,
                **asdict(seen.tally),
                evidence=exp(min(seen.tally.log_evidence(promise.alpha), LARGEST_LOG)),
                alarmed_at=_utc(seen.alarmed_at),
            )
            for promise, seen in mine
        ],
    )


@router.post(
    "/models/{model_id}/promote",
    dependencies=[ADMIN],
    response_model=ModelChange,
    openapi_extra=request_body(PromotionQuestion, {"force": False}, required=False),
    responses=problems(404, 408, 409, 413, 415, 422, 500, 503),
)
async def promote_model(request: Request, model_id: str, body: TheJson) -> ModelChange:
    """Make a surrogate the active one, unless its certificate, its figures or 2,000 fresh points are worse.

    Every replica of the same models folder takes it up at its next look. `force` overrides the gate, on
    record; a damaged model is not promoted by force either.
    """
    desk = the_desk(request)

    def change() -> ModelChange:
        ask = read_question(PromotionQuestion, parsed(body) if body.strip() else {}, desk.settings)
        _check_there(desk, model_id)
        return _changed(desk, lambda folder: promotion.promote(model_id, folder, force=ask.force))

    return await desk.work.run(change, request)


@router.post("/models/rollback", dependencies=[ADMIN], responses=problems(409, 500, 503))
async def roll_back(request: Request) -> ModelChange:
    """Make the surrogate active again that was before the active one; once more, the one before that."""
    desk = the_desk(request)
    return await desk.work.run(lambda: _changed(desk, promotion.rollback), request)


def _audited(desk: Desk) -> dict[Promise, Audited]:
    """Of the auditor, or where this service has none, what others have left in the database."""
    if desk.auditor is not None:
        return desk.auditor.known
    return {} if desk.database is None else audits.read(desk.database)


def _utc(at: datetime | None) -> str | None:
    """As text; SQLite keeps no time zone."""
    if at is None:
        return None
    return (at if at.tzinfo else at.replace(tzinfo=UTC)).isoformat(timespec="seconds").replace("+00:00", "Z")


def _check_there(desk: Desk, model_id: str) -> None:
    if not is_model(model_id, models_folder(desk.settings)):
        raise NoSuchModel("model", model_id, "GET /v1/models lists those there are")


def _changed(desk: Desk, change: Callable[[Path], promotion.Promotion]) -> ModelChange:
    folder = models_folder(desk.settings)
    if folder == SHIPPED:
        remedy = "start the service with a folder of its own: `rubscreen serve --models FOLDER`"
        raise ModelNotChanged("models folder", "the one that came with the package", remedy)
    try:
        made = change(folder)
    except promotion.PromotionRefused as refused:
        raise PromotionNotAllowed(refused.model, refused.reasons) from None
    except InvalidInput as error:
        raise ModelNotChanged(error.field, error.value, error.remedy) from None
    if desk.settings.models_poll_s > 0:
        desk.model.follow()
    return ModelChange(
        model=made.model,
        was=made.was,
        overridden=list(made.overridden),
        answering=desk.answering == made.model,
    )

"""The conversations about trainings: ordered, by the calendar too, and what came of one."""

from __future__ import annotations

from typing import Any

from service.client.conversations import one
from service.client.job_conversations import TRAININGS, job_path, status_of
from service.client.job_status import JobStatus
from service.client.message import Conversation, Message
from service.rest import replies
from service.rest.job_schemas import ScheduleReply, TrainedReply
from service.rest.training_question import TrainingQuestion

SCHEDULE = f"{TRAININGS}/schedule"


def submitted(training: TrainingQuestion | None, key: str | None) -> Conversation[JobStatus]:
    """``POST /v1/trainings``, once for a key however often it is sent."""
    return status_of(Message.order(TRAININGS, _asked(training), key))


def result(job_id: str) -> Conversation[TrainedReply]:
    """``GET /v1/trainings/{id}/result``."""
    return one(Message.get(f"{job_path(TRAININGS, job_id)}/result"), TrainedReply)


def schedule() -> Conversation[ScheduleReply]:
    """``GET /v1/trainings/schedule``."""
    return one(Message.get(SCHEDULE), ScheduleReply)


def put_schedule(cron: str, timezone: str, training: TrainingQuestion | None) -> Conversation[ScheduleReply]:
    """``PUT /v1/trainings/schedule``; to say it twice changes nothing."""
    asked = {"cron": cron, "timezone": timezone, "training": _asked(training)}
    return one(Message("PUT", SCHEDULE, replies.to_json(asked)), ScheduleReply)


def drop_schedule() -> Conversation[ScheduleReply]:
    """``DELETE /v1/trainings/schedule``."""
    return one(Message("DELETE", SCHEDULE), ScheduleReply)


def _asked(training: TrainingQuestion | None) -> dict[str, Any]:
    return {} if training is None else training.model_dump(exclude_unset=True)

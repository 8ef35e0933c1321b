"""What the clients' methods do, written once: conversations that yield messages and are sent the answers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import httpx
import numpy as np
from pydantic import BaseModel, ValidationError

from sdm_core.blade import Blade, blade_from_dict, blade_to_dict
from sdm_core.blade.profile import BladeProfile, profile_to_dict
from sdm_core.errors import InvalidInput
from service.client.message import Conversation, Message
from service.client.problem import ServiceProblem
from service.client.questions import Answers, Question
from service.rest.forms.media_types import NPZ
from service.rest.schemas import BladeReply, BuildReply, FindingReply

Json = dict[str, Any]
Read = TypeVar("Read", bound=BaseModel)
Progress = Callable[[int, int], None]
"""Told how many answers have come, of how many."""

# The parts of a large question must come from one model; while models change, they are asked anew this often.
_FRESH_STARTS = 3
_DIVISIBLE = frozenset({"speed_hz", "ke", "speed_hz x ke", "body", "request"})


@dataclass(frozen=True)
class BladeAnswer:
    """A blade the service has checked, or built from a profile.

    Attributes
    ----------
    build
        How it was built; None where it was checked.
    findings
        What an engineer should look at.
    """

    blade: Blade
    build: BuildReply | None
    findings: tuple[FindingReply, ...]


def numbers(values: Any) -> np.ndarray:
    """A list, an array or one number as an array of floats."""
    return np.atleast_1d(np.asarray(values, dtype=float))


def answers(question: Question[Answers], progress: Progress | None = None) -> Conversation[Answers]:
    """Ask a question of any size.

    It is divided into parts below the service's usual limits, and further where the service says that a
    part is too much. Where the model changed between two parts, all are asked anew.
    """
    waiting: list[Question[Answers]] = list(question.parts())
    done: list[Question[Answers]] = []
    came: list[Answers] = []
    bulk, starts = True, 0
    while waiting:
        part = waiting.pop(0)
        message = part.message(bulk)
        try:
            reply = yield message
        except ServiceProblem as problem:
            if message.form == NPZ and _reads_no_npz(problem):
                bulk = False
                waiting.insert(0, part)
                continue
            halves = part.halves() if _too_much(problem) else None
            if halves is None:
                raise part.placed(problem) from None
            most = halves[1].size  # the further ones would be refused as well
            waiting = list(halves) + [piece for rest in waiting for piece in rest.parts(most)]
            continue
        found = part.read(reply)
        if came and found.model != came[0].model:
            starts += 1
            if starts > _FRESH_STARTS:
                raise ServiceProblem(_changing(came[0].model, found.model), temporary=True)
            waiting[:0] = done + [part]  # noqa: RUF005 (unpacked, its type is not found)
            done.clear()
            came.clear()
            continue
        done.append(part)
        came.append(found)
        if progress is not None:
            progress(sum(piece.size for piece in done), question.size)
    return question.joined(came)


def ready() -> Conversation[bool]:
    """``GET /readyz``, once: whoever asks wants to know about now."""
    try:
        yield Message("GET", "/readyz", repeatable=False)
    except ServiceProblem:
        return False
    return True


def one(message: Message, kind: type[Read]) -> Conversation[Read]:
    """One message, whose answer is read as `kind`."""
    reply = yield message
    return _read(kind, reply)


def checked_blade(blade: Blade) -> Conversation[BladeAnswer]:
    """``POST /v1/blades`` with modal data."""
    return _blade({"blade": blade_to_dict(blade)})


def built_blade(profile: BladeProfile, verify: bool) -> Conversation[BladeAnswer]:
    """``POST /v1/blades`` with a profile."""
    return _blade({"profile": profile_to_dict(profile), "verify": verify})


def _blade(asked: Json) -> Conversation[BladeAnswer]:
    reply = yield Message.post("/v1/blades", asked)
    read = _read(BladeReply, reply)
    try:
        return BladeAnswer(blade_from_dict(read.blade), read.build, tuple(read.findings))
    except InvalidInput:
        raise ServiceProblem.foreign(reply) from None


def _read(kind: type[Read], reply: httpx.Response) -> Read:
    try:
        # What a later service says beyond is not a fault of it.
        return kind.model_validate_json(reply.content, extra="ignore")
    except ValidationError:
        raise ServiceProblem.foreign(reply) from None


def _reads_no_npz(problem: ServiceProblem) -> bool:
    """Whether it is a service from before there was npz, which takes every body as JSON."""
    said = problem.problem
    return said.get("status") == 415 or (said.get("status") == 422 and said.get("field") == "body")


def _too_much(problem: ServiceProblem) -> bool:
    return problem.problem.get("status") == 413 and problem.problem.get("field") in _DIVISIBLE


def _changing(was: str | None, now: str | None) -> Json:
    detail = f"the service's model changed from {was} to {now} while the question was asked; ask again"
    return {"status": None, "title": "The parts of the answer come from different models", "detail": detail}

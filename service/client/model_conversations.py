"""The conversations about models: which there are, which answers, and another in its place."""

from __future__ import annotations

from typing import Any
from urllib.parse import quote

from service.client.conversations import one
from service.client.message import Conversation, Message, document_of
from service.client.problem import ServiceProblem
from service.rest.model_schemas import ModelChange, ModelHistory
from service.rest.schemas import Model


def models() -> Conversation[list[dict[str, Any]]]:
    """``GET /v1/models``."""
    reply = yield Message.get("/v1/models")
    document = document_of(reply)
    try:
        return list(document["models"])
    except (KeyError, TypeError):
        raise ServiceProblem.foreign(reply) from None


def model(model_id: str) -> Conversation[Model]:
    """``GET /v1/models/{id}``."""
    return one(Message.get(_path(model_id)), Model)


def history() -> Conversation[ModelHistory]:
    """``GET /v1/models/history``."""
    return one(Message.get("/v1/models/history"), ModelHistory)


def promote(model_id: str, force: bool) -> Conversation[ModelChange]:
    """``POST /v1/models/{id}/promote``; once it is active, to ask again changes nothing."""
    return one(Message.post(f"{_path(model_id)}/promote", {"force": force}), ModelChange)


def rollback() -> Conversation[ModelChange]:
    """``POST /v1/models/rollback``: a second one would go back a second step, so it is sent once."""
    return one(Message("POST", "/v1/models/rollback", repeatable=False), ModelChange)


def _path(model_id: str) -> str:
    return f"/v1/models/{quote(model_id, safe='')}"

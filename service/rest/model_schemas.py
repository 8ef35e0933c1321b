"""What the service answers about changes of the active model."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field


class PromotionQuestion(BaseModel):
    """What ``POST /v1/models/{id}/promote`` is asked."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    force: bool = Field(False, description="Promote it though it is worse; the history records why not.")


class ModelChange(BaseModel):
    """The active model, changed."""

    model: str = Field(description="Active from now on.")
    was: str | None = Field(description="Active before; the same where nothing had to change.")
    overridden: list[str] = Field(description="What spoke against it, when it was forced.")
    answering: bool = Field(
        description="Whether the replica that was asked answers from it already. The others, and this one "
        "where false, take it up at their next look at the folder."
    )


class Activation(BaseModel):
    """A change of the active model."""

    at: str = Field(description="UTC, ISO 8601.")
    event: Literal["first", "promoted", "rolled back", "found"]
    model: str
    was: str | None
    forced: bool = Field(description="Whether the gate was overridden.")
    reasons: list[str] = Field(description="What the gate said against it.")
    measured: dict[str, Any] = Field(description="On fresh points, before the promotion.")
    code_version: str


class ModelHistory(BaseModel):
    """Which model was active when, oldest first."""

    changes: list[Activation]

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


class AuditReply(BaseModel):
    """What audits have found under one line of a certificate: counts of answers, each solved exactly."""

    contact: str = Field(description="Class of contact: permanent or arcs.")
    alpha: float = Field(
        description="What was promised: the rate of unstable points among those called stable."
    )
    answered_stable: int
    false_stable: int = Field(description="Of these, unstable; the promise is about them.")
    answered_unstable: int
    false_unstable: int = Field(description="Of these, stable; nothing is promised of them.")
    undecided: int = Field(description="Not decided to tolerance by the exact core, and not counted above.")
    evidence: float = Field(description="Against the promise; an alarm is raised at `alarm_at`.")
    alarmed_at: str | None = Field(
        description="UTC, ISO 8601; null where the promise was never contradicted."
    )


class ModelAudits(BaseModel):
    """What audits in the background have found about a model, here and on other replicas."""

    model: str
    auditing: bool = Field(description="Whether this service audits at all; what was found before stays.")
    alarm: bool = Field(description="Whether a promise was contradicted. An alarm stays.")
    alarm_at: float = Field(
        description="Evidence that a promise which is kept ever reaches with a chance of 1 %: 100."
    )
    audits: list[AuditReply] = Field(description="One a promise of which answers were audited.")

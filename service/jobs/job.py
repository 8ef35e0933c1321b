"""A job: what was asked, by whom, and how far it is."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any

SCREENING, TRAINING, SIMULATION = "screening", "training", "simulation"
KINDS = (SCREENING, TRAINING, SIMULATION)
LONGEST_NAME = 200  # characters
# 1 is first.
FIRST_PRIORITY, USUAL_PRIORITY, LAST_PRIORITY = 1, 5, 9


class State(StrEnum):
    """Where a job stands. It waits when it cannot go on by itself, say for room on the disk."""

    QUEUED = "queued"
    RUNNING = "running"
    WAITING = "waiting"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def finished(self) -> bool:
        """Whether it goes on only when it is asked to."""
        return self in FINISHED


FINISHED = (State.DONE, State.FAILED, State.CANCELLED)
ACTIVE = tuple(state for state in State if state not in FINISHED)


@dataclass(frozen=True)
class Fault:
    """Why a job failed, as in an error's field, value and remedy."""

    field: str
    value: str
    remedy: str

    def to_json(self) -> str:
        """For a row."""
        return json.dumps({"field": self.field, "value": self.value, "remedy": self.remedy})

    @classmethod
    def from_json(cls, text: str) -> Fault:
        """From a row."""
        return cls(**json.loads(text))


@dataclass(frozen=True)
class Job:
    """A job as its row says.

    Attributes
    ----------
    id
        32 hexadecimal digits; also the name of its folder.
    owner, owner_name
        Key that asked for it, and that key's name; None without keys.
    priority
        1 (first) to 9 (last).
    idempotency_key, request_digest
        What makes the same request again the same job.
    attempt
        How often it was started by request: 1, and one more for each retry.
    done, total, stage
        Units of work; for a screening the blades, for a simulation the speeds.
    not_screened
        Blades that could not be.
    waiting_for
        What it waits for; None where it does not wait.
    cancel_requested
        Whether it is to stop.
    """

    id: str
    kind: str
    name: str | None = None
    owner: str | None = None
    owner_name: str | None = None
    priority: int = USUAL_PRIORITY
    idempotency_key: str | None = None
    request_digest: str = ""
    state: State = State.QUEUED
    created_at: datetime = field(default_factory=lambda: datetime.now(UTC))
    started_at: datetime | None = None
    finished_at: datetime | None = None
    attempt: int = 1
    done: int = 0
    total: int = 0
    stage: str = ""
    not_screened: int = 0
    waiting_for: str | None = None
    fault: Fault | None = None
    cancel_requested: bool = False

    @property
    def share(self) -> float:
        """Done of the total, 0 to 1."""
        return self.done / self.total if self.total else 0.0

    def remaining_s(self, now: datetime | None = None) -> float | None:
        """Time still needed if it goes on as it did since it started; None where nothing tells."""
        if self.state is not State.RUNNING or self.started_at is None or not 0 < self.done < self.total:
            return None
        spent = ((now or datetime.now(UTC)) - self.started_at).total_seconds()
        return spent * (self.total - self.done) / self.done

    def to_dict(self) -> dict[str, Any]:
        """The job document of the wire."""
        remaining = self.remaining_s()
        return {
            "id": self.id,
            "kind": self.kind,
            "name": self.name,
            "state": self.state.value,
            "waiting_for": self.waiting_for,
            "created_at": _iso(self.created_at),
            "started_at": _iso(self.started_at),
            "finished_at": _iso(self.finished_at),
            "owner": self.owner_name,
            "priority": self.priority,
            "attempt": self.attempt,
            "progress": {
                "done": self.done,
                "total": self.total,
                "stage": self.stage,
                "share": round(self.share, 4),
                "remaining_s": None if remaining is None else round(remaining, 1),
            },
            "not_screened": self.not_screened,
            "error": None
            if self.fault is None
            else {"field": self.fault.field, "value": self.fault.value, "remedy": self.fault.remedy},
            "links": self._links(),
        }

    def _links(self) -> dict[str, str]:
        base = f"/v1/{self.kind}s/{self.id}"
        return {"self": base, **{part: f"{base}/{part}" for part in _LINKS[self.kind]}}


_LINKS = {
    SCREENING: ("results", "events", "report"),
    TRAINING: ("events",),
    SIMULATION: ("results", "events"),
}


def _iso(at: datetime | None) -> str | None:
    return None if at is None else at.isoformat(timespec="milliseconds").replace("+00:00", "Z")

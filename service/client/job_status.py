"""A job as the service tells of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from sdm_core.errors import RubscreenError
from service.jobs.job import Fault, State
from service.rest.job_schemas import JobReply


@dataclass(frozen=True)
class JobProgress:
    """How far a job is.

    Attributes
    ----------
    done, total
        For a screening the blades, for a simulation the speeds.
    share
        0 to 1.
    remaining_s
        Time still needed if it goes on as it did, s; None where nothing tells.
    """

    done: int
    total: int
    stage: str
    share: float
    remaining_s: float | None


@dataclass(frozen=True)
class JobStatus:
    """A job.

    Attributes
    ----------
    id
        32 hexadecimal digits.
    kind
        ``screening``, ``training`` or ``simulation``.
    waiting_for
        What it waits for, where it cannot go on by itself just now.
    created_at, started_at, finished_at
        UTC; None where it has not come to that.
    owner
        Name of the key that asked for it.
    priority
        1 is first, 9 last.
    attempt
        1, and one more for each retry.
    not_screened
        Blades that could not be.
    fault
        Why it failed.
    document
        All that the service said.
    """

    id: str
    kind: str
    name: str | None
    state: State
    waiting_for: str | None
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime | None
    owner: str | None
    priority: int
    attempt: int
    progress: JobProgress
    not_screened: int
    fault: Fault | None
    document: dict[str, Any] = field(repr=False, compare=False)

    @property
    def finished(self) -> bool:
        """Whether it is done, failed or cancelled."""
        return self.state.finished

    @classmethod
    def of(cls, reply: JobReply) -> JobStatus:
        """From the job document of the wire."""
        said = reply.progress
        return cls(
            id=reply.id,
            kind=reply.kind,
            name=reply.name,
            state=State(reply.state),
            waiting_for=reply.waiting_for,
            created_at=datetime.fromisoformat(reply.created_at),
            started_at=None if reply.started_at is None else datetime.fromisoformat(reply.started_at),
            finished_at=None if reply.finished_at is None else datetime.fromisoformat(reply.finished_at),
            owner=reply.owner,
            priority=reply.priority,
            attempt=reply.attempt,
            progress=JobProgress(said.done, said.total, said.stage, said.share, said.remaining_s),
            not_screened=reply.not_screened,
            fault=None if reply.error is None else Fault(**reply.error.model_dump()),
            document=reply.model_dump(),
        )

    @property
    def in_words(self) -> str:
        """What it is doing, in a few words."""
        if self.waiting_for is not None:
            return f"waiting for {self.waiting_for}"
        return self.progress.stage or self.state.value


class JobNotDone(RubscreenError):
    """A job that was waited for failed or was cancelled.

    Attributes
    ----------
    status
        The job at its end; `status.fault` says why it failed.
    """

    def __init__(self, status: JobStatus) -> None:
        self.status = status
        if (fault := status.fault) is not None:
            why = f"failed: {fault.field} = {fault.value}: {fault.remedy}"
        else:
            why = f"{status.state.value}: what it stored is kept, and a retry goes on from there"
        super().__init__(f"{status.kind} {status.id} {why}")

    def __reduce__(self):
        return type(self), (self.status,)


class StillUnderWay(RubscreenError):
    """A job was not over in the time it was waited for; it goes on.

    Attributes
    ----------
    status
        The job when it was last heard of.
    """

    def __init__(self, status: JobStatus, timeout_s: float) -> None:
        self.status, self.timeout_s = status, timeout_s
        found = f"{status.state.value}, {status.progress.done} of {status.progress.total}"
        super().__init__(
            f"{status.kind} {status.id} is not over after {timeout_s:g} s ({found}); it goes on: wait again"
        )

    def __reduce__(self):
        return type(self), (self.status, self.timeout_s)

"""Jobs on the wire, as OpenAPI shows them."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

JobState = Literal["queued", "running", "waiting", "done", "failed", "cancelled"]


class ProgressReply(BaseModel):
    """How far a job is."""

    model_config = ConfigDict(extra="forbid")

    done: int = Field(description="Blades of a screening, speeds of a simulation.")
    total: int
    stage: str
    share: float = Field(description="0 to 1.")
    remaining_s: float | None = Field(description="If it goes on as it did; null where nothing tells.")


class JobFault(BaseModel):
    """Why a job failed, or what is wrong with a blade of an upload."""

    model_config = ConfigDict(extra="forbid")

    field: str
    value: str
    remedy: str


class JobReply(BaseModel):
    """A job."""

    model_config = ConfigDict(extra="forbid")

    id: str
    kind: Literal["screening", "training", "simulation"]
    name: str | None
    state: JobState
    waiting_for: str | None = Field(description="Say room on the disk; it goes on by itself.")
    created_at: str = Field(description="UTC, ISO 8601.")
    started_at: str | None
    finished_at: str | None
    owner: str | None = Field(description="Name of the key that asked for it.")
    priority: int = Field(description="1 is first, 9 last.")
    attempt: int
    progress: ProgressReply
    not_screened: int = Field(description="Blades that could not be.")
    error: JobFault | None
    links: dict[str, str]


class JobsReply(BaseModel):
    """Jobs, newest first."""

    jobs: list[JobReply]
    next: str | None = Field(description="Where older ones are.")


class ResultReply(BaseModel):
    """One blade under one contact."""

    model_config = ConfigDict(extra="forbid")

    rank: int = Field(description="1 is the safest; provisional while the job runs.")
    blade_index: int = Field(description="Place in the request, from 0.")
    source: str
    blade: str
    contact_name: str
    contact: dict[str, Any]
    smallest_unstable_ke: float | None = Field(description="N/m; null where there is none up to ke_max.")
    speed_hz: float | None = Field(description="Where the smallest K_e destabilises, like the four below.")
    speed_rpm: float | None
    speed_ratio: float | None
    chatter_hz: float | None
    wear_lobes: float | None
    error_estimate: float | None
    proven: bool
    verdict: str | None = Field(description="Against ke_liner; null without one.")
    margin: float | None
    meets_criteria: bool | None
    criteria_missed: list[str] | None
    unstable_share: float | None
    verified_share: float | None = Field(description="Share of the map that the exact core answered.")
    speed_range_hz: list[float]
    ke_max: float
    ke_liner: float | None
    model: str | None
    solver: str
    critical_speeds: list[dict[str, float | None]]


class UnscreenedReply(BaseModel):
    """A blade that could not be screened."""

    model_config = ConfigDict(extra="forbid")

    index: int
    source: str
    name: str
    reason: str


class ResultsReply(BaseModel):
    """A page of the ranking, safest first."""

    model_config = ConfigDict(extra="forbid")

    job: str
    complete: bool = Field(description="False while the job runs: ranks are of what is there so far.")
    total: int = Field(description="Rows that fit the filters.")
    offset: int
    results: list[ResultReply]
    not_screened: list[UnscreenedReply] = Field(description="The first thousand.")
    next: str | None = Field(description="Where the next page is.")


class UploadReply(BaseModel):
    """A file of blades, to be named in `blades` of a screening."""

    model_config = ConfigDict(extra="forbid")

    id: str
    name: str
    form: str
    size_bytes: int
    sha256: str
    # An older service does not say them.
    blades: int | None = Field(None, description="In it, those that cannot be used among them.")
    fault: JobFault | None = Field(
        None,
        description="The first that cannot be used, among the first thousand: a screening refuses it, or "
        "skips it if told so. null where all of these can.",
    )


class TrainedReply(BaseModel):
    """What came of a training."""

    model_config = ConfigDict(extra="forbid")

    model: str
    promoted: bool
    refused: list[str] = Field(description="Why it was not promoted.")
    seconds: dict[str, float] = Field(description="By stage; of the last run only, where it was interrupted.")
    evaluation: dict[str, Any] = Field(description="Held-out figures by class of contact.")


class ScheduleReply(BaseModel):
    """When trainings are; all null where there is no schedule."""

    model_config = ConfigDict(extra="forbid")

    cron: str | None
    timezone: str | None
    next: str | None
    training: dict[str, Any] | None

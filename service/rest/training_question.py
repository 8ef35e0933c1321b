"""What ``POST /v1/trainings`` is asked."""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from service.jobs.training.request import TrainingRequest
from service.rest.questions import check_job_name, read_question
from service.settings import Settings

Json = dict[str, Any]
# The shipped model's; a training may be a few times larger, not a thousand.
_LARGEST = 4_000_000


class TrainingQuestion(BaseModel):
    """A retraining: how large, of what, and what becomes of its model."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    name: str | None = Field(None, max_length=200, description="In lists.")
    priority: int = Field(5, ge=1, le=9, description="1 is first.")
    seed: int | None = Field(None, ge=0, lt=2**31, description="Left out: one of its own for each training.")
    first_cases: int = Field(98_304, ge=2048, le=_LARGEST, description="Labelled before the first fit.")
    cases_each: int = Field(49_152, ge=1024, le=_LARGEST, description="Labelled in each round of asking.")
    rounds: int = Field(3, ge=0, le=50, description="Most rounds of asking.")
    epochs: int = Field(40, ge=1, le=1000)
    points: int = Field(
        200_000,
        ge=20_000,
        le=_LARGEST,
        description="Independent points of the certificate, each class of contact; 1e-4 takes 92,000.",
    )
    evaluation_points: int = Field(20_000, ge=1000, le=_LARGEST)
    threads: int = Field(2, ge=1, le=256, description="Labelling processes.")
    device: Literal["auto", "cpu", "cuda"] = "auto"
    with_served: bool = Field(False, description="Also train on what the service answered exactly.")
    promote: bool = Field(True, description="Make the model active, unless the gate refuses it.")

    @model_validator(mode="after")
    def _of_a_name_that_can_be_kept(self) -> Self:
        check_job_name(self.name)
        return self

    @classmethod
    def read(cls, data: Any, settings: Settings) -> Self:
        """The question in a parsed body; raises as `read_question`."""
        return read_question(cls, data, settings)

    def request(self, seed: int) -> TrainingRequest:
        """As the job keeps it, with this seed where none was given."""
        given = self.model_dump(exclude={"name", "priority"})
        return TrainingRequest(**{**given, "seed": seed if self.seed is None else self.seed})


class ScheduleQuestion(BaseModel):
    """Trainings again and again."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    cron: str = Field(max_length=100, description='Five fields, e.g. "0 3 * * SUN": Sundays at three.')
    timezone: str = Field("UTC", max_length=100, description='IANA name, e.g. "Europe/Paris".')
    training: Json = Field(default_factory=dict, description="As of POST /v1/trainings.")

    @classmethod
    def read(cls, data: Any, settings: Settings) -> Self:
        """The question in a parsed body; raises as `read_question`."""
        return read_question(cls, data, settings)


TRAINING_EXAMPLE: Json = {"name": "anew", "rounds": 3}
SCHEDULE_EXAMPLE: Json = {"cron": "0 3 * * SUN", "timezone": "Europe/Paris", "training": {"rounds": 2}}

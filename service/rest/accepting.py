"""From a question to a job that is on the disk."""

from __future__ import annotations

import hashlib
import json
import logging
import re
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sdm_core.errors import InvalidInput
from sdm_core.interruption import checkpoint
from service.jobs.durable_files import write_durably
from service.jobs.job import ACTIVE, SCREENING, SIMULATION, TRAINING, Job
from service.jobs.job_folder import REQUEST
from service.jobs.jobs import Jobs
from service.jobs.screening import blade_lines
from service.jobs.screening.blade_lines import BladeLine
from service.jobs.screening.checks import blades_per_chunk, check_line, under_source
from service.jobs.screening.request import ScreeningRequest
from service.jobs.simulation.chunk import speeds_per_chunk
from service.jobs.training.request import TrainingRequest
from service.jobs.uploads import Uploads
from service.rest.access import Caller
from service.rest.models_folder import models_folder
from service.rest.screening_question import ScreeningQuestion
from service.rest.simulation_question import SimulationQuestion
from service.settings import Settings
from service.simulation.order import SimulationOrder
from service.sizes import TooLarge

IDEMPOTENCY_KEY = "Idempotency-Key"
_SMALL = 100_000  # characters
logger = logging.getLogger("rubscreen.jobs")
_KEY = re.compile(r"[\x21-\x7e]{1,200}")


def checked_idempotency_key(given: str | None) -> str | None:
    """The header's value, where it can be one.

    Raises
    ------
    InvalidInput
        Naming the header.
    """
    if given is None or _KEY.fullmatch(given):
        return given
    raise InvalidInput(IDEMPOTENCY_KEY, given, "give 1 to 200 visible ASCII characters, e.g. a UUID")


def new_job(kind: str, caller: Caller, body: bytes, key: str | None, **more: Any) -> Job:
    """A job of a caller, for a request of these bytes."""
    return Job(
        uuid.uuid4().hex,
        kind,
        owner=caller.key_id,
        owner_name=None if caller.key_id is None else caller.name,
        idempotency_key=key,
        request_digest=hashlib.sha256(body).hexdigest(),
        **more,
    )


def accept_screening(
    ask: ScreeningQuestion,
    job: Job,
    jobs: Jobs,
    uploads: Uploads,
    settings: Settings,
    model: str | None,
) -> tuple[Job, bool]:
    """Look at every blade, then hand the job in.

    Parameters
    ----------
    model
        The surrogate that the whole job is screened with.

    Returns
    -------
    The job, and whether it is new.

    Raises
    ------
    InvalidInput
        Naming the blade and its field, unless bad blades are to be skipped.
    """
    ratio = ask.speed_range_ratio
    request = ScreeningRequest(
        contacts=ask.contacts,
        speed_range=ratio or ask.speed_range_hz,
        speed_unit="Hz" if ratio is None else "ratio",
        ke_max=ask.ke_max,
        ke_liner=ask.ke_liner,
        map_shape=ask.map_shape,
        policy=ask.policy,
        alpha=ask.alpha,
        criteria=ask.criteria,
        model=None if ask.policy == "exact" else model,
        models_folder=str(models_folder(settings).resolve()),
    )

    def fill(folder: Path) -> None:
        # Each blade goes to the disk as it comes: thousands of them, parsed, would not fit in memory.
        seen = blade_lines.write(folder, _lines(ask, request, uploads, job.owner, settings))
        if not seen.blades:
            raise InvalidInput("blades", "none in all that is named", "give at least one blade")
        rows = seen.blades * (3 if ask.contacts is None else len(ask.contacts))
        if rows > settings.max_job_results:
            remedy = f"give at most {settings.max_job_results} in all: split the request"
            raise TooLarge("blades x contacts", f"{rows}", remedy)
        size = blades_per_chunk(request, profiles=seen.profiles)
        document = request.to_dict() | {"blades_per_chunk": size}
        write_durably(folder / REQUEST, json.dumps(document, indent=1).encode())

    return jobs.submit(job, fill)


def screening_job(ask: ScreeningQuestion, caller: Caller, body: bytes, key: str | None) -> Job:
    """The job a question asks for, not handed in yet."""
    return new_job(SCREENING, caller, body, key, name=ask.name, priority=ask.priority)


def _lines(
    ask: ScreeningQuestion,
    request: ScreeningRequest,
    uploads: Uploads,
    owner: str | None,
    settings: Settings,
) -> Iterator[BladeLine]:
    for index, (source, document) in enumerate(ask.documents(uploads, owner, settings)):
        checkpoint()
        if index >= settings.max_job_blades:
            remedy = "split the request"
            raise TooLarge("blades", f"more than {settings.max_job_blades} blades", remedy)
        line = BladeLine(index, source, document)
        try:
            check_line(line, request, settings)
        except InvalidInput as error:
            if ask.bad_blades == "refuse":
                raise under_source(error, source) from None
            # Noted again when it runs; what is no blade is not kept, however large.
            kept = isinstance(document, dict) and len(json.dumps(document)) <= _SMALL
            line = BladeLine(index, source, document if kept else {})
        yield line


def simulation_job(ask: SimulationQuestion, caller: Caller, body: bytes, key: str | None) -> Job:
    """The job a question asks for, not handed in yet."""
    return new_job(SIMULATION, caller, body, key, name=ask.name, priority=ask.priority)


def accept_simulation(order: SimulationOrder, job: Job, jobs: Jobs) -> tuple[Job, bool]:
    """Hand a simulation in: the job, and whether it is new."""

    def fill(folder: Path) -> None:
        document = order.to_dict() | {"speeds_per_chunk": speeds_per_chunk(order)}
        write_durably(folder / REQUEST, json.dumps(document, indent=1).encode())

    return jobs.submit(job, fill)


def accept_training(request: TrainingRequest, job: Job, jobs: Jobs) -> tuple[Job, bool]:
    """Hand a training in: the job, and whether it is new."""

    def fill(folder: Path) -> None:
        write_durably(folder / REQUEST, json.dumps(request.to_dict(), indent=1).encode())

    return jobs.submit(job, fill)


def train_when_due(jobs: Jobs, at: str, context: dict[str, Any]) -> None:
    """Hand in the training of a schedule, unless the last one is not over; for one time once."""
    job = Job(
        uuid.uuid4().hex,
        TRAINING,
        name=f"scheduled {at}",
        owner=context["owner"],
        owner_name=context["owner_name"],
        idempotency_key=f"schedule {at}",
    )
    if jobs.records.of_request(job) is not None:  # by another replica, or before this one was ended
        return
    if jobs.records.page(TRAINING, states=ACTIVE, limit=1):
        logger.warning("the training due at %s is left out: one is under way", at)
        return
    asked = context["training"]
    accept_training(TrainingRequest.from_dict({**asked, "seed": asked["seed"] or seed_of(job)}), job, jobs)


def seed_of(job: Job) -> int:
    """A seed of its own for a training that was given none."""
    return int(job.id[:8], 16) % 2**31

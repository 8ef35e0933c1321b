"""What a running job is told, and tells: whether to go on, how far it is, what it waits for."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from pathlib import Path
from threading import Event
from typing import Any

from sqlalchemy.exc import SQLAlchemyError

from sdm_core.errors import Cancelled
from service.jobs.durable_queue import HandedBack
from service.jobs.job import Job, State
from service.records.jobs import JobRecords

_LOOK_EVERY_S = 1.0  # whether the job is to be cancelled
_SAY_EVERY_S = 0.5  # how far it is
logger = logging.getLogger("rubscreen.jobs")


class Control:
    """Between one running job and the rest of the service.

    Attributes
    ----------
    job
        As it was when this run began.
    folder
        Where its files are.
    waiting_for
        What it waits for now; kept here too, since a full disk may keep it from the database.
    """

    def __init__(self, job: Job, folder: Path, records: JobRecords, closing: Event) -> None:
        self.job, self.folder, self._records, self._closing = job, folder, records, closing
        self.waiting_for: str | None = None
        self._looked = self._said = 0.0
        self._unsaid: dict[str, Any] = {}

    def check(self) -> None:
        """Return where the job is to go on.

        Raises
        ------
        HandedBack
            When the process stops.
        Cancelled
            When the job is to be cancelled, or is gone.
        """
        if self._closing.is_set():
            raise HandedBack
        now = time.monotonic()
        if now - self._looked < _LOOK_EVERY_S:
            return
        self._looked = now
        try:
            found = self._records.get(self.job.id)
        except SQLAlchemyError as error:  # a database out of reach for a while stops no job
            logger.warning("job %s cannot be looked up: %s", self.job.id, error)
            return
        if found.cancel_requested or found.state.finished or found.attempt != self.job.attempt:
            raise Cancelled("the job was cancelled, or another run of it has begun")

    def sleep(self, seconds: float) -> None:
        """Wait; raises as `check`."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.check()
            self._closing.wait(min(left, _LOOK_EVERY_S))
        self.check()

    def report(self, *, now: bool = False, **progress: Any) -> None:
        """Say how far the job is (`done`, `total`, `stage`, `not_screened`); not more often than useful."""
        self._unsaid |= progress
        if not now and time.monotonic() - self._said < _SAY_EVERY_S:
            return
        self._said = time.monotonic()
        self._say(self._unsaid)

    def wait_for(self, what: str | None) -> None:
        """Say that the job waits, and what for; None: it goes on."""
        if what == self.waiting_for:
            return
        self.waiting_for = what
        logger.log(logging.WARNING if what else logging.INFO, "job %s: %s", self.job.id, what or "it goes on")
        state = State.RUNNING if what is None else State.WAITING
        self._say({"state": state, "waiting_for": what})

    def until(self, ready: Callable[[], str | None], every_s: float = 2.0) -> None:
        """Wait until `ready` gives None; what else it gives is what the job waits for."""
        while (what := ready()) is not None:
            self.wait_for(what)
            self.sleep(every_s)
        self.wait_for(None)

    def _say(self, values: dict[str, Any]) -> None:
        try:
            self._records.update(self.job.id, of_attempt=self.job.attempt, **values)
        except SQLAlchemyError as error:
            logger.warning("progress of job %s is not kept: %s", self.job.id, error)
        else:
            self._unsaid = {k: v for k, v in self._unsaid.items() if values.get(k) != v}

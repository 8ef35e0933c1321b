"""The front door: jobs are handed in, run, cancelled, retried, and taken over from replicas that are gone."""

from __future__ import annotations

import logging
import threading
import time
import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from filelock import FileLock, Timeout
from sqlalchemy.exc import SQLAlchemyError

from sdm_core.errors import Cancelled, InvalidInput
from service.jobs.calendar import Calendar
from service.jobs.control import Control
from service.jobs.durable_files import check_room, is_full
from service.jobs.durable_queue import DurableQueue, HandedBack
from service.jobs.errors import NoRoom, OtherRequest
from service.jobs.job import ACTIVE, KINDS, Fault, Job, State
from service.jobs.job_folder import JobFolder, JobFolders
from service.jobs.retention import Keep, Retention, RetentionThread
from service.records.database import Database
from service.records.jobs import JobRecords
from service.records.replicas import Replicas

logger = logging.getLogger("rubscreen.jobs")


class Kind(Protocol):
    """What the jobs of a kind do."""

    def run(self, folder: JobFolder, control: Control) -> None:
        """Do what the folder's request asks for, going on from what lies there already.

        Raises
        ------
        InvalidInput
            When it cannot be done: the job has failed.
        Cancelled, HandedBack
            As `Control.check`.
        """
        ...


@dataclass(frozen=True)
class JobSettings:
    """How jobs are run.

    Attributes
    ----------
    at_once
        By kind, how many this process runs at the same time; empty: it takes jobs and runs none.
    lease_s
        Time after which the jobs of a replica that says nothing are taken over.
    reserve_bytes
        Room that is left free on the disk.
    keep
        How long what is over is kept.
    """

    at_once: Mapping[str, int]
    lease_s: float = 30.0
    reserve_bytes: int = 64 * 2**20
    keep: Keep = field(default_factory=Keep)


class Jobs:
    """The jobs of a data folder and its database.

    Parameters
    ----------
    kinds
        What each kind of job does.
    tick
        Called with this object when a schedule is due, as of `Calendar`.

    Attributes
    ----------
    calendar
        What is done again and again.

    Raises
    ------
    InvalidInput
        When another process uses the data folder with SQLite.
    """

    def __init__(
        self,
        database: Database,
        data_folder: Path,
        kinds: Mapping[str, Kind],
        settings: JobSettings,
        tick: Callable[[Jobs, str, dict[str, Any]], None] = lambda jobs, at, context: None,
    ) -> None:
        self._database = database
        self.records, self.folders = JobRecords(database), JobFolders(data_folder)
        self._kinds, self.settings = kinds, settings
        self._replicas = Replicas(database)
        self._lock = None if database.shared else alone(data_folder)
        # On SQLite there is one process, which takes up what the one before it had begun.
        self._replica = f"replica-{uuid.uuid4().hex[:12]}" if database.shared else "alone"
        self._closing, self._running = threading.Event(), threading.Condition()
        self._controls: dict[str, Control] = {}
        self._replicas.say(self._replica)
        try:
            self.queue = DurableQueue(
                database.url,
                self._replica,
                self._run,
                settings.at_once,
                kinds=KINDS,
            )
            self.calendar = Calendar(database, partial(tick, self))
            self._adopt_schedule()
        except BaseException:
            self._release()
            raise
        self._tending = threading.Thread(target=self._tend, name="jobs", daemon=True)
        self._tending.start()
        retention = Retention(self.records, self.folders, self.queue)
        self._retention = RetentionThread(retention, data_folder, settings.keep)

    def submit(self, job: Job, fill: Callable[[Path], None]) -> tuple[Job, bool]:
        """Accept a job: when this returns, it is on the disk and will be run.

        Parameters
        ----------
        fill
            Writes the request into the folder it is given.

        Returns
        -------
        The job, and whether it is new: one asked for before under the same idempotency key is not.

        Raises
        ------
        OtherRequest
            When the idempotency key was used for something else.
        NoRoom
            When the disk is full.
        """
        before = self.records.of_request(job)
        if before is not None:
            return before, False
        check_room(self.folders.jobs, 0, self.settings.reserve_bytes)
        try:
            self.folders.make(job.id, fill)
        except OSError as error:
            if is_full(error):
                raise NoRoom("data_folder", str(self.folders.jobs), "the disk is full: make room") from None
            raise
        try:
            kept = self.records.add(job)
        except OtherRequest:
            self.folders.remove(job.id)
            raise
        # Any other fault may have come after the row was committed: then the job needs its files. Where it
        # was not, they are marked as listed nowhere, and swept away in time.
        self.folders.unmark(kept.id)
        if kept.id != job.id:  # the same request came twice at the same time
            self.folders.remove(job.id)
            return kept, False
        self._put(kept)
        return kept, True

    def get(self, job_id: str, kind: str) -> Job:
        """A job as it is now.

        Raises
        ------
        NoSuchJob
        """
        return self.as_it_is(self.records.get(job_id, kind))

    def as_it_is(self, job: Job) -> Job:
        """A job of the records, with what it waits for: a full disk keeps that from the records."""
        control = self._controls.get(job.id)
        if control is not None and control.waiting_for is not None and not job.state.finished:
            return replace(job, state=State.WAITING, waiting_for=control.waiting_for)
        return job

    def cancel(self, job_id: str, kind: str) -> Job:
        """Let a job stop as soon as it can; one that is over stays as it is."""
        self.records.get(job_id, kind)
        now = datetime.now(UTC)
        at_once: dict[str, Any] = {"state": State.CANCELLED, "finished_at": now, "cancel_requested": True}
        if not self.records.update(job_id, only=(State.QUEUED,), **at_once):
            self.records.update(job_id, cancel_requested=True)
        return self.get(job_id, kind)

    def retry(self, job_id: str, kind: str) -> Job:
        """Queue a job that is over again; what it had stored stays.

        Raises
        ------
        NoSuchJob, UnderWay
        """
        self.records.get(job_id, kind)
        job = self.records.start_again(job_id)
        self._put(job)
        return job

    def running(self) -> int:
        """Jobs that this process runs now."""
        return len(self._controls)

    def close(self, patience_s: float = 20.0) -> None:
        """Stop; what runs is handed back within moments, for another process or the next start."""
        self._closing.set()
        self._retention.close()
        self._tending.join(patience_s)
        with self._running:
            gone = self._running.wait_for(lambda: not self._controls, patience_s)
        if not gone:
            logger.error("jobs that did not stop: %s", ", ".join(self._controls))
        # The queue asks a database that is gone again and again: it gets so long, and no longer.
        there = self._database.answers()
        closer = threading.Thread(target=self.queue.close, args=(gone and there,), daemon=True)
        closer.start()
        closer.join(patience_s)
        if closer.is_alive():
            logger.error("the queue does not close: what was begun here is taken over after the lease")
        elif gone and there:
            self._replicas.forget(self._replica)
        self._release()

    def _put(self, job: Job) -> None:
        try:
            self.queue.put(job.id, job.attempt, job.kind, job.priority)
        except Exception as error:  # its row is there: `_tend` will put it
            logger.warning("job %s is queued later: %s", job.id, error)

    def _run(self, job_id: str) -> None:
        """One run of a job, in a thread of the queue."""
        job = self.records.get(job_id)
        if job.state.finished:
            return
        folder = self.folders.of(job_id)
        control = Control(job, folder.path, self.records, self._closing)
        with self._running:
            if job_id in self._controls:
                return
            self._controls[job_id] = control
        try:
            self._end(job, folder, self._outcome(job, folder, control))
        finally:
            with self._running:
                del self._controls[job_id]
                self._running.notify_all()

    def _outcome(self, job: Job, folder: JobFolder, control: Control) -> tuple[State, Fault | None]:
        try:
            control.check()
            started = job.started_at or datetime.now(UTC)
            if not self._kept(job, state=State.RUNNING, started_at=started, waiting_for=None):
                raise Cancelled("the job was cancelled before it began")
            folder.note(event="begun", attempt=job.attempt, replica=self._replica)
            self._kinds[job.kind].run(folder, control)
        except Cancelled:
            return State.CANCELLED, None
        except InvalidInput as error:
            return State.FAILED, Fault(error.field, error.value, error.remedy)
        except Exception as error:
            logger.exception("job %s failed", job.id)
            remedy = "retry it; if it fails again, report it with the service's log"
            return State.FAILED, Fault("job", f"{type(error).__name__}: {error}"[:500], remedy)
        return State.DONE, None

    def _end(self, job: Job, folder: JobFolder, outcome: tuple[State, Fault | None]) -> None:
        state, fault = outcome
        folder.note(event=state.value, attempt=job.attempt)
        ended = datetime.now(UTC)
        self._kept(job, state=state, fault=fault, finished_at=ended, waiting_for=None)

    def _kept(self, job: Job, **values: Any) -> bool:
        """Change the row of a run, however long the database takes; whether it still is this run's."""
        while True:
            try:
                return self.records.update(job.id, of_attempt=job.attempt, **values)
            except SQLAlchemyError as error:  # a full disk, a database that is restarted
                logger.warning("the state of job %s is not kept yet: %s", job.id, error)
                if self._closing.wait(2.0):
                    raise HandedBack from None

    def _tend(self) -> None:
        """Say that this replica lives; take over from those that do not; queue what is not queued."""
        every, turn = min(5.0, self.settings.lease_s / 4), 0
        while True:
            try:
                if turn % 4 == 0:
                    self._queue_forgotten()
                self._replicas.say(self._replica)
                for silent in self._replicas.silent(self.settings.lease_s, but=self._replica):
                    logger.warning("%s says nothing any more: its jobs are taken over", silent)
                    self.queue.take_over(silent)
                    self._replicas.forget(silent)
            except Exception as error:  # whatever it is, the next turn may do better
                logger.warning("jobs are not tended: %s", error)
            try:
                self.calendar.look()
            except Exception as error:  # tried again at the next turn
                logger.warning("what is due by the calendar is not handed in yet: %s", error)
            turn += 1
            if self._closing.wait(every):
                return

    def _adopt_schedule(self) -> None:
        """Keep the schedule that an older version left to the queue; what ends in between begins again."""
        former = self.queue.former_schedule()
        if former is not None:
            self.calendar.schedule(former.cron, former.timezone, former.context, former.done_to)
            self.queue.forget_former_schedule()

    def _queue_forgotten(self) -> None:
        """Queue jobs that were accepted, but whose process ended before they were in the queue."""
        self.queue.untold()  # or its list of them would grow for ever
        for job in self.records.unfinished():
            over = self.queue.over(job.id, job.attempt)
            if over is None:
                self._put(job)
            elif over and job.id not in self._controls and self._still(job):
                # The run ended and could not say how: it is begun again, over what it stored.
                self.records.update(job.id, only=ACTIVE, attempt=job.attempt + 1)
                self._put(self.records.get(job.id))

    def _still(self, job: Job) -> bool:
        time.sleep(0.1)  # between the run's last word and the queue's
        return not self.records.get(job.id).state.finished

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.release()


def alone(data_folder: Path) -> FileLock:
    """Hold the data folder, for one process.

    Raises
    ------
    InvalidInput
        When another one does.
    """
    lock = FileLock(data_folder / ".lock")
    try:
        lock.acquire(timeout=5.0)
    except Timeout:
        remedy = (
            "another service uses it: stop that one, give another folder, or give both the same "
            "PostgreSQL (RUBSCREEN_DATABASE_URL)"
        )
        raise InvalidInput("data_folder", str(data_folder), remedy) from None
    return lock

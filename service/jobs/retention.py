"""How long jobs and uploads are kept: what is older is deleted, and what a kill left of a deletion.

A job goes row first. The row is deleted only if it says that the job is over, in one statement, so whoever
retries it at that moment either finds no job or keeps it whole. Its folder is marked before, so that a kill
in between leaves a folder that may be deleted later, though no row leads to it any more (decision 22).
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Protocol

from filelock import FileLock, Timeout
from sqlalchemy.exc import SQLAlchemyError

from sdm_core.errors import InvalidInput
from service.jobs.job import Job
from service.jobs.job_folder import JobFolders
from service.jobs.uploads import old_uploads, remove_uploads
from service.records.jobs import JobRecords

EVERY_S = 3600.0
_LOCK = ".retention.lock"
logger = logging.getLogger("rubscreen.jobs")


@dataclass(frozen=True)
class Keep:
    """How long what is over is kept, in days; 0 is for good.

    Raises
    ------
    InvalidInput
        When one is below 0.
    """

    jobs_days: float = 0.0
    uploads_days: float = 0.0

    def __post_init__(self) -> None:
        for field, days in vars(self).items():
            if not 0.0 <= days < 1e6:
                raise InvalidInput(field, days, "give a number of days; 0 keeps them for good")


@dataclass(frozen=True)
class Old:
    """What is kept no longer.

    Attributes
    ----------
    jobs
        Over before `moment`.
    uploads
        Folders of files sent ahead before `uploads_moment`.
    """

    moment: datetime
    uploads_moment: datetime
    jobs: tuple[Job, ...]
    uploads: tuple[Path, ...]


class Runs(Protocol):
    """What retention asks of the queue."""

    def forget(self, job_id: str, attempts: int) -> None:
        """Remove the runs of a job."""
        ...

    def forget_orphans(self, known: Callable[[list[str]], set[str]]) -> int:
        """Remove runs that are over and whose job is not `known`; how many."""
        ...


class Retention:
    """Deletes what is old under a data folder.

    Safe beside running services, other replicas and itself: each job is claimed by the deletion of its row.

    Parameters
    ----------
    runs
        The queue; None leaves its rows to the service, which removes those of jobs that are gone.
    """

    def __init__(self, records: JobRecords, folders: JobFolders, runs: Runs | None = None) -> None:
        self._records, self._folders, self._runs = records, folders, runs

    def old(self, keep: Keep, now: datetime | None = None) -> Old:
        """What would be deleted."""
        now = now or datetime.now(UTC)
        moment, uploads_moment = (now - timedelta(days=days) for days in (keep.jobs_days, keep.uploads_days))
        jobs = tuple(self._records.finished_before(moment)) if keep.jobs_days else ()
        uploads: tuple[Path, ...] = ()
        if keep.uploads_days:
            uploads = tuple(old_uploads(self._folders.uploads, uploads_moment))
        return Old(moment, uploads_moment, jobs, uploads)

    def delete(self, old: Old, go_on: Callable[[], bool] = lambda: True) -> Iterator[Job]:
        """Delete what `old` names, uploads first; each job that went.

        Parameters
        ----------
        go_on
            Asked before each job.
        """
        remove_uploads(old.uploads, old.uploads_moment)
        for job in old.jobs:
            if not go_on():
                return
            if self.remove(job, old.moment):
                yield job

    def remove(self, job: Job, over_before: datetime) -> bool:
        """Forget a job and its files if it was over before that time; whether it was."""
        self._folders.mark(job.id)
        if not self._records.remove_over(job.id, over_before):
            self._folders.unmark(job.id)
            return False
        self._folders.remove(job.id)
        if self._runs is not None:
            self._runs.forget(job.id, job.attempt)
        return True

    def tidy(self) -> None:
        """Remove what kills left: files half made or half removed, folders and runs of no job."""
        self._folders.sweep()
        self._folders.sweep_marked(self._records.known)
        if self._runs is not None:
            self._runs.forget_orphans(self._records.known)


class RetentionThread:
    """Deletes what is old at the start and every hour, unless somebody else does or a backup is made.

    A thread of its own: to delete a large job may take longer than a replica may be silent.
    """

    def __init__(self, retention: Retention, data_folder: Path, keep: Keep) -> None:
        self._retention, self._data, self._keep = retention, data_folder, keep
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._work, name="retention", daemon=True)
        self._thread.start()

    def close(self, patience_s: float = 5.0) -> None:
        """Stop; what is being removed has lost its name already, and is removed the next time."""
        self._closing.set()
        self._thread.join(patience_s)

    def _work(self) -> None:
        while True:
            try:
                self._round()
            except (OSError, SQLAlchemyError, InvalidInput) as error:
                logger.warning("what is old is not deleted yet: %s", error)
            except Exception:  # the queue has errors of its own; the next hour may do better
                logger.exception("what is old is not deleted yet")
            if self._closing.wait(EVERY_S):
                return

    def _round(self) -> None:
        try:
            with nothing_deleted(self._data, wait_s=0.0):
                self._retention.tidy()
                old = self._retention.old(self._keep)
                gone = sum(1 for _ in self._retention.delete(old, lambda: not self._closing.is_set()))
        except Busy:
            return
        if gone or old.uploads:
            logger.info("retention deleted %d jobs and %d uploads", gone, len(old.uploads))


class Busy(InvalidInput):
    """Somebody else deletes what is old, or makes a backup."""


@contextmanager
def nothing_deleted(data_folder: Path, wait_s: float) -> Iterator[None]:
    """Within this block nobody else deletes jobs of a data folder: for who does, and for who copies it.

    Raises
    ------
    Busy
        When another process holds it longer than `wait_s`.
    """
    lock = FileLock(data_folder / _LOCK)
    try:
        lock.acquire(timeout=wait_s)
    except Timeout:
        remedy = "a backup is being made, or what is old is being deleted: wait until it is done"
        raise Busy("data_folder", str(data_folder), remedy) from None
    except OSError as error:
        remedy = f"it cannot be written ({error.strerror}): ask as the user that the service runs as"
        raise InvalidInput("data_folder", str(data_folder), remedy) from None
    try:
        yield
    finally:
        lock.release()

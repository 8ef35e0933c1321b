"""The durable queue: which jobs wait, by priority, and which process runs them (DBOS on the database).

A job's run is one DBOS workflow without steps: what it has done so far lies in its files, so a run that
begins again finds them there and goes on (decision 21). DBOS is one to a process, and so is this.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from dbos import DBOS, DBOSConfig, Serializer, SetEnqueueOptions, SetWorkflowID
from sqlalchemy.engine import URL
from sqlalchemy.exc import SQLAlchemyError

from service.records.database import PATIENCE

# Of what is in the queue, not of the code: jobs accepted by an older program run on a newer one.
QUEUE_VERSION = "1"
SCHEMA = "rubscreen_queue"  # of PostgreSQL
_WORKFLOW = "job"
# Older versions left the calendar to DBOS: the workflow it began, and the schedule's name.
_DUE, _SCHEDULE = "due", "training"
# A job killed more often than this by its process's end is given up by DBOS.
_MOST_RECOVERIES = 10_000
_PAGE = 500
_OVER = ("SUCCESS", "ERROR", "CANCELLED", "MAX_RECOVERY_ATTEMPTS_EXCEEDED")
logging.getLogger("dbos").setLevel(logging.WARNING)
logger = logging.getLogger("rubscreen.jobs")


class HandedBack(BaseException):
    """The process stops: the run ends here, and another goes on with the job.

    Not an Exception, so that neither a job nor the queue takes it for the job's own failure.
    """


@dataclass(frozen=True)
class FormerSchedule:
    """A schedule that an older version made.

    Attributes
    ----------
    done_to
        The last time it was begun at; None where it never was.
    """

    cron: str
    timezone: str
    context: dict[str, Any]
    done_to: datetime | None


class _Json(Serializer):
    """Nothing is pickled."""

    def serialize(self, data: Any) -> str:
        if isinstance(data, BaseException):
            data = {"error": repr(data)}
        return json.dumps(data, default=_plain)

    def deserialize(self, serialized_data: str) -> Any:
        data = json.loads(serialized_data)
        if isinstance(data, dict) and "args" in data:
            data["args"] = tuple(data["args"])
        return data

    def name(self) -> str:
        return "rubscreen_json"


class DurableQueue:
    """A queue a kind of job, run by threads of this process.

    Parameters
    ----------
    url
        Of the database; SQLite takes a file of its own beside it.
    replica
        Name of this process: what it has begun is its own until another takes it over.
    run
        Runs the job of an identifier; raises nothing but `HandedBack`.
    at_once
        By kind, how many jobs this process runs at once; empty runs none.
    poll_s
        How often the queue is looked at.
    """

    def __init__(
        self,
        url: URL,
        replica: str,
        run: Callable[[str], None],
        at_once: Mapping[str, int],
        *,
        kinds: tuple[str, ...],
        poll_s: float = 0.5,
    ) -> None:
        config: DBOSConfig = {
            "name": "rubscreen",
            "system_database_url": _queue_url(url),
            "application_version": QUEUE_VERSION,
            "executor_id": replica,
            "dbos_system_schema": SCHEMA,
            "serializer": _Json(),
            "log_level": "WARNING",
            "enable_otlp": False,
            "use_listen_notify": False,
            "scheduler_polling_interval_sec": 60.0,
            "sys_db_pool_size": 10,
        }
        if not url.drivername.startswith("sqlite"):
            # No statement_timeout: a newer DBOS may have large tables to change when it starts.
            named = {"application_name": "rubscreen_queue"}
            config["db_engine_kwargs"] = {"connect_args": PATIENCE | named}

        self._begun: set[str] = set()

        def job(job_id: str) -> None:
            self._begun.add(mine := str(DBOS.workflow_id))
            try:
                run(job_id)
            except HandedBack:
                self._begun.discard(mine)
                raise

        def due(at: Any, context: Any) -> None:
            """What an older version began by the calendar just ends: the calendar begins it itself."""

        DBOS(config=config)
        try:
            DBOS.workflow(name=_DUE)(due)
            registered = DBOS.workflow(name=_WORKFLOW, max_recovery_attempts=_MOST_RECOVERIES)(job)
            DBOS.listen_queues([kind for kind in kinds if kind in at_once])
            DBOS.launch()
            for kind in kinds:
                DBOS.register_queue(
                    kind, worker_concurrency=at_once.get(kind, 1), polling_interval_sec=poll_s
                )
        except BaseException:
            DBOS.destroy(destroy_registry=True)
            raise
        self._workflow, self._replica = registered, replica

    def put(self, job_id: str, attempt: int, kind: str, priority: int) -> None:
        """Queue a run of a job; a run that is there already stays as it is."""
        with SetWorkflowID(_run_id(job_id, attempt)), SetEnqueueOptions(priority=priority):
            DBOS.enqueue_workflow(kind, self._workflow, job_id)

    def over(self, job_id: str, attempt: int) -> bool | None:
        """Whether a run has come to its end; None where the queue knows of none."""
        status = DBOS.get_workflow_status(_run_id(job_id, attempt))
        return None if status is None else status.status in _OVER

    def take_over(self, replica: str) -> None:
        """Queue again what a replica had begun; harmless when asked twice."""
        # DBOS leaves this to its supervisor, Conductor, and has no public call for it.
        DBOS._recover_pending_workflows([replica])

    def forget(self, job_id: str, attempts: int) -> None:
        """Remove the runs of a job."""
        for attempt in range(1, attempts + 1):
            if DBOS.get_workflow_status(_run_id(job_id, attempt)) is not None:
                DBOS.delete_workflow(_run_id(job_id, attempt))

    def forget_orphans(self, known: Callable[[list[str]], set[str]]) -> int:
        """Remove runs that are over and whose job is gone, and what older versions began by the calendar.

        Parameters
        ----------
        known
            Those of some jobs that are there.

        Returns
        -------
        How many were removed.
        """
        # Listed whole before any is removed: pages would shift.
        runs = _listed(_WORKFLOW)
        there: set[str] = set()
        for i in range(0, len(runs), _PAGE):
            there |= known(sorted({_job_id(run) for run in runs[i : i + _PAGE]}))
        orphans = [run for run in runs if _job_id(run) not in there]
        orphans += _listed(_DUE)
        for i in range(0, len(orphans), _PAGE):
            DBOS.delete_workflows(orphans[i : i + _PAGE])
        return len(orphans)

    def former_schedule(self) -> FormerSchedule | None:
        """The schedule that an older version left; None where it left none."""
        found = DBOS.get_schedule(_SCHEDULE)
        if found is None:
            return None
        last = found["last_fired_at"]
        return FormerSchedule(
            found["schedule"],
            found["cron_timezone"] or "UTC",
            found["context"],
            None if last is None else datetime.fromisoformat(last),
        )

    def forget_former_schedule(self) -> None:
        """It is kept elsewhere now."""
        DBOS.delete_schedule(_SCHEDULE)

    def close(self, hand_back: bool = True, patience_s: float = 5.0) -> None:
        """Stop taking jobs, and give back what was begun; each run has ended, by `HandedBack` or else."""
        try:
            if hand_back:
                # A run that came to its end must be known to have, before what has no end is given back:
                # given back too, its thread would wait for an end told by others, for ever.
                until = time.monotonic() + patience_s
                while self.untold() and time.monotonic() < until:
                    time.sleep(0.05)
                self.take_over(self._replica)
        except SQLAlchemyError as error:  # found out by the lease, then
            logger.warning("what was begun is not given back: %s", error)
        finally:
            DBOS.destroy(destroy_registry=True)

    def untold(self) -> set[str]:
        """Runs of this process whose end, if they have come to it, the queue does not know yet.

        Not to be called by a run: the queue would keep its asking as part of it.
        """
        for begun in list(self._begun):
            status = DBOS.get_workflow_status(begun)
            if status is None or status.status in _OVER:
                self._begun.discard(begun)
        return self._begun


def _plain(value: Any) -> str:
    """Of all that is no JSON only times come here."""
    if isinstance(value, datetime):
        return value.isoformat()
    raise TypeError(f"{type(value).__name__} is not kept in the queue")


def _run_id(job_id: str, attempt: int) -> str:
    return f"{job_id}-{attempt}"


def _job_id(run_id: str) -> str:
    return run_id.rpartition("-")[0]


def _listed(workflow: str) -> list[str]:
    """Identifiers of the runs of a workflow that are over, oldest first."""
    found: list[str] = []
    while True:
        page = DBOS.list_workflows(
            name=workflow,
            status=list(_OVER),
            limit=_PAGE,
            offset=len(found),
            load_input=False,
            load_output=False,
        )
        found += [run.workflow_id for run in page]
        if len(page) < _PAGE:
            return found


def queue_file(database: Path) -> Path:
    """The queue's file beside a SQLite database: in one, two kinds of writers would wait for each other."""
    return database.with_name(f"{database.name}-queue")


def _queue_url(url: URL) -> str:
    if url.drivername.startswith("sqlite"):
        url = url.set(database=str(queue_file(Path(url.database or ""))))
    return url.render_as_string(hide_password=False)

"""The durable queue: which jobs wait, by priority, and which process runs them (DBOS on the database).

A job's run is one DBOS workflow without steps: what it has done so far lies in its files, so a run that
begins again finds them there and goes on (decision 21). DBOS is one to a process, and so is this.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping
from typing import Any

from dbos import DBOS, DBOSConfig, Serializer, SetEnqueueOptions, SetWorkflowID
from sqlalchemy.engine import URL

# Of what is in the queue, not of the code: jobs accepted by an older program run on a newer one.
QUEUE_VERSION = "1"
_SCHEMA, _WORKFLOW = "rubscreen_queue", "job"
# A job killed more often than this by its process's end is given up by DBOS.
_MOST_RECOVERIES = 10_000
_OVER = ("SUCCESS", "ERROR", "CANCELLED", "MAX_RECOVERY_ATTEMPTS_EXCEEDED")
logging.getLogger("dbos").setLevel(logging.WARNING)


class HandedBack(BaseException):
    """The process stops: the run ends here, and another goes on with the job.

    Not an Exception, so that neither a job nor the queue takes it for the job's own failure.
    """


class _Json(Serializer):
    """Nothing is pickled."""

    def serialize(self, data: Any) -> str:
        if isinstance(data, BaseException):
            data = {"error": repr(data)}
        return json.dumps(data)

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
            "dbos_system_schema": _SCHEMA,
            "serializer": _Json(),
            "log_level": "WARNING",
            "enable_otlp": False,
            "use_listen_notify": False,
            "scheduler_polling_interval_sec": 5.0,
            "sys_db_pool_size": 10,
        }

        def job(job_id: str) -> None:
            run(job_id)

        DBOS(config=config)
        try:
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
        # Public recovery needs DBOS's own paid supervisor; this is what it calls.
        DBOS._recover_pending_workflows([replica])

    def forget(self, job_id: str, attempts: int) -> None:
        """Remove the runs of a job."""
        for attempt in range(1, attempts + 1):
            if DBOS.get_workflow_status(_run_id(job_id, attempt)) is not None:
                DBOS.delete_workflow(_run_id(job_id, attempt))

    def close(self, hand_back: bool = True) -> None:
        """Stop taking jobs, and give back what was begun; the runs must have ended by `HandedBack`."""
        if hand_back:
            self.take_over(self._replica)
        DBOS.destroy(destroy_registry=True)


def _run_id(job_id: str, attempt: int) -> str:
    return f"{job_id}-{attempt}"


def _queue_url(url: URL) -> str:
    if url.drivername.startswith("sqlite"):
        # A file of its own: two writers with transactions of their own would wait for each other.
        url = url.set(database=f"{url.database}-queue")
    return url.render_as_string(hide_password=False)

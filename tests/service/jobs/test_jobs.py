"""The front door, with jobs that only count: queued, run, cancelled, retried, handed back, taken over."""

from __future__ import annotations

import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from postgres_server import needs_postgres

from sdm_core.errors import InvalidInput
from service.jobs.control import Control
from service.jobs.errors import NoRoom, UnderWay
from service.jobs.job import SCREENING, TRAINING, Job, State
from service.jobs.job_folder import JobFolder
from service.jobs.jobs import Jobs, JobSettings
from service.records.database import PATIENCE, Database, database_url


class Counting:
    """Counts to ten in a file, so that what was done is seen by the run after it."""

    def __init__(self, pause_s: float = 0.0) -> None:
        self.pause_s, self.failure = pause_s, None
        self.gate = threading.Event()
        self.gate.set()
        self.order: list[str] = []

    def run(self, folder: JobFolder, control: Control) -> None:
        self.order.append(control.job.name or "")
        path = folder.path / "count"
        count = int(path.read_text()) if path.exists() else 0
        while count < 10:
            control.check()
            while not self.gate.is_set():
                control.sleep(0.05)
            if self.failure is not None:
                raise self.failure
            control.sleep(self.pause_s)
            count += 1
            path.write_text(str(count))
            folder.note(event="counted", to=count)
            control.report(done=count, total=10)
        control.report(now=True)


def of_the_name(name: str = "", **more) -> Job:
    return Job(uuid.uuid4().hex, SCREENING, name=name, **more)


def nothing(folder: Path) -> None:
    (folder / "request.json").write_text("{}")


@contextmanager
def jobs_of(database: Database, folder: Path, kind: Counting, **settings) -> Iterator[Jobs]:
    settings = {"at_once": {SCREENING: 1, TRAINING: 1}, "reserve_bytes": 0} | settings
    jobs = Jobs(database, folder, {SCREENING: kind, TRAINING: kind}, JobSettings(**settings))
    try:
        yield jobs
    finally:
        jobs.close()


def until(jobs: Jobs, job: Job, *states: State, patience_s: float = 30.0) -> Job:
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        found = jobs.get(job.id, job.kind)
        if found.state in states:
            return found
        time.sleep(0.02)
    raise AssertionError(found)


def wait_for(what: Callable[[], bool], patience_s: float = 30.0) -> None:
    end = time.monotonic() + patience_s
    while not what():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_job_runs_to_its_end(database, tmp_path):
    with jobs_of(database, tmp_path, Counting()) as jobs:
        accepted, new = jobs.submit(of_the_name(), nothing)
        assert new and accepted.state is State.QUEUED
        done = until(jobs, accepted, State.DONE)
        assert (done.done, done.total, done.share) == (10, 10, 1.0)
        assert done.created_at <= done.started_at <= done.finished_at


def test_a_job_goes_on_where_a_stopped_process_left_it(database, tmp_path):
    kind = Counting(pause_s=0.05)
    with jobs_of(database, tmp_path, kind) as jobs:
        accepted, _ = jobs.submit(of_the_name(), nothing)
        wait_for(lambda: (jobs.folders.of(accepted.id).path / "count").exists())
    assert 0 < int((tmp_path / "jobs" / accepted.id / "count").read_text()) < 10
    with jobs_of(database, tmp_path, kind) as jobs:
        until(jobs, accepted, State.DONE)
        counted = [note["to"] for note in jobs.folders.of(accepted.id).notes() if note["event"] == "counted"]
    assert counted == list(range(1, 11))


def test_priority_decides_which_queued_job_is_next(database, tmp_path):
    kind = Counting()
    kind.gate.clear()
    with jobs_of(database, tmp_path, kind) as jobs:
        first, _ = jobs.submit(of_the_name("first"), nothing)
        until(jobs, first, State.RUNNING)
        late = [jobs.submit(of_the_name(f"priority {p}", priority=p), nothing)[0] for p in (9, 5, 1)]
        kind.gate.set()
        for job in late:
            until(jobs, job, State.DONE)
    assert kind.order == ["first", "priority 1", "priority 5", "priority 9"]


def test_a_cancelled_job_stops_and_a_retry_goes_on_from_there(database, tmp_path):
    kind = Counting(pause_s=0.2)
    with jobs_of(database, tmp_path, kind) as jobs:
        accepted, _ = jobs.submit(of_the_name(), nothing)
        wait_for(lambda: (jobs.folders.of(accepted.id).path / "count").exists())
        with pytest.raises(UnderWay):
            jobs.retry(accepted.id, SCREENING)
        jobs.cancel(accepted.id, SCREENING)
        stopped = until(jobs, accepted, State.CANCELLED)
        assert stopped.finished_at is not None
        kind.pause_s = 0.0
        assert jobs.retry(accepted.id, SCREENING).attempt == 2
        until(jobs, accepted, State.DONE)
        counted = [note["to"] for note in jobs.folders.of(accepted.id).notes() if note["event"] == "counted"]
    assert counted == list(range(1, 11))


def test_a_job_cancelled_in_the_queue_never_runs(database, tmp_path):
    kind = Counting()
    kind.gate.clear()
    with jobs_of(database, tmp_path, kind) as jobs:
        first, _ = jobs.submit(of_the_name("first"), nothing)
        second, _ = jobs.submit(of_the_name("second"), nothing)
        assert jobs.cancel(second.id, SCREENING).state is State.CANCELLED
        kind.gate.set()
        until(jobs, first, State.DONE)
        time.sleep(1.5)
    assert kind.order == ["first"]


@pytest.mark.parametrize(
    ("failure", "field"),
    [(InvalidInput("model", "x", "name another"), "model"), (ZeroDivisionError("0"), "job")],
)
def test_a_failure_says_what_and_a_retry_may_do_better(tmp_path, failure, field):
    kind = Counting()
    kind.failure = failure
    database = Database(database_url(None, tmp_path))
    with jobs_of(database, tmp_path, kind) as jobs:
        accepted, _ = jobs.submit(of_the_name(), nothing)
        failed = until(jobs, accepted, State.FAILED)
        assert failed.fault.field == field and failed.fault.remedy
        kind.failure = None
        jobs.retry(accepted.id, SCREENING)
        assert until(jobs, accepted, State.DONE).fault is None


def test_a_job_accepted_but_not_queued_when_its_process_ended_is_run_by_the_next(
    database, tmp_path, monkeypatch
):
    kind = Counting()
    with jobs_of(database, tmp_path, kind, at_once={}) as jobs:
        monkeypatch.setattr(jobs, "_put", lambda job: None)  # as if killed just before
        accepted, _ = jobs.submit(of_the_name(), nothing)
    with jobs_of(database, tmp_path, kind) as jobs:
        until(jobs, accepted, State.DONE)


def test_what_cannot_be_written_is_not_accepted(database, tmp_path):
    def fails(folder: Path) -> None:
        nothing(folder)
        raise OSError(28, "No space left on device")

    with jobs_of(database, tmp_path, Counting(), at_once={}) as jobs:
        with pytest.raises(NoRoom):
            jobs.submit(of_the_name(), fails)
        assert jobs.records.page(SCREENING) == []
        assert list(jobs.folders.jobs.iterdir()) == []
    with jobs_of(database, tmp_path, Counting(), at_once={}, reserve_bytes=2**62) as jobs:
        with pytest.raises(NoRoom, match="must be free"):
            jobs.submit(of_the_name(), nothing)
        assert jobs.records.page(SCREENING) == []


def test_two_processes_do_not_share_a_folder_with_sqlite(tmp_path):
    database = Database(database_url(None, tmp_path))
    with (
        jobs_of(database, tmp_path, Counting()),
        pytest.raises(InvalidInput, match="another service uses it"),
    ):
        Jobs(database, tmp_path, {}, JobSettings({}))


@needs_postgres
def test_nothing_in_the_queue_is_pickled(postgres_url, tmp_path):
    import psycopg

    database = Database(database_url(postgres_url, tmp_path))
    with jobs_of(database, tmp_path, Counting()) as jobs:
        accepted, _ = jobs.submit(of_the_name(), nothing)
        until(jobs, accepted, State.DONE)
        wait_for(lambda: jobs.queue.over(accepted.id, 1) is True)
        with psycopg.connect(postgres_url) as connection:
            asked = "select table_name from information_schema.tables where table_schema = 'rubscreen_queue'"
            tables = [row[0] for row in connection.execute(asked).fetchall()]
            rows = [
                str(row)
                for table in tables
                for row in connection.execute(f"select * from rubscreen_queue.{table}").fetchall()
            ]
    database.close()
    assert any('"args": ["' + accepted.id in row for row in rows)
    assert not any("gASV" in row for row in rows)  # how a pickle begins, in base64


@needs_postgres
def test_connections_of_the_queue_give_up_a_server_that_hangs_as_ours_do(postgres_url, tmp_path):
    from dbos._dbos import _get_dbos_instance

    database = Database(database_url(postgres_url, tmp_path))
    with jobs_of(database, tmp_path, Counting()):
        for engine in (database.engine, _get_dbos_instance()._sys_db.engine):
            with engine.connect() as connection:
                told = connection.connection.driver_connection.info.get_parameters()
                assert {name: int(told[name]) for name in PATIENCE} == PATIENCE
                assert PATIENCE["connect_timeout"] < 10 and PATIENCE["tcp_user_timeout"] <= 10_000
    database.close()

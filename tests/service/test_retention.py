"""What is old is deleted, and nothing else; whatever moment a deletion is killed at."""

from __future__ import annotations

import json
import os
import sqlite3
import time
import uuid
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sdm_core.errors import InvalidInput
from service import cli
from service.jobs import job_folder
from service.jobs.durable_files import write_durably
from service.jobs.job import ACTIVE, FINISHED, SCREENING, TRAINING, Job, State
from service.jobs.job_folder import JobFolders
from service.jobs.jobs import Jobs, JobSettings
from service.jobs.retention import Busy, Keep, Retention, nothing_deleted
from service.jobs.uploads import JSON, Uploads
from service.records.database import Database, open_database
from service.records.jobs import JobRecords

DAY = timedelta(days=1)
NOW = datetime.now(UTC)


class Office:
    """A data folder with its records, and jobs of any age."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.database = folder, open_database(folder)
        self.records, self.folders = JobRecords(self.database), JobFolders(folder)
        self.retention = Retention(self.records, self.folders)

    def job(self, state: State, age: timedelta = 100 * DAY, kind: str = SCREENING) -> Job:
        """A job that ended, or else began, so long ago; its files say which it is."""
        at = NOW - age
        job = Job(uuid.uuid4().hex, kind, state=state, created_at=at, started_at=at)
        job = replace(job, finished_at=at) if state in FINISHED else job

        def fill(path: Path) -> None:
            (path / "chunks").mkdir()
            write_durably(path / "chunks" / "000000.npz", job.id.encode() * 1000)
            write_durably(path / "request.json", json.dumps({"of": job.id}).encode())

        self.folders.make(job.id, fill)
        self.records.add(job)
        self.folders.unmark(job.id)
        return job

    def upload(self, age: timedelta, content: bytes | None = None) -> str:
        writer = Uploads(self.folders.uploads, 10**6, 0).begin()
        writer.write(content or uuid.uuid4().bytes)
        upload = writer.whole("blades.json", JSON)
        writer.keep(upload)
        about = self.folders.uploads / upload.id / "about.json"
        os.utime(about, ((NOW - age).timestamp(),) * 2)
        return upload.id

    def prune(self, **days: float) -> set[str]:
        return {job.id for job in self.retention.delete(self.retention.old(Keep(**days), NOW))}

    def rows(self) -> dict[str, tuple]:
        with sqlite3.connect(self.folder / "rubscreen.sqlite") as there:
            return {row[0]: row for row in there.execute("select * from rubscreen_jobs")}

    def files(self) -> dict[str, bytes]:
        found = (path for path in sorted(self.folder.rglob("*")) if path.is_file())
        return {
            str(path.relative_to(self.folder)): path.read_bytes()
            for path in found
            if path.relative_to(self.folder).parts[0] in ("jobs", "uploads")
        }


@pytest.fixture
def office(tmp_path: Path) -> Iterator[Office]:
    made = Office(tmp_path / "data")
    yield made
    made.database.close()


def test_what_is_older_than_is_kept_goes_and_all_else_stays_bit_for_bit(office):
    for age in (89 * DAY, 10 * DAY, timedelta()):
        for state in FINISHED:
            office.job(state, age)
        office.upload(min(age, 6 * DAY))
    for state in ACTIVE:
        office.job(state, 1000 * DAY)
        office.job(state, 1000 * DAY, TRAINING)
    rows, files = office.rows(), office.files()
    old = {office.job(state, 91 * DAY, kind).id for state in FINISHED for kind in (SCREENING, TRAINING)}
    office.upload(8 * DAY)
    assert len(office.files()) == len(files) + 2 * len(old) + 2

    assert office.prune(jobs_days=90.0, uploads_days=7.0) == old

    assert office.rows() == rows
    assert office.files() == files


def test_nothing_goes_where_all_is_kept_for_good(office):
    office.job(State.DONE, 10_000 * DAY)
    office.upload(10_000 * DAY)
    before = office.rows(), office.files()
    assert office.prune(jobs_days=0.0, uploads_days=0.0) == set()
    assert (office.rows(), office.files()) == before


def test_a_job_that_is_retried_just_before_it_would_go_is_kept_whole(office):
    job = office.job(State.FAILED)
    old = office.retention.old(Keep(90.0, 0.0), NOW)
    files = office.files()
    office.records.start_again(job.id)
    assert list(office.retention.delete(old)) == []
    assert office.records.get(job.id).state is State.QUEUED
    assert office.files() == files


def test_a_file_that_is_sent_again_is_kept_from_then_on(office):
    sent = office.upload(8 * DAY, b"[]")
    old = office.retention.old(Keep(0.0, 7.0), NOW)
    assert [path.name for path in old.uploads] == [sent]
    assert Uploads(office.folders.uploads, 10**6, 0).get(sent, None).id == sent
    writer = Uploads(office.folders.uploads, 10**6, 0).begin()
    writer.write(b"[]")
    again = writer.whole("blades.json", JSON)
    writer.keep(again)
    assert again.id == sent
    list(office.retention.delete(old))
    assert office.prune(uploads_days=7.0) == set()
    assert [path.name for path in office.folders.uploads.iterdir()] == [sent]


class Killed(BaseException):
    """The process ended here."""


KILLS: dict[str, Callable[[pytest.MonkeyPatch], None]] = {
    "before its row": lambda patch: patch.setattr(JobRecords, "remove_over", _killed),
    "before its folder": lambda patch: patch.setattr(job_folder, "remove_folder", _killed),
    "amid its files": lambda patch: patch.setattr("service.jobs.durable_files.shutil.rmtree", _killed),
}


def _killed(*given: object, **named: object) -> None:
    raise Killed


@pytest.mark.parametrize("moment", KILLS)
def test_a_deletion_killed_at_any_moment_is_finished_by_the_next(office, monkeypatch, moment):
    kept = office.job(State.DONE, 1 * DAY)
    rows, files = office.rows(), office.files()
    job = office.job(State.DONE)
    with monkeypatch.context() as patch:
        KILLS[moment](patch)
        with pytest.raises(Killed):
            office.prune(jobs_days=90.0)
    # Never half: a job that has a row has all of its files.
    if job.id in office.rows():
        assert {f"jobs/{job.id}/request.json", f"jobs/{job.id}/chunks/000000.npz"} <= set(office.files())
    _an_hour_later(office, monkeypatch)
    office.retention.tidy()
    office.prune(jobs_days=90.0)
    assert office.rows() == rows
    assert office.files() == files
    assert kept.id in office.rows()


def _an_hour_later(office: Office, monkeypatch: pytest.MonkeyPatch) -> None:
    now = time.time()
    monkeypatch.setattr(job_folder.time, "time", lambda: now + 3700.0)


def test_folders_without_a_row_stay_unless_a_kill_left_them(office, monkeypatch):
    # The data folder is given another database by mistake: nothing may be lost by that.
    for state in FINISHED:
        office.job(state)
    half_accepted = uuid.uuid4().hex
    files = office.files()
    office.folders.make(half_accepted, lambda path: write_durably(path / "request.json", b"{}"))
    with sqlite3.connect(office.folder / "rubscreen.sqlite") as there:
        there.execute("delete from rubscreen_jobs")
    office.retention.tidy()
    assert (office.folders.jobs / half_accepted).is_dir()  # it may be about to get its row
    _an_hour_later(office, monkeypatch)
    office.retention.tidy()
    assert office.files() == files


def test_a_backup_keeps_retention_waiting(office):
    with (
        nothing_deleted(office.folder, 1.0),
        pytest.raises(Busy, match="backup"),
        nothing_deleted(office.folder, 0.0),
    ):
        raise AssertionError


def test_a_negative_time_to_keep_is_refused():
    with pytest.raises(InvalidInput, match="jobs_days"):
        Keep(-1.0)


class Idle:
    """Jobs that are done at once."""

    def run(self, folder, control) -> None:
        control.report(done=1, total=1, now=True)


def _queue_rows(folder: Path) -> dict[str, int]:
    """Rows of every table of the queue, by table."""
    with sqlite3.connect(folder / "rubscreen.sqlite-queue") as there:
        names = [name for (name,) in there.execute("select name from sqlite_master where type = 'table'")]
        return {name: there.execute(f'select count(*) from "{name}"').fetchone()[0] for name in names}


def _opened(folder: Path, keep: Keep = Keep()) -> tuple[Database, Jobs]:
    database = open_database(folder)
    settings = JobSettings({SCREENING: 2, TRAINING: 1}, reserve_bytes=0, keep=keep)
    return database, Jobs(database, folder, {SCREENING: Idle(), TRAINING: Idle()}, settings)


def _closed(database: Database, jobs: Jobs) -> None:
    jobs.close()
    database.close()


def _run(jobs: Jobs, many: int) -> list[Job]:
    made = [
        jobs.submit(
            Job(uuid.uuid4().hex, SCREENING), lambda path: write_durably(path / "request.json", b"{}")
        )[0]
        for _ in range(many)
    ]
    deadline = time.monotonic() + 30.0
    for job in made:
        while not jobs.queue.over(job.id, job.attempt):
            assert time.monotonic() < deadline
            time.sleep(0.05)
    return made


def _age(folder: Path, ids: list[str]) -> None:
    with sqlite3.connect(folder / "rubscreen.sqlite", timeout=30.0) as there:
        for job_id in ids:
            there.execute(
                "update rubscreen_jobs set finished_at = '2020-01-01 00:00:00.0' where id = ?", (job_id,)
            )


def test_the_queue_forgets_what_the_service_and_the_command_line_delete(tmp_path):
    folder = tmp_path / "data"
    held = _opened(folder)
    try:
        empty = _queue_rows(folder)
        by_service, by_command = _run(held[1], 2), _run(held[1], 2)
        kept = _run(held[1], 1)
        _age(folder, [job.id for job in by_command])
        # Beside the running service, which holds the folder.
        done = CliRunner().invoke(cli.app, ["jobs", "prune", "--data", str(folder), "--older-than", "30d"])
        assert done.exit_code == 0, done.output
        assert {line.split()[0] for line in done.stdout.splitlines() if "screening" in line} == {
            job.id for job in by_command
        }
    finally:
        _closed(*held)
    assert _queue_rows(folder)["workflow_status"] == empty["workflow_status"] + 5

    _age(folder, [job.id for job in by_service])
    held = _opened(folder, Keep(jobs_days=30.0))
    try:
        deadline = time.monotonic() + 30.0
        while _queue_rows(folder)["workflow_status"] > empty["workflow_status"] + 1:
            assert time.monotonic() < deadline
            time.sleep(0.1)
        left = _queue_rows(folder)
        assert all(left[name] <= empty[name] + 1 for name in left)
        assert held[1].queue.over(kept[0].id, 1)
        assert [path.name for path in (folder / "jobs").iterdir()] == [kept[0].id]
        # Nor would a lost row cost it its results.
        assert {path.name for path in (folder / "jobs" / kept[0].id).iterdir()} == {
            "request.json",
            "log.jsonl",
        }
    finally:
        _closed(*held)


def test_a_dry_run_names_what_would_go_and_deletes_nothing(office):
    old, young = office.job(State.DONE, 40 * DAY), office.job(State.DONE, 20 * DAY)
    before = office.rows(), office.files()
    asked = ["jobs", "prune", "--older-than", "30d", "--dry-run", "--data", str(office.folder)]
    done = CliRunner().invoke(cli.app, asked)
    assert done.exit_code == 0, done.output
    assert old.id in done.stdout
    assert young.id not in done.stdout
    assert (office.rows(), office.files()) == before


def test_jobs_are_listed_by_state_and_shown_by_the_beginning_of_their_name(office, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)  # a narrow terminal cuts identifiers off
    done, failed = office.job(State.DONE), office.job(State.FAILED)
    data = ["--data", str(office.folder)]
    listed = CliRunner().invoke(cli.app, ["jobs", "list", "--state", "failed", *data])
    assert failed.id in listed.stdout
    assert done.id not in listed.stdout
    shown = CliRunner().invoke(cli.app, ["jobs", "show", done.id[:8], *data])
    document = json.loads(shown.stdout)
    assert document["id"] == done.id
    assert document["size_bytes"] == len(done.id) * 1000 + len(
        (office.folders.jobs / done.id / "request.json").read_bytes()
    )


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["prune", "--older-than", "30"], "--older-than"),
        (["prune", "--older-than", "0d"], "--older-than"),
        (["list", "--state", "lost"], "--state"),
        (["show", "zz"], "ID"),
        (["list", "--data", "nowhere"], "--data"),
    ],
)
def test_what_cannot_be_asked_of_jobs_is_refused_in_one_line(office, asked, said):
    result = CliRunner().invoke(
        cli.app, ["jobs", *asked, *(() if "--data" in asked else ("--data", str(office.folder)))]
    )
    assert result.exit_code == 2
    assert result.stderr.startswith(f"rubscreen: {said} = ")
    assert not Path("nowhere").exists()

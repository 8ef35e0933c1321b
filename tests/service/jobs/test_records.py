"""Jobs as rows, on SQLite and on PostgreSQL."""

from __future__ import annotations

import threading
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from sdm_core.errors import InvalidInput
from service.jobs.errors import NoSuchJob, OtherRequest, UnderWay
from service.jobs.job import SCREENING, TRAINING, Fault, Job, State
from service.records.database import Database, database_url
from service.records.jobs import JobRecords

BEGAN = datetime(2026, 1, 1, tzinfo=UTC)


@pytest.fixture
def records(database) -> JobRecords:
    return JobRecords(database)


def job(number: int, **more) -> Job:
    return Job(f"{number:032x}", SCREENING, created_at=BEGAN + timedelta(seconds=number), **more)


def test_a_job_comes_back_as_it_was_kept(records):
    fault = Fault("blades[0].name", "missing", "the blade file needs it")
    kept = job(1, name="été", owner="k1", owner_name="tool", priority=2, idempotency_key="a", fault=fault)
    kept = replace(kept, started_at=BEGAN, finished_at=BEGAN, state=State.FAILED, done=3, total=4)
    records.add(kept)
    assert records.get(kept.id) == kept
    assert records.get(kept.id, SCREENING) == kept
    with pytest.raises(NoSuchJob):
        records.get(kept.id, TRAINING)


def test_the_same_idempotency_key_is_the_same_job(records):
    first = records.add(job(1, owner="k1", idempotency_key="night", request_digest="d"))
    assert records.add(job(2, owner="k1", idempotency_key="night", request_digest="d")) == first
    with pytest.raises(OtherRequest):
        records.add(job(3, owner="k1", idempotency_key="night", request_digest="other"))
    # Another key holder's keys are their own.
    assert records.add(job(4, owner="k2", idempotency_key="night", request_digest="d")).id == job(4).id
    assert {found.id for found in records.page(SCREENING)} == {first.id, job(4).id}


def test_of_requests_that_come_at_the_same_time_one_becomes_a_job(records):
    made: list[str] = []

    def ask(number: int) -> None:
        made.append(records.add(job(number, idempotency_key="night", request_digest="d")).id)

    threads = [threading.Thread(target=ask, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(made) == 8 and len(set(made)) == 1


def test_pages_go_from_new_to_old_without_gap_or_overlap(records):
    for number in range(7):
        records.add(job(number, owner="k1" if number % 2 else "k2"))
    first = records.page(SCREENING, limit=3)
    second = records.page(SCREENING, limit=3, after=first[-1].id)
    third = records.page(SCREENING, limit=3, after=second[-1].id)
    assert [found.id for found in (*first, *second, *third)] == [job(n).id for n in reversed(range(7))]
    assert [found.id for found in records.page(SCREENING, owner="k1")] == [job(n).id for n in (5, 3, 1)]
    with pytest.raises(NoSuchJob):
        records.page(SCREENING, after="f" * 32)


def test_what_is_over_is_changed_by_a_retry_alone(records):
    records.add(job(1))
    with pytest.raises(UnderWay):
        records.start_again(job(1).id)
    assert records.update(job(1).id, state=State.CANCELLED, finished_at=BEGAN)
    assert not records.update(job(1).id, state=State.RUNNING)
    assert records.get(job(1).id).state is State.CANCELLED
    again = records.start_again(job(1).id)
    assert (again.state, again.attempt, again.finished_at) == (State.QUEUED, 2, None)


def test_jobs_under_way_are_counted_by_owner(records):
    for number, state in enumerate((State.QUEUED, State.RUNNING, State.WAITING, State.DONE, State.FAILED)):
        records.add(replace(job(number, owner="k1" if number else "k2"), state=state, finished_at=BEGAN))
    assert records.active() == 3
    assert records.active("k1") == 2
    assert records.counts()[(SCREENING, "done")] == 1
    assert {found.id for found in records.finished_before(BEGAN + timedelta(1))} == {job(3).id, job(4).id}
    assert records.finished_before(BEGAN) == []


def test_a_database_of_a_later_version_is_left_alone(database, tmp_path):
    from service.records.database import _VERSION

    with database.begin() as connection:
        connection.execute(_VERSION.update().values(version=99))
    with pytest.raises(InvalidInput, match="install a newer one"):
        Database(database.url)


@pytest.mark.parametrize(
    "url", ["mysql://me@host/db", "no url", "sqlite://", "postgresql://me:secret@127.0.0.1:1/x"]
)
def test_a_database_that_cannot_be_used_is_named_without_its_password(url, tmp_path):
    with pytest.raises(InvalidInput) as refused:
        Database(database_url(url, tmp_path))
    assert refused.value.field == "database_url"
    assert "secret" not in str(refused.value)


def test_time_left_goes_by_the_share_done():
    running = replace(job(1), state=State.RUNNING, started_at=BEGAN, done=25, total=100)
    assert running.remaining_s(BEGAN + timedelta(seconds=10)) == pytest.approx(30.0)
    assert replace(running, done=0).remaining_s(BEGAN) is None
    assert replace(running, state=State.WAITING).remaining_s(BEGAN) is None

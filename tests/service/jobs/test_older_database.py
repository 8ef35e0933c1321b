"""A database of an older version is opened, and has what the newer one writes."""

from __future__ import annotations

import threading
from datetime import UTC, datetime

import pytest
from sqlalchemy import Column, Integer, String, Table, inspect, text

from sdm_core.errors import InvalidInput
from service.jobs.job import SCREENING, Job
from service.records.database import METADATA, Database
from service.records.jobs import JOBS, JobRecords

JOB = Job("0" * 32, SCREENING, created_at=datetime(2026, 1, 1, tzinfo=UTC), waiting_for="room", stage="x")


def made_older(database: Database) -> None:
    """As before `waiting_for` and `fault` were thought of, and before jobs were indexed by state."""
    with database.begin() as connection:
        connection.execute(text("drop index rubscreen_jobs_by_state"))
        for column in ("waiting_for", "fault"):
            connection.execute(text(f"alter table rubscreen_jobs drop column {column}"))


def shape_of(database: Database) -> tuple[dict[str, tuple[str, bool]], set[str]]:
    inspector = inspect(database.engine)
    columns = {
        column["name"]: (str(column["type"]), column["nullable"])
        for column in inspector.get_columns(JOBS.name)
    }
    return columns, {index["name"] for index in inspector.get_indexes(JOBS.name)}


def test_columns_and_indexes_that_came_since_are_added_and_rows_stay(database):
    whole = shape_of(database)
    JobRecords(database).add(JOB)
    made_older(database)
    assert shape_of(database) != whole
    reopened = Database(database.url)
    assert shape_of(reopened) == whole
    records = JobRecords(reopened)
    kept = records.get(JOB.id)
    assert (kept.stage, kept.waiting_for, kept.fault) == ("x", None, None)
    assert records.update(JOB.id, waiting_for="a worker")
    assert records.get(JOB.id).waiting_for == "a worker"
    reopened.close()


def test_a_program_of_the_older_version_goes_on_beside(database):
    """It names the columns it knows, in what it writes and in what it reads."""
    JobRecords(database).add(JOB)
    made_older(database)
    known = [column for column in JOBS.c if column.name not in ("waiting_for", "fault")]
    Database(database.url).close()
    with database.begin() as connection:
        row = dict(connection.execute(JOBS.select().with_only_columns(*known)).mappings().one())
        connection.execute(JOBS.insert().values(**row | {"id": "1" * 32}))
    assert JobRecords(database).get("1" * 32).fault is None


def test_several_that_open_it_at_the_same_time_add_a_column_once(database):
    made_older(database)
    faults: list[Exception] = []

    def opened() -> None:
        try:
            Database(database.url).close()
        except Exception as error:
            faults.append(error)

    threads = [threading.Thread(target=opened) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert faults == []
    assert "waiting_for" in shape_of(database)[0]


def test_a_column_that_older_rows_cannot_have_is_refused_and_nothing_is_changed(database):
    extra = Table(
        "rubscreen_extra", METADATA, Column("id", Integer, primary_key=True), Column("a", String(5))
    )
    try:
        Database(database.url).close()
        made_older(database)
        before = shape_of(database)
        METADATA.remove(extra)
        extra = Table(
            "rubscreen_extra",
            METADATA,
            Column("id", Integer, primary_key=True),
            Column("must", String(5), nullable=False),
        )
        with pytest.raises(InvalidInput, match="rubscreen_extra without must"):
            Database(database.url)
    finally:
        METADATA.remove(extra)
    assert shape_of(database) == before

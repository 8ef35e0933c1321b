"""Jobs as rows: who asked for what, and how far it is."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    Boolean,
    Column,
    Connection,
    DateTime,
    Index,
    Integer,
    RowMapping,
    String,
    Table,
    Text,
    UniqueConstraint,
    func,
    select,
)
from sqlalchemy.exc import IntegrityError

from service.jobs.errors import NoSuchJob, OtherRequest, UnderWay
from service.jobs.job import ACTIVE, FINISHED, LONGEST_NAME, Fault, Job, State
from service.records.database import METADATA, Database

JOBS = Table(
    "rubscreen_jobs",
    METADATA,
    Column("id", String(32), primary_key=True),
    Column("kind", String(20), nullable=False),
    Column("name", String(LONGEST_NAME)),
    Column("owner", String(40)),
    Column("owner_name", String(200)),
    Column("priority", Integer, nullable=False),
    # The owner's own keys: '' where there is no owner, since NULLs are never equal.
    Column("idempotency_owner", String(40), nullable=False),
    Column("idempotency_key", String(200)),
    Column("request_digest", String(64), nullable=False),
    Column("state", String(12), nullable=False),
    Column("created_at", DateTime(timezone=True), nullable=False),
    Column("started_at", DateTime(timezone=True)),
    Column("finished_at", DateTime(timezone=True)),
    Column("attempt", Integer, nullable=False),
    Column("done", Integer, nullable=False),
    Column("total", Integer, nullable=False),
    Column("stage", String(200), nullable=False),
    Column("not_screened", Integer, nullable=False),
    Column("waiting_for", Text),
    Column("fault", Text),
    Column("cancel_requested", Boolean, nullable=False),
    UniqueConstraint("idempotency_owner", "idempotency_key"),
    Index("rubscreen_jobs_by_age", "kind", "created_at", "id"),
    Index("rubscreen_jobs_by_state", "state"),
)


_ID = re.compile(r"[0-9a-f]{32}")


class JobRecords:
    """The jobs of the database."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(self, job: Job) -> Job:
        """Keep a new job; where its idempotency key was used before, the job of that time.

        Raises
        ------
        OtherRequest
            When that one was asked for something else.
        """
        try:
            with self._database.begin() as connection:
                connection.execute(JOBS.insert().values(**_row(job)))
        except IntegrityError:
            before = self.of_request(job)
            if before is None:
                raise
            return before
        return job

    def of_request(self, job: Job) -> Job | None:
        """The job that was made of the same request; None where there is none.

        Raises
        ------
        OtherRequest
            When the key was used with another one.
        """
        if job.idempotency_key is None:
            return None
        asked = select(JOBS).where(
            JOBS.c.idempotency_owner == (job.owner or ""), JOBS.c.idempotency_key == job.idempotency_key
        )
        with self._database.begin() as connection:
            row = connection.execute(asked).mappings().first()
        if row is None:
            return None
        before = _job(row)
        if before.request_digest != job.request_digest or before.kind != job.kind:
            remedy = f"it belongs to another request (job {before.id}): use a new key for a new request"
            raise OtherRequest("Idempotency-Key", job.idempotency_key, remedy)
        return before

    def get(self, job_id: str, kind: str | None = None) -> Job:
        """One job.

        Raises
        ------
        NoSuchJob
            When there is none of this identifier and kind.
        """
        with self._database.begin() as connection:
            return _get(connection, job_id, kind)

    def page(
        self,
        kind: str,
        *,
        owner: str | None = None,
        states: Sequence[State] = (),
        limit: int = 50,
        after: str | None = None,
    ) -> list[Job]:
        """Jobs, newest first, `after` the job of that identifier."""
        with self._database.begin() as connection:
            asked = select(JOBS).where(JOBS.c.kind == kind)
            if owner is not None:
                asked = asked.where(JOBS.c.owner == owner)
            if states:
                asked = asked.where(JOBS.c.state.in_([state.value for state in states]))
            if after is not None:
                last = _get(connection, after, kind)
                older = JOBS.c.created_at < last.created_at
                same = (JOBS.c.created_at == last.created_at) & (JOBS.c.id < last.id)
                asked = asked.where(older | same)
            asked = asked.order_by(JOBS.c.created_at.desc(), JOBS.c.id.desc()).limit(limit)
            return [_job(row) for row in connection.execute(asked).mappings()]

    def update(
        self, job_id: str, *, only: Iterable[State] = ACTIVE, of_attempt: int | None = None, **values: Any
    ) -> bool:
        """Change columns of a job that is in one of the states `only`; whether it was.

        With `of_attempt` only while it is at that attempt: a run that was taken over changes nothing more.
        """
        if isinstance(values.get("state"), State):
            values["state"] = values["state"].value
        if isinstance(values.get("fault"), Fault):
            values["fault"] = values["fault"].to_json()
        change = JOBS.update().where(JOBS.c.id == job_id, JOBS.c.state.in_([s.value for s in only]))
        if of_attempt is not None:
            change = change.where(JOBS.c.attempt == of_attempt)
        with self._database.begin() as connection:
            return connection.execute(change.values(**values)).rowcount == 1

    def start_again(self, job_id: str) -> Job:
        """Queue a job that is over once more: what it had stored and is whole stays.

        Raises
        ------
        UnderWay
            When it is not over.
        """
        changed = self.update(
            job_id,
            only=FINISHED,
            state=State.QUEUED,
            attempt=JOBS.c.attempt + 1,
            started_at=None,
            finished_at=None,
            fault=None,
            waiting_for=None,
            cancel_requested=False,
        )
        job = self.get(job_id)
        if not changed:
            raise UnderWay("id", f"{job_id}, {job.state.value}", "cancel it first, or wait until it is over")
        return job

    def unfinished(self) -> list[Job]:
        """Every job that is neither done, failed nor cancelled, oldest first."""
        asked = select(JOBS).where(JOBS.c.state.in_([s.value for s in ACTIVE])).order_by(JOBS.c.created_at)
        with self._database.begin() as connection:
            return [_job(row) for row in connection.execute(asked).mappings()]

    def finished_before(self, moment: datetime) -> list[Job]:
        """Jobs that were over before `moment`."""
        asked = select(JOBS).where(JOBS.c.state.in_([s.value for s in FINISHED]), JOBS.c.finished_at < moment)
        with self._database.begin() as connection:
            return [_job(row) for row in connection.execute(asked).mappings()]

    def beginning(self, text: str) -> list[Job]:
        """Jobs whose identifier begins with some hexadecimal digits, ten at most."""
        asked = select(JOBS).where(JOBS.c.id.startswith(text, autoescape=True)).order_by(JOBS.c.id).limit(10)
        with self._database.begin() as connection:
            return [_job(row) for row in connection.execute(asked).mappings()]

    def remove_over(self, job_id: str, before: datetime) -> bool:
        """Forget a job that was over before that time; whether it was."""
        over = JOBS.c.state.in_([s.value for s in FINISHED]) & (JOBS.c.finished_at < before)
        with self._database.begin() as connection:
            return connection.execute(JOBS.delete().where(JOBS.c.id == job_id, over)).rowcount == 1

    def known(self, job_ids: Sequence[str]) -> set[str]:
        """Those of some identifiers that belong to jobs."""
        asked = select(JOBS.c.id).where(JOBS.c.id.in_(job_ids))
        with self._database.begin() as connection:
            return set(connection.execute(asked).scalars())

    def active(self, owner: str | None = None) -> int:
        """Number of jobs not over, of one owner or of all."""
        asked = select(func.count()).where(JOBS.c.state.in_([s.value for s in ACTIVE]))
        if owner is not None:
            asked = asked.where(JOBS.c.owner == owner)
        with self._database.begin() as connection:
            return int(connection.execute(asked).scalar_one())

    def counts(self) -> dict[tuple[str, str], int]:
        """Number of jobs by (kind, state)."""
        asked = select(JOBS.c.kind, JOBS.c.state, func.count()).group_by(JOBS.c.kind, JOBS.c.state)
        with self._database.begin() as connection:
            return {(kind, state): int(many) for kind, state, many in connection.execute(asked)}


def _get(connection: Connection, job_id: str, kind: str | None) -> Job:
    if not _ID.fullmatch(job_id):
        raise NoSuchJob("id", job_id, "give the id of a job: 32 hexadecimal digits")
    asked = select(JOBS).where(JOBS.c.id == job_id)
    if kind is not None:
        asked = asked.where(JOBS.c.kind == kind)
    row = connection.execute(asked).mappings().first()
    if row is None:
        raise NoSuchJob("id", job_id, f"give the id of a {kind or 'job'}; old ones are deleted in time")
    return _job(row)


def _row(job: Job) -> dict[str, Any]:
    row = {column.name: getattr(job, column.name) for column in JOBS.c if hasattr(job, column.name)}
    row |= {"state": job.state.value, "idempotency_owner": job.owner or ""}
    return row | {"fault": None if job.fault is None else job.fault.to_json()}


def _job(row: RowMapping) -> Job:
    values = {name: row[name] for name in row if name != "idempotency_owner"}
    values["state"] = State(row["state"])
    values["fault"] = None if row["fault"] is None else Fault.from_json(row["fault"])
    for name in ("created_at", "started_at", "finished_at"):
        at = values[name]
        # SQLite gives times back without their zone; all are written in UTC.
        values[name] = at.replace(tzinfo=UTC) if at is not None and at.tzinfo is None else at
    return Job(**values)

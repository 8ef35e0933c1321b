"""What is done by the calendar, as rows: when, with what, and up to when it has been done."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import Column, DateTime, String, Table, Text, select
from sqlalchemy.exc import IntegrityError

from service.records.database import METADATA, Database

SCHEDULES = Table(
    "rubscreen_schedules",
    METADATA,
    Column("name", String(20), primary_key=True),
    Column("cron", String(100), nullable=False),
    Column("timezone", String(100), nullable=False),
    Column("context", Text, nullable=False),  # JSON
    Column("done_to", DateTime(timezone=True), nullable=False),
)


@dataclass(frozen=True)
class KeptSchedule:
    """A schedule on record.

    Attributes
    ----------
    cron, timezone
        Five fields, and the IANA name of the zone they are in.
    context
        What it is done with.
    done_to
        Times up to this one are dealt with.
    """

    cron: str
    timezone: str
    context: dict[str, Any]
    done_to: datetime


class ScheduleRecords:
    """The schedules of a database, by name."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def put(self, name: str, schedule: KeptSchedule) -> None:
        """Keep a schedule in place of the one there is, in one transaction: one of them is always there."""
        try:
            self._put(name, schedule)
        except IntegrityError:  # another replica made the row a moment before
            self._put(name, schedule)

    def get(self, name: str) -> KeptSchedule | None:
        """The schedule of that name; None where there is none."""
        with self._database.begin() as connection:
            row = connection.execute(select(SCHEDULES).where(SCHEDULES.c.name == name)).mappings().first()
        if row is None:
            return None
        to = row["done_to"]
        # SQLite gives times back without their zone; all are written in UTC.
        to = to.replace(tzinfo=UTC) if to.tzinfo is None else to.astimezone(UTC)
        return KeptSchedule(row["cron"], row["timezone"], json.loads(row["context"]), to)

    def done(self, name: str, seen: KeptSchedule, to: datetime) -> bool:
        """Note that times up to `to` are dealt with; not when it was replaced since it was `seen`."""
        same = (
            (SCHEDULES.c.name == name)
            & (SCHEDULES.c.cron == seen.cron)
            & (SCHEDULES.c.timezone == seen.timezone)
            & (SCHEDULES.c.done_to == seen.done_to)
        )
        with self._database.begin() as connection:
            change = SCHEDULES.update().where(same).values(done_to=to.astimezone(UTC))
            return connection.execute(change).rowcount == 1

    def remove(self, name: str) -> None:
        """Have none of that name any more."""
        with self._database.begin() as connection:
            connection.execute(SCHEDULES.delete().where(SCHEDULES.c.name == name))

    def _put(self, name: str, schedule: KeptSchedule) -> None:
        row = vars(schedule) | {
            "context": json.dumps(schedule.context),
            "done_to": schedule.done_to.astimezone(UTC),
        }
        with self._database.begin() as connection:
            if not connection.execute(
                SCHEDULES.update().where(SCHEDULES.c.name == name).values(row)
            ).rowcount:
                connection.execute(SCHEDULES.insert().values(name=name, **row))

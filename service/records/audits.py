"""Counts of audits in the database: added up over replicas and restarts, and alarms that stay."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime

from sqlalchemy import BigInteger, Column, Connection, DateTime, Float, String, Table, and_, insert
from sqlalchemy.exc import IntegrityError

from service.audit.tally import Promise, Tally
from service.records.database import METADATA, Database

_COUNTS = tuple(field.name for field in fields(Tally))
AUDITS = Table(
    "audits",
    METADATA,
    Column("model", String(64), primary_key=True),
    Column("contact", String(32), primary_key=True),
    Column("alpha", Float(53), primary_key=True),
    *(Column(name, BigInteger, nullable=False) for name in _COUNTS),
    Column("alarmed_at", DateTime(timezone=True)),
)


@dataclass(frozen=True)
class Audited:
    """What is known of one promise.

    Attributes
    ----------
    alarmed_at
        When the counts first contradicted the promise; None where they never did. An alarm stays: evidence
        may fall again afterwards, but it was promised that it is high at *any* time with a chance of 1 %.
    """

    tally: Tally
    alarmed_at: datetime | None = None

    def with_more(self, found: Tally, alpha: float, now: datetime) -> Audited:
        """After further audits."""
        tally = self.tally + found
        return Audited(tally, self.alarmed_at or (now if tally.breaks(alpha) else None))


def add(database: Database, found: Mapping[Promise, Tally]) -> dict[Promise, Audited]:
    """Add counts, and what there is of every promise afterwards.

    Either all are added or, when it raises, none.
    """
    try:
        return _added(database, found)
    except IntegrityError:  # another replica wrote the first row of a promise a moment before
        return _added(database, found)


def read(database: Database) -> dict[Promise, Audited]:
    """Everything audited so far."""
    with database.begin() as connection:
        return _all(connection)


def _added(database: Database, found: Mapping[Promise, Tally]) -> dict[Promise, Audited]:
    with database.begin() as connection:
        for promise, tally in sorted(
            found.items()
        ):  # in one order, so that replicas cannot block one another
            this = and_(*(AUDITS.c[name] == value for name, value in asdict(promise).items()))
            more = {name: AUDITS.c[name] + count for name, count in asdict(tally).items()}
            if not connection.execute(AUDITS.update().where(this).values(more)).rowcount:
                connection.execute(insert(AUDITS).values(asdict(promise) | asdict(tally)))
            now = _all(connection)[promise]
            if now.alarmed_at is None and now.tally.breaks(promise.alpha):
                connection.execute(AUDITS.update().where(this).values(alarmed_at=datetime.now(UTC)))
        return _all(connection)


def _all(connection: Connection) -> dict[Promise, Audited]:
    return {
        Promise(row.model, row.contact, row.alpha): Audited(
            Tally(*(getattr(row, name) for name in _COUNTS)), row.alarmed_at
        )
        for row in connection.execute(AUDITS.select())
    }

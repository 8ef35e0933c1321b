"""The processes that run jobs: each says now and then that it lives, so that others can take over."""

from __future__ import annotations

import os
import socket
from datetime import timedelta

from sqlalchemy import Column, DateTime, Integer, String, Table, func, select

from service.records.database import METADATA, Database

REPLICAS = Table(
    "rubscreen_replicas",
    METADATA,
    Column("name", String(200), primary_key=True),
    Column("host", String(200), nullable=False),
    Column("pid", Integer, nullable=False),
    Column("seen_at", DateTime(timezone=True), nullable=False),
)


class Replicas:
    """The replicas of a database; by its clock, for theirs may differ."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def say(self, name: str) -> None:
        """This replica lives."""
        with self._database.begin() as connection:
            change = REPLICAS.update().where(REPLICAS.c.name == name).values(seen_at=func.now())
            if connection.execute(change).rowcount == 0:
                mine = {"name": name, "host": socket.gethostname(), "pid": os.getpid(), "seen_at": func.now()}
                connection.execute(REPLICAS.insert().values(**mine))

    def silent(self, lease_s: float, *, but: str) -> list[str]:
        """Names of the replicas that have said nothing for `lease_s`, other than one's own."""
        if not self._database.shared:
            return []
        since = func.now() - timedelta(seconds=lease_s)
        asked = select(REPLICAS.c.name).where(REPLICAS.c.seen_at < since, REPLICAS.c.name != but)
        with self._database.begin() as connection:
            return list(connection.execute(asked).scalars())

    def forget(self, name: str) -> None:
        """A replica has gone, and nothing of its is left to take over."""
        with self._database.begin() as connection:
            connection.execute(REPLICAS.delete().where(REPLICAS.c.name == name))

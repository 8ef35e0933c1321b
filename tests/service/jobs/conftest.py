"""Databases, and an engine that computes in threads of this process."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from postgres_server import PostgresServer, empty_database, needs_postgres, running_postgres

from service.records.database import Database, database_url


@pytest.fixture(scope="session")
def postgres() -> Iterator[PostgresServer]:
    with running_postgres() as server:
        yield server


@pytest.fixture
def postgres_url(postgres: PostgresServer) -> Iterator[str]:
    with empty_database(postgres) as url:
        yield url


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=needs_postgres)])
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Database]:
    """Of each kind that the service runs on."""
    url = None if request.param == "sqlite" else request.getfixturevalue("postgres_url")
    made = Database(database_url(url, tmp_path))
    yield made
    made.close()

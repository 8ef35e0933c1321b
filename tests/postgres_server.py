"""A PostgreSQL of one's own on the loopback; tests that need one are skipped where it is not installed."""

from __future__ import annotations

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


def binaries() -> Path | None:
    """Folder of initdb and pg_ctl; None where there is none."""
    found = shutil.which("initdb")
    if found is not None:
        return Path(found).parent
    return max(Path("/usr/lib/postgresql").glob("*/bin"), default=None, key=lambda p: float(p.parent.name))


needs_postgres = pytest.mark.skipif(binaries() is None, reason="PostgreSQL is not installed")


class PostgresServer:
    """A server of its own folder and port; `url` names no database."""

    def __init__(self) -> None:
        found = binaries()
        assert found is not None
        self._bin = found
        # Not under pytest's own folder: the server does not run as root, which that may belong to.
        self._folder = Path(tempfile.mkdtemp(prefix="rubscreen-postgres-"))
        self._as_postgres: list[str] = []
        if os.geteuid() == 0:
            user = pwd.getpwnam("postgres")
            os.chown(self._folder, user.pw_uid, user.pw_gid)
            ids = [f"--reuid={user.pw_uid}", f"--regid={user.pw_gid}"]
            self._as_postgres = ["setpriv", *ids, "--clear-groups"]
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.url = f"postgresql://postgres@127.0.0.1:{port}"
        self._data = str(self._folder / "data")
        settings = f"-p {port} -k {self._folder} -c listen_addresses=127.0.0.1 -c max_connections=200"
        self._options = f"{settings} -c fsync=off"
        self._run("initdb", "-D", self._data, "-U", "postgres", "-A", "trust", "-N")
        self.start()

    def start(self) -> None:
        """Let it answer."""
        log = str(self._folder / "log")
        self._run("pg_ctl", "-D", self._data, "-w", "-l", log, "-o", self._options, "start")

    def stop(self) -> None:
        """Cut every connection off."""
        self._run("pg_ctl", "-D", self._data, "-m", "immediate", "stop")

    def remove(self) -> None:
        """Stop it for good."""
        self.stop()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _run(self, program: str, *arguments: str) -> None:
        command = [*self._as_postgres, str(self._bin / program), *arguments]
        subprocess.run(command, check=True, capture_output=True, cwd=self._folder, timeout=120)


@contextmanager
def running_postgres() -> Iterator[PostgresServer]:
    """A server that is gone afterwards."""
    server = PostgresServer()
    try:
        yield server
    finally:
        server.remove()


@contextmanager
def empty_database(server: PostgresServer) -> Iterator[str]:
    """The URL of a database that nothing is in."""
    import psycopg

    name = f"rub_{uuid.uuid4().hex[:12]}"
    with psycopg.connect(f"{server.url}/postgres", autocommit=True) as connection:
        connection.execute(f"create database {name}")
    try:
        yield f"{server.url}/{name}"
    finally:
        with psycopg.connect(f"{server.url}/postgres", autocommit=True) as connection:
            connection.execute(f"drop database {name} with (force)")

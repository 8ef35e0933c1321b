"""Copies of the database while others write to it: SQLite by its own backup, PostgreSQL by pg_dump."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
from contextlib import closing
from pathlib import Path

from sqlalchemy import create_engine, inspect
from sqlalchemy.engine import URL
from sqlalchemy.exc import SQLAlchemyError

from sdm_core.errors import InvalidInput
from service.jobs.durable_queue import SCHEMA, queue_file
from service.records.database import FILE

DUMP = "rubscreen.pgdump"
_BUSY_S = 60.0


def copy_database(url: URL, folder: Path) -> list[Path]:
    """Write copies of the database and its queue into a folder.

    Of SQLite's two files the queue's is copied first. What is in it and not yet, or otherwise, in the rows
    mends itself: a run that was given back is begun, finds its job over and ends; a job accepted meanwhile is
    in no queue and is put into it. The other way round a job that ends in between would be run once more.
    PostgreSQL dumps both as of one moment.

    Raises
    ------
    InvalidInput
        When it cannot be copied, or is damaged.
    """
    if url.drivername.startswith("sqlite"):
        rows = Path(url.database or "")
        if not rows.is_file():
            raise InvalidInput("data_folder", str(rows.parent), "there is no database in it to back up")
        queue = queue_file(rows)
        made = [folder / queue_file(Path(FILE)).name] if queue.is_file() else []
        made.append(folder / FILE)
        for source, copy in zip([queue, rows][-len(made) :], made, strict=True):
            _copy_sqlite(source, copy)
        return made
    made = [folder / DUMP]
    _run(["pg_dump", "--format=custom", "--no-owner", "--no-privileges", f"--file={made[0]}"], url)
    return made


def fill_database(url: URL, dump: Path) -> None:
    """Put a dump into an empty PostgreSQL database, wholly or not at all.

    Raises
    ------
    InvalidInput
        When it is not empty, or cannot be filled.
    """
    check_empty(url)
    how = ["--no-owner", "--no-privileges", "--single-transaction", "--exit-on-error"]
    _run(["pg_restore", *how], url, str(dump))


def check_empty(url: URL) -> None:
    """Refuse a PostgreSQL database that a service has used.

    Raises
    ------
    InvalidInput
    """
    shown = url.render_as_string(hide_password=True)
    engine = create_engine(url)
    try:
        found = inspect(engine)
        tables = [name for name in found.get_table_names() if name.startswith("rubscreen_")]
        used = bool(tables) or SCHEMA in found.get_schema_names()
    except SQLAlchemyError as error:
        cause = str(getattr(error, "orig", None) or error).strip().splitlines()[0]
        raise InvalidInput("database_url", shown, f"it cannot be used ({cause}): mend it") from None
    finally:
        engine.dispose()
    if used:
        raise InvalidInput("database_url", shown, "a service has used it: make an empty one (createdb)")


def _copy_sqlite(source: Path, copy: Path) -> None:
    try:
        with (
            closing(sqlite3.connect(source, timeout=_BUSY_S)) as there,
            closing(sqlite3.connect(copy)) as here,
        ):
            there.backup(here)  # in one step, so it is of one moment
            here.execute("PRAGMA journal_mode=DELETE")  # one file, nothing beside it
            said = here.execute("PRAGMA integrity_check").fetchone()[0]
    except sqlite3.Error as error:
        raise InvalidInput("database", str(source), f"it cannot be copied ({error}): mend it") from None
    if said != "ok":
        raise InvalidInput("database", str(source), f"it is damaged ({said}): restore an older backup")


def _run(command: list[str], url: URL, *more: str) -> None:
    """Run a program of PostgreSQL's with a database; its password goes by the environment."""
    program = shutil.which(command[0])
    if program is None:
        remedy = "install PostgreSQL's client programs, of the server's version or later (postgresql-client)"
        raise InvalidInput("database_url", f"needs {command[0]}, which is not installed", remedy)
    environment = dict(os.environ)
    if url.password is not None:
        environment["PGPASSWORD"] = str(url.password)
    address = url.set(drivername="postgresql")._replace(password=None).render_as_string()
    done = subprocess.run(
        [program, *command[1:], f"--dbname={address}", *more], env=environment, capture_output=True, text=True
    )
    if done.returncode != 0:
        said = " ".join(done.stderr.split())[:500] or f"exit status {done.returncode}"
        shown = url.render_as_string(hide_password=True)
        raise InvalidInput("database_url", shown, f"{command[0]} failed, mend it: {said}")

"""Restore: a backup unpacked beside its place, checked to the last byte, and only then moved there."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

from sdm_core.errors import DamagedFile, InvalidInput
from service.backup.archive import extract
from service.backup.backup import ABOUT, ANSWERS, DATA, DATABASE, SCHEMA, ShowProgress
from service.backup.database_copy import DUMP, check_empty, fill_database
from service.jobs.durable_files import check_room, sync_folder
from service.records.database import RESTORING, database_url

_LARGEST_ABOUT = 10_000


@dataclass(frozen=True)
class Restored:
    """What was restored.

    Attributes
    ----------
    files
        Files, the database's included.
    created_at, version
        When the backup was made, and by which version.
    answers
        Where kept answers are, for `served_answers_folder`; None where there are none of their own.
    """

    folder: Path
    files: int
    created_at: str
    version: str
    answers: Path | None


def restore(
    source: Path,
    folder: Path,
    url: str | None = None,
    progress: ShowProgress = lambda done, total, name: None,
) -> Restored:
    """Make a data folder of a backup. Where this raises, nothing is left of it.

    It is unpacked below the new folder, which may be where a disk is mounted; a service refuses the folder as
    long as that is not over.

    Parameters
    ----------
    folder
        The new data folder: not there yet, or empty.
    url
        An empty database, where the backup is of PostgreSQL.
    progress
        As of `backup`.

    Raises
    ------
    InvalidInput
        When the folder or the database is not empty, of another kind, or cannot be written.
    DamagedFile
        When the backup is none, or not whole.
    """
    if url is not None and (given := database_url(url, folder)).drivername.startswith("postgresql"):
        check_empty(given)  # before the work, and once more before it is filled
    try:
        size = source.stat().st_size
        made = _made(folder)
    except OSError as error:
        place = source if error.filename == str(source) else folder
        raise InvalidInput(
            "FILE" if place is source else "--data", str(place), f"mend it ({error.strerror or error})"
        ) from None
    beside = folder / RESTORING
    try:
        check_room(folder, size, 0)
        beside.mkdir()
        with source.open("rb") as archive, tempfile.TemporaryFile(dir=beside) as lines:
            done = 0

            def more(piece: int) -> None:
                nonlocal done
                done += piece
                progress(done // 2**20, size // 2**20, "unpacking")

            files = extract(archive, beside, lines, more)
        about = _about(beside, source)
        _fill(about["database"], beside, url, folder)
        moved = beside / DATA
        moved.mkdir(exist_ok=True)
        os.sync()  # once for all of it
        for path in [*moved.iterdir(), *(beside / DATABASE).iterdir()]:  # the database last
            if path.name != DUMP:
                os.replace(path, folder / path.name)
        sync_folder(folder)
    except BaseException as error:
        shutil.rmtree(beside, ignore_errors=True)
        if made:
            shutil.rmtree(folder, ignore_errors=True)
        if isinstance(error, OSError):
            remedy = f"it cannot be written ({error.strerror or error}): make room, or give another folder"
            raise InvalidInput("--data", str(folder), remedy) from None
        raise
    shutil.rmtree(beside)
    answers = folder / ANSWERS
    kept = answers if answers.is_dir() else None
    return Restored(folder, files - 1, about["created_at"], about["version"], kept)


def _made(folder: Path) -> bool:
    """Make the folder ready; whether it was not there.

    Raises
    ------
    InvalidInput
        When something is in it; not what a restore that was killed had unpacked.
    """
    if not folder.exists():
        folder.mkdir(parents=True)
        return True
    if [path.name for path in folder.iterdir()] == [RESTORING]:
        shutil.rmtree(folder / RESTORING)
    if any(folder.iterdir()):
        raise InvalidInput("--data", str(folder), "it is not empty: give a folder that is new or empty")
    return False


def _about(beside: Path, source: Path) -> dict[str, str]:
    remedy = "it is no backup that this version can read: install the version that made it, or a later one"
    try:
        about = json.loads((beside / ABOUT).read_bytes()[:_LARGEST_ABOUT])
        known = about["schema"] == SCHEMA and about["database"] in ("sqlite", "postgresql")
        about["created_at"], about["version"]
    except (OSError, ValueError, TypeError, KeyError):
        known = False
    if not known:
        raise DamagedFile("backup", str(source), remedy)
    return about


def _fill(kind: str, beside: Path, url: str | None, folder: Path) -> None:
    found = database_url(url, folder)
    given = "postgresql" if found.drivername.startswith("postgresql") else "sqlite"
    if given != kind:
        remedy = (
            "give an empty PostgreSQL database: the backup is of one"
            if kind == "postgresql"
            else "leave it out: the backup is of SQLite, which is restored into the data folder"
        )
        raise InvalidInput("database_url", found.render_as_string(hide_password=True), remedy)
    if kind == "sqlite":
        if url is not None:
            raise InvalidInput("database_url", url, "leave it out: SQLite is restored into the data folder")
        return
    dump = beside / DATABASE / DUMP
    if not dump.is_file():
        raise DamagedFile("backup", str(dump.name), "it holds no database: take another backup")
    fill_database(found, dump)

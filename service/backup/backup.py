"""Backup: the database first, then the files, while the service runs.

Why in this order: a job's folder is there before its row, and nothing in it is ever changed but by writing
beside and renaming. So the folder of every row in the copy of the database is there when the files are
copied, and may only be further than the row says. That is what the service itself finds after a kill, and
goes on from: chunks that are stored are not computed again. Files first would lose jobs accepted in
between. What could undo the order is a deletion, so retention waits until the backup is made.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from sdm_core.errors import InvalidInput
from sdm_core.version import __version__
from service.backup.archive import ArchiveWriter, refuse_unless_new
from service.backup.database_copy import copy_database
from service.jobs.job_folder import SCRATCH
from service.jobs.retention import nothing_deleted
from service.records.database import FILE, database_url
from service.rest.models_folder import models_folder
from service.settings import Settings

SCHEMA, ABOUT = "rubscreen/backup/1", "backup.json"
DATABASE, DATA = "database", "data"
# Where folders that were not in the data folder are put when it is restored.
MODELS, DATASETS, ANSWERS = "models", "datasets", "answers"
_WAIT_S = 600.0
ShowProgress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Made:
    """A backup.

    Attributes
    ----------
    files
        Files in it, the database's included.
    size_bytes
        Of the archive.
    """

    path: Path
    files: int
    size_bytes: int


def backup(settings: Settings, target: Path, progress: ShowProgress = lambda done, total, name: None) -> Made:
    """Write everything a service keeps into one file, which appears whole or not at all.

    Parameters
    ----------
    settings
        Of the service; it may run meanwhile.
    progress
        Told MiB done, MiB in all, and what is copied.

    Raises
    ------
    InvalidInput
        When there is nothing to back up, the file is there already or in a folder that is backed up, or
        something cannot be read or written.
    """
    folder = settings.data_folder
    if folder is None or not (folder / "jobs").is_dir():
        raise InvalidInput("data_folder", str(folder), "give the data folder of a service")
    refuse_unless_new(target)
    sources = _sources(settings, folder)
    for _, source in sources:
        if target.resolve().is_relative_to(source.resolve()):
            raise InvalidInput("FILE", str(target), f"give a place outside of {source}, which is backed up")
    try:
        with (
            tempfile.TemporaryDirectory(dir=target.resolve().parent, prefix=f".{target.name}.") as beside,
            nothing_deleted(folder, _WAIT_S),
        ):
            made = _written(settings, folder, sources, Path(beside), progress)
            size = made[0].stat().st_size
            os.replace(made[0], target)
    except OSError as error:
        remedy = f"it cannot be written ({error.strerror or error}): make room, or give another place"
        raise InvalidInput("FILE", str(target), remedy) from None
    return Made(target, made[1], size)


def _written(
    settings: Settings,
    folder: Path,
    sources: list[tuple[str, Path]],
    beside: Path,
    progress: ShowProgress,
) -> tuple[Path, int]:
    progress(0, 1, "database")
    url = database_url(settings.database_url, folder)
    copies = beside / DATABASE
    copies.mkdir()
    databases = copy_database(url, copies)
    about = beside / ABOUT
    now = datetime.now(UTC).isoformat(timespec="seconds")
    kind = "sqlite" if url.drivername.startswith("sqlite") else "postgresql"
    about.write_text(
        json.dumps({"schema": SCHEMA, "version": __version__, "created_at": now, "database": kind}),
        encoding="utf-8",
    )
    skipped = (SCRATCH, FILE) if kind == "postgresql" else (SCRATCH, FILE, Path(url.database or "").name)
    total = sum(_size(path) for _, path in _files(sources, skipped)) + sum(_size(path) for path in databases)
    shown = _Shown(progress, total)
    path, count = beside / "archive", len(databases)
    # Keys' hashes are in it: nobody else's to read.
    opened = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with open(opened, "wb") as target, tempfile.TemporaryFile(dir=beside) as lines:
        archive = ArchiveWriter(target, lines, shown.more)
        archive.add(ABOUT, about)
        for copy in databases:
            shown.name = "database"
            archive.add(f"{DATABASE}/{copy.name}", copy)
        for name, source in _files(sources, skipped):
            shown.name = name.removeprefix(f"{DATA}/").partition("/")[0]
            try:
                archive.add(name, source)
            except FileNotFoundError:  # an upload that its sender deleted, say
                continue
            count += 1
        archive.close()
        target.flush()
        os.fsync(target.fileno())
    return path, count


def _sources(settings: Settings, folder: Path) -> list[tuple[str, Path]]:
    """(name in the archive, folder) of what is backed up: the data folder, and what lies elsewhere."""
    models, answers = models_folder(settings), settings.served_answers_folder
    outside = [(MODELS, models), (DATASETS, models.parent / "datasets")]
    if answers is not None:
        outside.append((ANSWERS, answers))
    here = folder.resolve()
    named = [
        (f"{DATA}/{name}", path)
        for name, path in outside
        if path.is_dir() and not path.resolve().is_relative_to(here)
    ]
    return [*named, (DATA, folder)]


def _files(sources: list[tuple[str, Path]], skipped: tuple[str, ...]) -> Iterator[tuple[str, Path]]:
    """(name in the archive, path) of every file, but those of the data folder whose names begin so."""
    taken = {name for name, _ in sources}
    for name, folder in sources:
        for found, path in _below(name, folder):
            top = found.removeprefix(f"{DATA}/").partition("/")[0]
            if name == DATA and (top.startswith(skipped) or f"{DATA}/{top}" in taken):
                continue
            yield found, path


def _below(name: str, folder: Path) -> Iterator[tuple[str, Path]]:
    """Files below a folder: first its own, then those of folders, listed only then.

    So a pointer to a model is copied before the models are listed, and what it names is among them. Names
    that begin with a dot or end with ``.partial`` are of files being written, and of locks.
    """
    for path in _entries(folder):
        if path.is_file() and not path.is_symlink():
            yield f"{name}/{path.name}", path
    for path in _entries(folder):
        if path.is_dir() and not path.is_symlink():
            yield from _below(f"{name}/{path.name}", path)


def _entries(folder: Path) -> list[Path]:
    try:
        names = sorted(os.listdir(folder))
    except FileNotFoundError:
        return []
    return [folder / name for name in names if not name.startswith(".") and not name.endswith(".partial")]


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0


class _Shown:
    """Progress in MiB."""

    def __init__(self, progress: ShowProgress, total: int) -> None:
        self._progress, self._total, self._done, self.name = progress, total, 0, ""

    def more(self, size: int) -> None:
        self._done += size
        self._progress(self._done // 2**20, max(self._total, self._done) // 2**20, self.name)

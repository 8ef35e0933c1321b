"""Files that are whole or not there at all, after a power cut too; and folders made the same way."""

from __future__ import annotations

import errno
import os
import shutil
import uuid
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from service.jobs.errors import NoRoom

INCOMING, REMOVED = ".incoming-", ".removed-"
_FULL = (errno.ENOSPC, errno.EDQUOT)


def is_full(error: OSError) -> bool:
    """Whether it is for want of room on the disk."""
    return error.errno in _FULL


def write_durably(path: Path, content: bytes) -> None:
    """Write beside `path`, force it to the disk, then rename.

    Raises
    ------
    OSError
        What lay at `path` is there still.
    """
    beside = path.with_name(f"{INCOMING}{uuid.uuid4().hex}")
    try:
        with beside.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Force a folder's list of names to the disk."""
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def make_folder_durably(folder: Path, fill: Callable[[Path], None]) -> None:
    """A folder that appears whole: filled beside its place (with `write_durably`), then renamed.

    Raises
    ------
    OSError
        Nothing is left of it then.
    """
    beside = folder.with_name(f"{INCOMING}{folder.name}")
    shutil.rmtree(beside, ignore_errors=True)
    try:
        beside.mkdir(parents=True)
        fill(beside)
        sync_folder(beside)
        os.replace(beside, folder)
    except BaseException:
        shutil.rmtree(beside, ignore_errors=True)
        raise
    sync_folder(folder.parent)


def remove_folder(folder: Path) -> None:
    """Take a folder away: first its name, so that nobody finds half of it."""
    away = folder.with_name(f"{REMOVED}{folder.name}")
    with suppress(FileNotFoundError):
        os.replace(folder, away)
    shutil.rmtree(away, ignore_errors=True)


def free_bytes(folder: Path) -> int:
    """Room left on the disk of a folder, for users other than root."""
    found = os.statvfs(folder)
    return found.f_bavail * found.f_frsize


def check_room(folder: Path, needed: int, reserve: int) -> None:
    """Refuse to write `needed` bytes where less than `reserve` would be left.

    The reserve keeps the database able to say that the disk is full.

    Raises
    ------
    NoRoom
        Naming the folder and what is left.
    """
    left = free_bytes(folder)
    if left - needed < reserve:
        remedy = f"make room: {_mib(needed + reserve)} must be free, {_mib(reserve)} of it are kept back"
        raise NoRoom("data_folder", f"{folder}, {_mib(left)} free", remedy)


def _mib(size: int) -> str:
    return f"{size / 2**20:,.1f} MiB"

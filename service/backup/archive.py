"""The file of a backup: a tar of plain files, whose last member lists every other with its SHA-256.

Both directions are streams, and neither keeps a list of members: a backup may hold a million chunks. The
list is compared as bytes with the one made while reading, so whatever was altered, cut off, added or put
in another order shows, in the list itself too.
"""

from __future__ import annotations

import hashlib
import json
import os
import tarfile
from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import IO

from sdm_core.errors import DamagedFile, InvalidInput

MANIFEST = "manifest.jsonl"
_PIECE = 2**20
# Of a name within the archive; longer ones come only from archives made to do harm.
_LONGEST_NAME = 1000
Progress = Callable[[int], None]


class ArchiveWriter:
    """An archive that is being written.

    Parameters
    ----------
    target
        Where it goes; stays open.
    lines
        An empty file that the list is collected in, read and write.
    progress
        Told the bytes of each piece written.
    """

    def __init__(self, target: IO[bytes], lines: IO[bytes], progress: Progress = lambda size: None) -> None:
        self._tar = tarfile.open(fileobj=target, mode="w|", format=tarfile.PAX_FORMAT)  # noqa: SIM115
        self._lines, self._progress = lines, progress

    def add(self, name: str, path: Path) -> int:
        """Add a file as it is now; its size.

        What is appended to it meanwhile stays outside: a log grows while it is copied.

        Raises
        ------
        FileNotFoundError
            When it is not there; nothing is added then.
        OSError
            When it becomes shorter meanwhile, or the archive cannot be written.
        """
        with path.open("rb") as file:
            found = os.fstat(file.fileno())
            member = tarfile.TarInfo(name)
            member.size, member.mtime, member.mode = found.st_size, int(found.st_mtime), 0o600
            digested = _Digested(file, self._progress)
            self._tar.addfile(member, digested)
        self._tar.members.clear()  # type: ignore[attr-defined]  # or it keeps them all
        self._lines.write(_line(member, digested.digest))
        return found.st_size

    def close(self) -> None:
        """Add the list, and end the archive."""
        self._lines.flush()
        self._lines.seek(0)
        member = tarfile.TarInfo(MANIFEST)
        member.size, member.mode = os.fstat(self._lines.fileno()).st_size, 0o600
        self._tar.addfile(member, self._lines)
        self._tar.close()


def extract(source: IO[bytes], folder: Path, lines: IO[bytes], progress: Progress = lambda size: None) -> int:
    """Write the files of an archive below `folder`; only when this returns can they be believed.

    Parameters
    ----------
    folder
        An empty one.
    lines
        An empty file that the list is collected in, read and write.

    Returns
    -------
    How many files there were.

    Raises
    ------
    DamagedFile
        When the archive is no backup, not whole, or not what was written.
    OSError
        When a file cannot be written.
    """
    try:
        return _extracted(source, folder, lines, progress)
    except (tarfile.TarError, EOFError, UnicodeError, ValueError) as error:
        raise _damaged(source, f"it cannot be read as one ({error})") from None


def _extracted(source: IO[bytes], folder: Path, lines: IO[bytes], progress: Progress) -> int:
    count = 0
    with tarfile.open(fileobj=source, mode="r|") as tar:
        while (member := tar.next()) is not None:
            tar.members.clear()  # type: ignore[attr-defined]
            plain = member.type in (tarfile.REGTYPE, tarfile.AREGTYPE) and not member.issparse()
            content = tar.extractfile(member) if plain else None
            if content is None:
                raise _damaged(source, f"{member.name!r} is no plain file")
            if member.name == MANIFEST:
                _check_list(source, content, lines)
                if tar.next() is not None:
                    raise _damaged(source, "something follows its list")
                return count
            path = _place(source, folder, member.name)
            path.parent.mkdir(parents=True, exist_ok=True)
            digested = _Digested(content, progress)
            with path.open("xb") as file:
                while piece := digested.read(_PIECE):
                    file.write(piece)
            os.utime(path, (member.mtime, member.mtime))
            lines.write(_line(member, digested.digest))
            count += 1
    raise _damaged(source, "its end is missing")


def _place(source: IO[bytes], folder: Path, name: str) -> Path:
    """Where a member goes: below the folder, and where nothing is yet."""
    parts = PurePosixPath(name).parts
    plain = "/".join(parts) == name and not name.startswith("/") and len(name) <= _LONGEST_NAME
    if not plain or not parts or ".." in parts or "\0" in name or "\\" in name:
        raise _damaged(source, f"{name[:100]!r} is no name of a file in a backup")
    path = folder.joinpath(*parts)
    if path.exists():
        raise _damaged(source, f"{name!r} is there twice")
    return path


def _check_list(source: IO[bytes], listed: IO[bytes], lines: IO[bytes]) -> None:
    lines.flush()
    lines.seek(0)
    for line in lines:
        told = listed.readline(len(line) + _LONGEST_NAME)
        if told != line:
            name = json.loads(line)["name"]
            raise _damaged(source, f"{name!r} is not what was written")
    if listed.read(1):
        raise _damaged(source, "files of its list are missing")


def _line(member: tarfile.TarInfo, digest: str) -> bytes:
    entry = {"name": member.name, "size": member.size, "mtime": int(member.mtime), "sha256": digest}
    return json.dumps(entry).encode() + b"\n"


def _damaged(source: IO[bytes], what: str) -> DamagedFile:
    name = str(getattr(source, "name", "backup"))
    return DamagedFile("backup", name, f"{what}: take another backup; nothing of this one was kept")


class _Digested:
    """A file whose SHA-256 is known once it is read."""

    def __init__(self, file: IO[bytes], progress: Progress) -> None:
        self._file, self._progress, self._sha256 = file, progress, hashlib.sha256()

    def read(self, size: int = -1) -> bytes:
        piece = self._file.read(size)
        self._sha256.update(piece)
        self._progress(len(piece))
        return piece

    @property
    def digest(self) -> str:
        return self._sha256.hexdigest()


def refuse_unless_new(path: Path) -> None:
    """Let no backup overwrite a file, an older backup least of all.

    Raises
    ------
    InvalidInput
    """
    if path.exists():
        raise InvalidInput("FILE", str(path), "it is there already: give another name")

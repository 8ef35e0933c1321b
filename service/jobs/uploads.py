"""Files of blades sent ahead of a job: kept under names of our own, and never unpacked to the disk."""

from __future__ import annotations

import hashlib
import json
import os
import re
import uuid
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from sdm_core.errors import InvalidInput
from sdm_core.interruption import checkpoint
from sdm_core.json_members import parse_json
from service.jobs.durable_files import INCOMING, check_room, remove_folder, sync_folder, write_durably
from service.jobs.errors import DamagedUpload, NoSuchUpload, UploadTooLarge
from service.jobs.upload_quota import UploadQuota

JSON, LINES, ZIP = "application/json", "application/x-ndjson", "application/zip"
FORMS = (JSON, LINES, ZIP)
_CONTENT, ABOUT = "content", "about.json"
_ID = re.compile(r"[0-9a-f]{32}")
# A blade file of the largest size the service takes is a tenth of this.
_LARGEST_BLADE = 32 * 2**20
# Compressed JSON of numbers is a third to a tenth of its size; far beyond that a zip is made to do harm.
_MOST_INFLATED = 200
_MOST_UNPACKED = 4 * 2**30
_LOOK_EVERY = 8 * 2**20  # bytes, whether there still is room


@dataclass(frozen=True)
class Upload:
    """A file that was sent.

    Attributes
    ----------
    id
        32 hexadecimal digits, made of all the rest: the same file sent again by the same key is the same one.
    name
        As its sender calls it: only ever shown.
    form
        One of `FORMS`.
    owner
        The key it came with; None without keys.
    """

    id: str
    name: str
    form: str
    size_bytes: int
    sha256: str
    owner: str | None


class UploadWriter:
    """A file that is arriving, from `owner`."""

    def __init__(
        self, folder: Path, most_bytes: int, reserve_bytes: int, quota: UploadQuota, owner: str | None
    ) -> None:
        self._folder, self._most, self._reserve = folder, most_bytes, reserve_bytes
        self._quota, self._owner = quota, owner
        self._beside = folder / f"{INCOMING}{uuid.uuid4().hex}"
        self._beside.mkdir(parents=True)
        self._file = (self._beside / _CONTENT).open("xb")
        self._digest, self._size, self._counted = hashlib.sha256(), 0, 0

    def write(self, part: bytes) -> None:
        """Take a part of it.

        Raises
        ------
        UploadTooLarge, TooManyUploads
        OSError
            A full disk, say.
        """
        self._size += len(part)
        self._counted += len(part)
        self._quota.arrive(self._owner, len(part))
        if self._size > self._most:
            found = f"over {self._most} bytes"
            raise UploadTooLarge("body", found, f"send at most {self._most} bytes: split the file")
        if self._size // _LOOK_EVERY > (self._size - len(part)) // _LOOK_EVERY:
            check_room(self._folder, 0, self._reserve)
            os.utime(self._beside)  # it is still arriving: not left over
        self._digest.update(part)
        self._file.write(part)

    def whole(self, name: str, form: str) -> Upload:
        """All of it has come and is on the disk; it is nobody's upload before it is kept.

        Raises
        ------
        OSError
        """
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()
        digest, owner = self._digest.hexdigest(), self._owner
        told = json.dumps([name, form, self._size, digest, owner])
        return Upload(hashlib.sha256(told.encode()).hexdigest()[:32], name, form, self._size, digest, owner)

    def documents(self, upload: Upload, most: int) -> Iterator[tuple[str, Any]]:
        """What has come, as `Uploads.documents`."""
        return _documents(self._beside / _CONTENT, upload, most)

    def keep(self, upload: Upload) -> None:
        """Make it an upload, once however often it was sent.

        Raises
        ------
        TooManyUploads
            It is to be abandoned then, as with any other error.
        OSError
        """
        write_durably(self._beside / ABOUT, json.dumps(asdict(upload)).encode())
        with self._quota.room_for(upload.id, self._owner, self._size):
            self._put(self._folder / upload.id)
        self._arrived()

    def _put(self, place: Path) -> None:
        try:
            os.utime(place / ABOUT)  # sent before, and kept as if sent now (`old_uploads`)
        except FileNotFoundError:
            try:
                os.replace(self._beside, place)
            except OSError:
                if not (place / ABOUT).is_file():  # nor is the same file just arriving a second time
                    raise
                remove_folder(self._beside)
        else:
            remove_folder(self._beside)
        sync_folder(self._folder)

    def abandon(self) -> None:
        """Remove what has come."""
        self._file.close()
        remove_folder(self._beside)
        self._arrived()

    def _arrived(self) -> None:
        """It is kept, or gone: in neither case does it arrive."""
        self._quota.arrive(self._owner, -self._counted)
        self._counted = 0


class Uploads:
    """The files under a folder.

    Parameters
    ----------
    most_bytes
        Of one file.
    reserve_bytes
        Room to leave on the disk.
    most_bytes_of_owner
        Of all files of one owner together; 0 is as many as the disk holds.
    """

    def __init__(
        self, folder: Path, most_bytes: int, reserve_bytes: int, most_bytes_of_owner: int = 0
    ) -> None:
        self._folder, self._most, self._reserve = folder, most_bytes, reserve_bytes
        self._quota = UploadQuota(folder, most_bytes_of_owner, ABOUT)

    def begin(self, announced_bytes: int = 0, owner: str | None = None) -> UploadWriter:
        """Make ready for a file of that owner.

        Raises
        ------
        UploadTooLarge, NoRoom
        """
        if announced_bytes > self._most:
            remedy = f"send at most {self._most} bytes: split the file"
            raise UploadTooLarge("body", f"{announced_bytes} bytes", remedy)
        check_room(self._folder, announced_bytes, self._reserve)
        return UploadWriter(self._folder, self._most, self._reserve, self._quota, owner)

    def get(self, upload_id: str, owner: str | None) -> Upload:
        """A file of this owner; None may see every one's.

        Raises
        ------
        NoSuchUpload
        """
        if isinstance(upload_id, str) and _ID.fullmatch(upload_id):  # and so no path
            try:
                upload = Upload(**json.loads((self._folder / upload_id / ABOUT).read_bytes()))
            except (OSError, ValueError, TypeError):
                upload = None
            if upload is not None and owner in (None, upload.owner):
                return upload
        raise NoSuchUpload(
            "upload", upload_id, "give the id of an upload of yours; old ones are deleted in time"
        )

    def remove(self, upload_id: str, owner: str | None) -> None:
        """Delete a file; raises as `get`."""
        remove_folder(self._folder / self.get(upload_id, owner).id)

    def documents(self, upload: Upload, most: int) -> Iterator[tuple[str, Any]]:
        """(source, parsed JSON) of each blade in a file, at most `most`.

        Raises
        ------
        InvalidInput
            Naming the place within the file that is no JSON.
        UploadTooLarge
            For more blades, or a zip that inflates beyond measure.
        NoSuchUpload
            When it was deleted meanwhile.
        """
        try:
            yield from _documents(self._folder / upload.id / _CONTENT, upload, most)
        except FileNotFoundError:
            raise NoSuchUpload("upload", upload.id, "send the file again: it was just deleted") from None


def old_uploads(folder: Path, before: datetime) -> list[Path]:
    """Folders of the uploads under `folder` that were whole before that time."""
    return [
        path for path in sorted(folder.iterdir()) if _ID.fullmatch(path.name) and _came_before(path, before)
    ]


def remove_uploads(folders: Iterable[Path], before: datetime) -> None:
    """Delete uploads that were not sent again since; what a job was made of them it has already."""
    for folder in folders:
        if _came_before(folder, before):
            remove_folder(folder)


def _came_before(upload: Path, before: datetime) -> bool:
    try:
        # The file's time, not its folder's: that is a new one when it comes from a backup.
        return (upload / ABOUT).stat().st_mtime < before.timestamp()
    except FileNotFoundError:  # its sender deletes it just now
        return False


def _documents(path: Path, upload: Upload, most: int) -> Iterator[tuple[str, Any]]:
    read = {JSON: _of_json, LINES: _of_lines, ZIP: _of_zip}[upload.form]
    for count, (source, document) in enumerate(read(path, upload), 1):
        if count > most:
            raise UploadTooLarge(upload.name, f"more than {most} blades", "split the file")
        yield source, document


def _of_json(path: Path, upload: Upload) -> Iterator[tuple[str, Any]]:
    if upload.size_bytes > _LARGEST_BLADE:  # it is read whole, and a parser holds up every other request
        remedy = "send many blades one a line (application/x-ndjson), or in a zip"
        raise UploadTooLarge(upload.name, f"{upload.size_bytes} bytes as one JSON value", remedy)
    found = _parsed(path.read_bytes(), upload.name)
    if not isinstance(found, list):
        yield upload.name, found
        return
    for i, document in enumerate(found):
        yield f"{upload.name}[{i}]", document


def _of_lines(path: Path, upload: Upload) -> Iterator[tuple[str, Any]]:
    with path.open("rb") as file:
        for i, line in enumerate(iter(lambda: file.readline(_LARGEST_BLADE + 1), b""), 1):
            where = f"{upload.name}:{i}"
            checkpoint()
            if len(line) > _LARGEST_BLADE:
                raise UploadTooLarge(where, f"over {_LARGEST_BLADE} bytes", "give one blade a line")
            if line.strip():
                yield where, _parsed(line, where)


def _of_zip(path: Path, upload: Upload) -> Iterator[tuple[str, Any]]:
    try:
        with zipfile.ZipFile(path) as archive:
            wanted = [entry for entry in archive.infolist() if entry.filename.lower().endswith(".json")]
            if not wanted:
                raise InvalidInput(upload.name, "no *.json in it", "put blade files or profiles into the zip")
            inflated = sum(entry.file_size for entry in wanted)
            if inflated > _MOST_UNPACKED:
                found = f"{inflated} bytes unpacked"
                raise UploadTooLarge(upload.name, found, f"give at most {_MOST_UNPACKED}: split the file")
            for entry in wanted:
                where = f"{upload.name}/{entry.filename}"
                checkpoint()
                if entry.file_size > _MOST_INFLATED * max(entry.compress_size, 1):
                    found = f"{entry.compress_size} to {entry.file_size} bytes"
                    raise UploadTooLarge(where, found, f"a file in a zip may inflate {_MOST_INFLATED} times")
                with archive.open(entry) as member:
                    # Not what the list of contents says it is: that can lie.
                    content = member.read(_LARGEST_BLADE + 1)
                if len(content) > _LARGEST_BLADE:
                    remedy = f"give at most {_LARGEST_BLADE}"
                    raise UploadTooLarge(where, f"over {_LARGEST_BLADE} bytes", remedy)
                yield where, _parsed(content, where)
    except (
        zipfile.BadZipFile,
        EOFError,
        RuntimeError,
        NotImplementedError,
        OSError,
        UnicodeDecodeError,
    ) as error:
        remedy = f"send a whole zip without a password ({error})"
        raise DamagedUpload(upload.name, f"{upload.size_bytes} bytes", remedy) from None


def _parsed(content: bytes, where: str) -> Any:
    try:
        found = parse_json(content)
        if b"\\ud" in content.lower():  # half a surrogate pair is no character: no table could hold it
            json.dumps(found, ensure_ascii=False).encode()
    except InvalidInput as error:
        raise error.under(where) from None
    except (ValueError, RecursionError) as error:
        said = str(error) or "nested too deep"
        raise DamagedUpload(where, f"{len(content)} bytes", f"give JSON in UTF-8 ({said})") from None
    return found

"""How much of the disk the files of one owner may take up."""

from __future__ import annotations

import json
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from service.jobs.errors import TooManyUploads

_SHOWN = 20  # uploads in a refusal


@dataclass(frozen=True)
class _File:
    """What counts of a file that is kept."""

    owner: str | None
    size_bytes: int
    name: str


class UploadQuota:
    """Counts the files of each owner, kept and arriving.

    Those kept count for all replicas, since they lie in the one folder; those arriving for this process
    alone. So an owner has at most `most_bytes` in files, and as much again on its way to each replica: only
    once a file has come is it known whether it is one sent before, which takes up nothing more.

    Parameters
    ----------
    most_bytes
        Of one owner; 0 lets everybody send what the disk holds. Who needs no key has no quota.
    about
        Name of the file, in an upload's folder, that tells its owner and size.
    """

    def __init__(self, folder: Path, most_bytes: int, about: str) -> None:
        self._folder, self._most, self._about = folder, most_bytes, about
        self._lock = threading.Lock()
        self._known: dict[str, _File] = {}
        self._arriving: Counter[str] = Counter()

    def arrive(self, owner: str | None, size: int) -> None:
        """Count bytes that arrive, or with a negative size those that are done with.

        Raises
        ------
        TooManyUploads
            When more are arriving than may be kept; they are counted all the same.
        """
        if owner is None or not self._most:
            return
        with self._lock:
            self._arriving[owner] += size
            arriving = self._arriving[owner]
            if not arriving:
                del self._arriving[owner]
        if size > 0 and arriving > self._most:
            raise self._refusal(owner, f"{arriving:,} bytes are arriving")

    @contextmanager
    def room_for(self, upload_id: str, owner: str | None, size: int) -> Iterator[None]:
        """Put a file into its place within this block: nobody else does meanwhile.

        Raises
        ------
        TooManyUploads
            When it is a new one, and one too many.
        """
        if owner is None or not self._most:
            yield
            return
        with self._lock:
            kept = self._kept(owner)
            taken = sum(file.size_bytes for file in kept.values())
            if upload_id not in kept and taken + size > self._most:
                raise self._refusal(owner, f"{taken:,} bytes are kept, {size:,} came", kept)
            yield

    def _refusal(self, owner: str, found: str, kept: dict[str, _File] | None = None) -> TooManyUploads:
        remedy = (
            f"at most {self._most:,} of one key are kept: delete files that jobs were made of already "
            "(DELETE /v1/uploads/ID), or wait until they are deleted by age"
        )
        largest = sorted((kept or {}).items(), key=lambda entry: -entry[1].size_bytes)[:_SHOWN]
        shown: list[dict[str, Any]] = [
            {"id": upload_id, "name": file.name, "size_bytes": file.size_bytes} for upload_id, file in largest
        ]
        return TooManyUploads("uploads", f"{found} for key {owner}", remedy, shown)

    def _kept(self, owner: str) -> dict[str, _File]:
        """The files of an owner; each was looked into once, since none ever changes."""
        there = {path.name: path for path in self._folder.iterdir() if not path.name.startswith(".")}
        for gone in self._known.keys() - there.keys():
            del self._known[gone]
        for name in there.keys() - self._known.keys():
            try:
                told = json.loads((there[name] / self._about).read_bytes())
                self._known[name] = _File(told["owner"], told["size_bytes"], told["name"])
            except (OSError, ValueError, KeyError, TypeError):  # being deleted, or nothing of ours
                continue
        return {name: file for name, file in self._known.items() if file.owner == owner}

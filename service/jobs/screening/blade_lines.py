"""The blades of a job: a line of JSON each, read a chunk at a time, so that thousands need little memory."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from sdm_core.blade import Blade, blade_from_dict
from sdm_core.blade.build import build_blade
from sdm_core.blade.profile import SCHEMA as PROFILE_SCHEMA
from sdm_core.blade.profile import profile_from_dict
from sdm_core.errors import DamagedFile

FILE = "blades.jsonl"


@dataclass(frozen=True)
class BladeLine:
    """A blade file or profile as it came.

    Attributes
    ----------
    index
        Place in the job, from 0.
    source
        Where it came from, as its sender wrote it: ``blades[3]``, ``batch.zip/a.json``.
    document
        The parsed JSON of a blade file or of a profile.
    """

    index: int
    source: str
    document: dict[str, Any]

    @property
    def name(self) -> str:
        """Of the blade, where it has one."""
        return str(self.document.get("name", self.source))

    @property
    def profile(self) -> bool:
        """Whether it has to be built first."""
        return self.document.get("schema") == PROFILE_SCHEMA

    def blade(self) -> Blade:
        """The blade; a profile is built by finite elements, which takes seconds.

        Raises
        ------
        InvalidInput
            When it is none.
        """
        if self.profile:
            return build_blade(profile_from_dict(self.document), verify=False).blade
        return blade_from_dict(self.document)

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {"index": self.index, "source": self.source, "document": self.document}


@dataclass(frozen=True)
class Written:
    """What was written: how many blades, and whether profiles are among them."""

    blades: int
    profiles: bool


def write(folder: Path, lines: Iterable[BladeLine]) -> Written:
    """Write the blades of a job as they come, and force them to the disk."""
    blades, profiles = 0, False
    with (folder / FILE).open("xb") as file:
        for line in lines:
            blades, profiles = blades + 1, profiles or line.profile
            file.write(encode([line]))
        file.flush()
        os.fsync(file.fileno())
    return Written(blades, profiles)


def encode(lines: Iterable[BladeLine]) -> bytes:
    """The content of `FILE`."""
    return b"".join(json.dumps(line.to_dict()).encode() + b"\n" for line in lines)


def read(folder: Path) -> Iterator[BladeLine]:
    """The blades of a job's folder, in order.

    Raises
    ------
    DamagedFile
        When the file is not what was written.
    """
    path = folder / FILE
    try:
        with path.open("rb") as file:
            for line in file:
                yield BladeLine(**json.loads(line))
    except (OSError, ValueError, TypeError) as error:
        remedy = f"restore it from a backup, or send the request again ({error})"
        raise DamagedFile("job", str(path), remedy) from None


def read_chunks(folder: Path, size: int) -> Iterator[tuple[int, list[BladeLine]]]:
    """(number, blades) of each chunk of `size` blades, in order."""
    lines, number = read(folder), 0
    while part := list(islice(lines, size)):
        yield number, part
        number += 1

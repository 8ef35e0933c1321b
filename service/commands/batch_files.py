"""Blade files of this machine on their way into a job of a service: packed into one zip."""

from __future__ import annotations

import json
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sdm_core.blade import EXAMPLES
from sdm_core.blade.profile import SCHEMA as PROFILE_SCHEMA
from sdm_core.blade.profile import profile_to_dict, read_profile
from sdm_core.errors import InvalidInput, RubscreenError
from sdm_core.json_file import read_json
from service.commands.blade_batch import BladePaths
from service.screening.batch import Failure

ARCHIVE = "batch.zip"
# The same files make the same bytes, and so the same upload and the same request.
_NO_DATE = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class PackedBlades:
    """What is to be sent.

    Attributes
    ----------
    archive
        Zip of the files, each under its path as typed; None where only examples were named.
    examples
        Their names.
    failures
        Files that hold no JSON, or a profile that cannot be read; they are not sent.
    """

    archive: Path | None
    examples: tuple[str, ...]
    failures: tuple[Failure, ...]


@contextmanager
def packed(paths: BladePaths, *, skip: bool) -> Iterator[PackedBlades]:
    """The files in a zip that is there until the block ends.

    Whether a blade can be screened is for the service to say; here only what it could not even take apart is
    found, and sections that a profile has in a file of their own are put into it.

    Parameters
    ----------
    skip
        Go on without what cannot be read, instead of raising.

    Raises
    ------
    RubscreenError
        For a file that cannot be read.
    """
    failures, many = [], 0
    examples = tuple(text for text in paths.files if text in EXAMPLES and not Path(text).exists())
    with tempfile.TemporaryDirectory(prefix="rubscreen-") as folder:
        archive = Path(folder) / ARCHIVE
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packing:
            for text in paths.files:
                if text in examples:
                    continue
                try:
                    document = _document(text)
                except RubscreenError as error:
                    if not skip:
                        raise
                    failures.append(Failure.of(text, error))
                    continue
                place = zipfile.ZipInfo(_within(text), _NO_DATE)
                place.compress_type = zipfile.ZIP_DEFLATED
                packing.writestr(place, json.dumps(document))
                many += 1
        yield PackedBlades(archive if many else None, examples, tuple(failures))


def as_typed(said: str) -> str:
    """What the service says of a file, by the path that was typed."""
    return said.replace(f"{ARCHIVE}/", "", 1)


def _document(text: str) -> Any:
    if not Path(text).exists() and not Path(text).suffix:
        raise InvalidInput("BLADE", text, f"give a blade file, a folder or one of {', '.join(EXAMPLES)}")
    document = read_json(Path(text), "blade file")
    if isinstance(document, dict) and document.get("schema") == PROFILE_SCHEMA:
        return profile_to_dict(read_profile(text))
    return document


def _within(text: str) -> str:
    return Path(text).as_posix().lstrip("/").removeprefix("./")

"""JSON files read with errors that name what is wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from sdm_core.errors import DamagedFile, InvalidInput
from sdm_core.json_members import parse_json

LARGEST_FILE_BYTES = 64 * 2**20


def read_json(path: Path, what: str) -> Any:
    """The parsed content of a JSON file.

    Parameters
    ----------
    what
        What it is, for errors: ``blade file``.

    Raises
    ------
    InvalidInput
        When there is no such file, it is over 64 MiB, or an object in it names a member twice.
    DamagedFile
        When it is not whole JSON.
    """
    try:
        if path.stat().st_size > LARGEST_FILE_BYTES:
            raise InvalidInput(what, str(path), "give a file under 64 MiB")
        text = path.read_text(encoding="utf-8-sig")  # Windows editors put a mark first
    except OSError as error:
        raise InvalidInput(what, str(path), f"give a readable file ({error.strerror})") from None
    except UnicodeDecodeError:
        raise DamagedFile(what, str(path), f"it is not UTF-8 text; give a JSON {what}") from None
    try:
        return parse_json(text)
    except InvalidInput as error:
        raise InvalidInput(f"{path.name}: {error.field}", error.value, error.remedy) from None
    except (json.JSONDecodeError, RecursionError) as error:
        raise DamagedFile(what, str(path), f"it is not whole JSON ({error}); export it again") from None

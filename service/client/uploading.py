"""Files of blades on their way to the service: as they are, or written from blades as they come."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from sdm_core.blade import EXAMPLES, Blade, blade_to_dict
from sdm_core.blade.profile import BladeProfile, profile_to_dict
from sdm_core.errors import InvalidInput
from service.client.conversations import one
from service.client.file_body import FileBody
from service.client.message import Conversation, Message
from service.field_values import nearest
from service.rest import replies
from service.rest.job_schemas import UploadReply

FORMS = {
    ".json": "application/json",
    ".ndjson": "application/x-ndjson",
    ".jsonl": "application/x-ndjson",
    ".zip": "application/zip",
}
LINES = FORMS[".ndjson"]
_UPLOAD_ID = re.compile(r"[0-9a-f]{32}")
BladeLike = Blade | BladeProfile | Mapping[str, Any] | UploadReply | str
"""A blade, a profile, either as a document, an upload (or its id), or the name of a shipped example."""
_WHAT = "give a Blade, a BladeProfile, a document, an upload or its id, or an example"


@dataclass(frozen=True)
class Entry:
    """An entry of `blades` as JSON.

    Attributes
    ----------
    document
        Whether it is a blade or profile itself, and not the name of one or of many.
    """

    content: bytes
    document: bool


def entry_of(blade: BladeLike, place: int) -> Entry:
    """A blade as the service is told of it.

    Raises
    ------
    InvalidInput
        Naming the entry, for what is none.
    """
    field = f"blades[{place}]"
    if isinstance(blade, Blade):
        return Entry(replies.to_json(blade_to_dict(blade)), True)
    if isinstance(blade, BladeProfile):
        return Entry(replies.to_json(profile_to_dict(blade)), True)
    if isinstance(blade, UploadReply):
        return Entry(replies.to_json({"upload": blade.id}), False)
    if isinstance(blade, str):
        return Entry(replies.to_json(_named(blade, field)), False)
    if not isinstance(blade, Mapping):
        raise InvalidInput(field, type(blade).__name__, _WHAT)
    try:
        content = replies.to_json(dict(blade))
    except TypeError as error:
        raise InvalidInput(field, type(blade).__name__, f"give what JSON can hold ({error})") from None
    return Entry(content, not ("upload" in blade or "example" in blade))


def _named(name: str, field: str) -> dict[str, str]:
    """An example or an upload by its name; what can be neither is not asked the service for.

    Raises
    ------
    InvalidInput
        With what was probably meant.
    """
    if name in EXAMPLES:
        return {"example": name}
    if _UPLOAD_ID.fullmatch(name):
        return {"upload": name}
    meant = nearest(name, list(EXAMPLES))
    if Path(name).suffix.lower() in FORMS or "/" in name or "\\" in name:
        remedy = (
            "a file is read first, read_blade(path) or read_profile(path), or sent ahead, client.upload(path)"
        )
    elif meant is not None:
        remedy = f"is the example {meant} meant?"
    else:
        remedy = (
            f"a text names an example ({', '.join(EXAMPLES)}) or is the id of an upload, 32 digits 0-9a-f"
        )
    raise InvalidInput(field, name, remedy)


def upload(
    source: str | os.PathLike[str] | bytes | Iterable[BladeLike], name: str | None
) -> Conversation[UploadReply]:
    """``POST /v1/uploads``, of a file, of its content, or of blades written one a line.

    Raises
    ------
    InvalidInput
        For a file that cannot be read, or whose form its name does not tell.
    """
    if isinstance(source, str | os.PathLike):
        told = name or Path(source).name
        form = _form(Path(source).name if name is None or not _told_by(name) else name)
        return (yield from send(FileBody.of(source), told, form))
    if isinstance(source, bytes):
        if name is None:
            raise InvalidInput("name", "left out", "give a name whose ending tells the form: batch.zip")
        return (yield from send(source, name, _form(name)))
    with tempfile.TemporaryDirectory(prefix="rubscreen-") as folder:
        path = Path(folder) / "blades.ndjson"
        with path.open("wb") as file:
            for place, blade in enumerate(source):
                entry = entry_of(blade, place)
                if not entry.document:
                    raise InvalidInput(f"blades[{place}]", blade, "upload blades, profiles and documents")
                file.write(entry.content + b"\n")
        return (yield from send(FileBody.of(path), name or "blades.ndjson", LINES))


def send(content: bytes | FileBody, name: str, form: str) -> Conversation[UploadReply]:
    """Send a file; the same one sent again is the same upload, so it may be repeated."""
    path = f"/v1/uploads?{urlencode({'name': name})}"
    return one(Message("POST", path, content, form), UploadReply)


def delete(upload_id: str) -> Conversation[None]:
    """``DELETE /v1/uploads/{id}``."""
    if not (upload_id.isascii() and upload_id.isalnum()):
        raise InvalidInput("upload", upload_id, "give the id of an upload")
    yield Message("DELETE", f"/v1/uploads/{upload_id}", repeatable=False)


def _told_by(name: str) -> str | None:
    return FORMS.get(Path(name).suffix.lower())


def _form(name: str) -> str:
    form = _told_by(name)
    if form is None:
        raise InvalidInput("path", name, f"give a file that ends in {', '.join(FORMS)}")
    return form

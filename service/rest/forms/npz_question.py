"""A question as npz: `speed_hz` and `ke` as arrays, the rest of it as JSON in the array `question`."""

from __future__ import annotations

import io
import struct
import tokenize
import zipfile
import zlib
from typing import Any

import numpy as np

from sdm_core.blade.exchange.named_arrays.npz import npy_array
from sdm_core.errors import DamagedFile, InvalidInput
from service.rest.body import parsed
from service.rest.forms.bulk_question import QUESTION, joined
from service.settings import Settings
from service.sizes import TooLarge

_MOST_ARRAYS = 16
_ENTRY = b"PK\x01\x02"  # starts every entry of an archive's table of contents
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_REMEDY = "send what numpy.savez writes: arrays of numbers, and `question` as text"
# What zipfile and numpy raise on bytes that are no npz, among them errors of the parser of array headers.
_DAMAGE = (
    ValueError,
    KeyError,
    TypeError,
    OSError,
    EOFError,
    SyntaxError,
    RuntimeError,  # RecursionError and NotImplementedError too
    MemoryError,
    OverflowError,
    IndexError,
    struct.error,
    tokenize.TokenError,
    zlib.error,
    zipfile.BadZipFile,
)


def npz_question(body: bytes, settings: Settings) -> dict[str, Any]:
    """The question in an npz, as the JSON form would have it but with arrays of numbers.

    Nothing is unpickled. What the archive would unpack to is known before any of it is unpacked, and may
    be no longer than a plain body.

    Raises
    ------
    InvalidInput
        Where it is no such archive, is damaged, or holds something else.
    TooLarge
        When unpacked it would be over `max_body_bytes`.
    """
    try:
        arrays = _arrays(body, settings.max_body_bytes)
        question = arrays.pop(QUESTION, None)
        if question is None or question.ndim != 0 or question.dtype.kind != "U":
            found = "missing" if question is None else f"{question.dtype} of shape {question.shape}"
            raise InvalidInput(QUESTION, found, "give it as text: numpy.array('{\"blade\": ...}')")
        text = str(question).encode()
    except DamagedFile as error:  # to the core a file of its own, here the client's
        raise InvalidInput("body", f"{error.field}: {error.value}", _REMEDY) from None
    except InvalidInput:
        raise
    except _DAMAGE as error:
        raise InvalidInput("body", f"{len(body)} bytes of npz", f"{_REMEDY} ({_said(error)})") from None
    return joined(parsed(text), arrays)


def _arrays(body: bytes, most_bytes: int) -> dict[str, np.ndarray]:
    # Before zipfile reads the table of contents: each entry costs it half a kilobyte.
    if body.count(_ENTRY) > 4 * _MOST_ARRAYS:
        raise InvalidInput("body", "an npz of very many arrays", _REMEDY)
    with zipfile.ZipFile(io.BytesIO(body)) as archive:
        members = archive.infolist()
        if len(members) > _MOST_ARRAYS:
            raise InvalidInput("body", f"an npz of {len(members)} arrays", _REMEDY)
        total = sum(member.file_size for member in members)
        if total > most_bytes:
            found = f"an npz of {total} bytes when unpacked"
            raise TooLarge("body", found, f"send at most {most_bytes} bytes: split the request")
        arrays: dict[str, np.ndarray] = {}
        for member in members:
            name = _name_of(member)
            if name in arrays:
                raise InvalidInput(name[:100], "two arrays of one name", "give each array once")
            arrays[name] = _array(archive, member)
        return arrays


def _name_of(member: zipfile.ZipInfo) -> str:
    name = member.filename
    if not name.endswith(".npy") or member.compress_type not in _COMPRESSIONS or member.flag_bits & 1:
        raise InvalidInput(
            "body", f"a member {name[:100]!r}", f"{_REMEDY}, neither encrypted nor of bzip2 or lzma"
        )
    return name.removesuffix(".npy")


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    with archive.open(member) as file:
        # The size is given: without it a member that lies about its own is unpacked whole first.
        content = file.read(member.file_size)
    if len(content) != member.file_size:
        raise InvalidInput("body", f"a member {member.filename[:100]!r} cut short", _REMEDY)
    return npy_array(member.filename[:100], content)


def _said(error: BaseException) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__

"""The bytes of a file to import, and one error for whatever is wrong with them."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sdm_core.errors import DamagedFile, InvalidInput, RubscreenError

# 9,000 nodes of quadratic hexahedra are 60 MB as ASCII triplets; ten times that with room.
LARGEST_FILE_BYTES = 2 * 2**30


def file_size(path: Path) -> int:
    """Bytes of a file that is there and can be read.

    Raises
    ------
    InvalidInput
        When there is no such file, it is a folder, or it is too large.
    DamagedFile
        When it is empty.
    """
    try:
        size = path.stat().st_size
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InvalidInput("file", str(path), f"give a readable file ({why})") from None
    if not path.is_file():
        raise InvalidInput("file", str(path), "it is not a file: name the files themselves")
    if size > LARGEST_FILE_BYTES:
        raise InvalidInput(
            "file", str(path), f"{size} bytes: give a file under {LARGEST_FILE_BYTES >> 30} GiB"
        )
    if size == 0:
        raise DamagedFile("file", str(path), "it is empty: export it again")
    return size


def file_bytes(path: Path) -> bytes:
    """All of a file (see `file_size`)."""
    file_size(path)
    try:
        return path.read_bytes()
    except OSError as error:
        raise InvalidInput("file", str(path), f"give a readable file ({error.strerror})") from None


def file_text(path: Path, what: str) -> str:
    """A text file as text: UTF-8 with or without byte order mark, or plain ASCII.

    Parameters
    ----------
    what
        The kind of file expected, as a noun for the error.

    Raises
    ------
    DamagedFile
        For UTF-16, binary content, or bytes that are no UTF-8 (Latin-1 is read where only comments
        hold it: numbers are ASCII).
    """
    data = file_bytes(path)
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise DamagedFile(path.name, "UTF-16 text", f"save the {what} as UTF-8 or plain text")
    if b"\x00" in data:
        raise DamagedFile(path.name, "binary content", f"give {what}, which is text")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        # Older exports carry accented comments in Latin-1; a picture or an archive does not look like this.
        if any(byte < 9 or 13 < byte < 32 for byte in set(data)):
            raise DamagedFile(path.name, "binary content", f"give {what}, which is text") from None
        return data.decode("latin-1")


@contextmanager
def named_damage(path: Path, what: str) -> Iterator[None]:
    """Whatever a damaged file does to a reader is one `DamagedFile` that names the file.

    Readers check what they can foresee and name it; this is for the rest, in particular for the
    many kinds of exceptions, and warnings, of the libraries below them.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except RubscreenError:
        raise
    except MemoryError:
        raise DamagedFile(
            path.name, "more memory than there is", f"the {what} is damaged or too large"
        ) from None
    except Exception as error:
        why = " ".join(str(error).split())[:120] or type(error).__name__
        raise DamagedFile(
            path.name, why, f"it cannot be read as {what}: export it again, or name its format"
        ) from None


def whole_lines(path: Path, text: str) -> None:
    """A text file ends with the end of a line: one that does not may have lost digits of its last number.

    Raises
    ------
    DamagedFile
        When the last line is not ended.
    """
    if not text.endswith(("\n", "\r")):
        raise DamagedFile(
            path.name,
            f"a last line {text.rpartition(chr(10))[2][-30:]!r} without end",
            "the file is cut off: export it again, or end its last line if it is whole",
        )

"""A file as the body of a request, read while it is sent."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from pathlib import Path

from sdm_core.errors import InvalidInput

_PART = 2**20


@dataclass(frozen=True)
class FileBody:
    """A file of a known size.

    Attributes
    ----------
    size
        Bytes.
    """

    path: Path
    size: int

    @classmethod
    def of(cls, path: str | os.PathLike[str]) -> FileBody:
        """The file as it is now.

        Raises
        ------
        InvalidInput
            When it cannot be read.
        """
        try:
            with open(path, "rb") as file:  # which says that a folder is none, and whether it may be read
                return cls(Path(path), os.fstat(file.fileno()).st_size)
        except OSError as error:
            remedy = f"give a file that can be read ({error.strerror or error})"
            raise InvalidInput("path", str(path), remedy) from None

    def parts(self) -> Iterator[bytes]:
        """Its content, from the beginning."""
        with self.path.open("rb") as file:
            while part := file.read(_PART):
                yield part

    async def parts_awaited(self) -> AsyncIterator[bytes]:
        """The same, read beside the event loop."""
        parts = self.parts()
        while part := await asyncio.to_thread(next, parts, b""):
            yield part

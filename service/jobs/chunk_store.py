"""Results of chunks on the disk: written beside, forced down, renamed; each named by its own checksum."""

from __future__ import annotations

import hashlib
import logging
import re
from collections.abc import Container, Iterator
from pathlib import Path

from sdm_core.errors import DamagedFile
from service.jobs.durable_files import write_durably

_NAME = re.compile(r"(\d{6,})-([0-9a-f]{32})\.npz")
logger = logging.getLogger("rubscreen.jobs")


class ChunkStore:
    """The stored chunks of a job, by number.

    Examples
    --------
    >>> import tempfile
    >>> store = ChunkStore(Path(tempfile.mkdtemp()))
    >>> store.put(3, b"results")
    >>> store.read(3), store.numbers()
    (b'results', {3})
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def put(self, number: int, content: bytes) -> None:
        """Store a chunk. The same content again changes nothing.

        Raises
        ------
        OSError
            A full disk, say: nothing is stored then.
        """
        self._folder.mkdir(parents=True, exist_ok=True)
        write_durably(self._folder / f"{number:06d}-{_checksum(content)}.npz", content)

    def numbers(self) -> set[int]:
        """Numbers of the chunks that are stored; their content is not looked at."""
        return set(self._paths())

    def names(self) -> dict[int, str]:
        """File names of the chunks that are stored: the same name has the same content."""
        return {number: path.name for number, path in self._paths().items()}

    def verified(self) -> set[int]:
        """Numbers of the chunks that are whole; one that is not is taken away, to be computed again."""
        return {number for number, _ in self.whole()}

    def whole(self) -> Iterator[tuple[int, bytes]]:
        """(number, content) of every chunk that is whole, in order; taken away like `verified`."""
        for number, path in sorted(self._paths().items()):
            try:
                content = self._content(path)
            except DamagedFile as error:
                logger.error("%s", error)
                path.unlink(missing_ok=True)
            else:
                yield number, content

    def read(self, number: int) -> bytes:
        """A chunk.

        Raises
        ------
        DamagedFile
            When it is not stored, or not whole.
        """
        path = self._paths().get(number)
        if path is None:
            raise DamagedFile("chunk", str(number), "it is not stored yet: wait for it, or retry the job")
        return self._content(path)

    def each(self, but: Container[int] = ()) -> Iterator[tuple[int, bytes]]:
        """(number, content) of every stored chunk, in order, `but` those of some numbers.

        Raises
        ------
        DamagedFile
            For the first that is not whole.
        """
        for number, path in sorted(self._paths().items()):
            if number not in but:
                yield number, self._content(path)

    def _paths(self) -> dict[int, Path]:
        if not self._folder.is_dir():
            return {}
        found = {}
        for path in sorted(self._folder.iterdir()):
            match = _NAME.fullmatch(path.name)
            if match is not None:
                found[int(match[1])] = path
        return found

    @staticmethod
    def _content(path: Path) -> bytes:
        try:
            content = path.read_bytes()
        except OSError as error:
            raise DamagedFile("chunk", str(path), f"it cannot be read ({error.strerror}): retry") from None
        match = _NAME.fullmatch(path.name)
        if match is None or _checksum(content) != match[2]:
            remedy = (
                f"its checksum does not hold ({len(content)} bytes): retry the job, which computes it again"
            )
            raise DamagedFile("chunk", str(path), remedy)
        return content


def _checksum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:32]

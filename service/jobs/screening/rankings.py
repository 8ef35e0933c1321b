"""The ranking of a job, read by pages: of its file once that is written, else of the chunks there are."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from sdm_core.errors import DamagedFile
from sdm_core.interruption import checkpoint
from service.jobs.chunk_store import ChunkStore
from service.jobs.job_folder import JobFolder
from service.jobs.screening.chunk_content import UnscreenedBlade
from service.jobs.screening.request import ScreeningRequest
from service.jobs.screening.results import (
    FILE,
    JOIN_AT,
    SCHEMA,
    UNRANKED,
    joined,
    rank_order,
    table_of,
    unscreened_of,
    with_ranks,
)

MOST_KEPT_BYTES = 256 * 2**20
_MOST_KEPT = 16


class Ranking(Protocol):
    """The rows of a job, safest first, of which a part is had without the rest."""

    @property
    def complete(self) -> bool:
        """Whether it is all of the job."""
        ...

    @property
    def rows(self) -> int:
        """How many there are."""
        ...

    @property
    def unscreened(self) -> list[UnscreenedBlade]:
        """The blades that were not screened."""
        ...

    def at(self, places: np.ndarray) -> pa.Table:
        """The rows of some places, counted from 0 and ascending, in full (`results.SCHEMA`)."""
        ...

    def columns(self, names: Sequence[str]) -> pa.Table:
        """Some columns of every row."""
        ...


class StoredRanking:
    """The ranking in a Parquet file.

    Raises
    ------
    DamagedFile
        Here, or when the part asked for cannot be read.
    """

    complete = True

    def __init__(self, path: Path) -> None:
        self._path = path
        with self._opened() as file:
            self.rows: int = file.metadata.num_rows
            self.unscreened = unscreened_of(file.schema_arrow)

    def at(self, places: np.ndarray) -> pa.Table:
        """Read from the groups of rows that the places are in."""
        with self._opened() as file:
            many = [file.metadata.row_group(group).num_rows for group in range(file.num_row_groups)]
            ends = np.cumsum(many)
            groups = np.searchsorted(ends, places, side="right")
            parts = [SCHEMA.empty_table()]
            for group in np.unique(groups):
                checkpoint()
                local = places[groups == group] - (ends[group] - many[group])
                parts.append(file.read_row_group(int(group)).replace_schema_metadata(None).take(local))
            return pa.concat_tables(parts)

    def columns(self, names: Sequence[str]) -> pa.Table:
        """Read no others."""
        with self._opened() as file:
            return file.read(list(names)).replace_schema_metadata(None)

    @contextmanager
    def _opened(self) -> Iterator[pq.ParquetFile]:
        try:
            with pq.ParquetFile(self._path) as file:
                yield file
        except (OSError, pa.ArrowException) as error:
            remedy = f"retry the job, which writes it again ({error})"
            raise DamagedFile("results", str(self._path), remedy) from None


@dataclass(frozen=True)
class PartialRanking:
    """The ranking of the chunks there were at one moment.

    Attributes
    ----------
    table
        Their rows, not ranked.
    order
        Places in it, safest first.
    """

    table: pa.Table
    order: np.ndarray
    unscreened: list[UnscreenedBlade]
    complete: bool = False

    @property
    def rows(self) -> int:
        """How many there are."""
        return len(self.order)

    def at(self, places: np.ndarray) -> pa.Table:
        """The rows of some places."""
        return with_ranks(self.table.take(self.order[places]), places + 1)

    def columns(self, names: Sequence[str]) -> pa.Table:
        """Some columns of every row."""
        found = [name for name in names if name != "rank"]
        table = self.table.select(found).take(self.order)
        if len(found) < len(names):
            table = with_ranks(table, np.arange(1, self.rows + 1)).select(list(names))
        return table


@dataclass
class _Kept:
    """What was read of a job's chunks."""

    names: dict[int, str] = field(default_factory=dict)
    ranking: PartialRanking = field(
        default_factory=lambda: PartialRanking(UNRANKED.empty_table(), np.zeros(0, int), [])
    )
    reading: threading.Lock = field(default_factory=threading.Lock)


class Rankings:
    """Rankings of jobs; those that are not complete are kept, so that a chunk is read once and not a page.

    Parameters
    ----------
    most_bytes
        Kept of all jobs together; the ones not asked for longest go first.
    """

    def __init__(self, most_bytes: int = MOST_KEPT_BYTES) -> None:
        self._most, self._lock = most_bytes, threading.Lock()
        self._kept: OrderedDict[Path, _Kept] = OrderedDict()

    def of(self, folder: JobFolder) -> Ranking:
        """The ranking of a job as it is now.

        Raises
        ------
        DamagedFile
            When a file of the job is not whole.
        """
        if (folder.path / FILE).is_file():
            with self._lock:
                self._kept.pop(folder.path, None)
            return StoredRanking(folder.path / FILE)
        with self._lock:
            kept = self._kept.setdefault(folder.path, _Kept())
            self._kept.move_to_end(folder.path)
        with kept.reading:  # a hundred pages at once read the chunks once
            _read_more(folder, kept)
            ranking = kept.ranking
        self._forget()
        return ranking

    @property
    def kept_bytes(self) -> int:
        """What the tables kept take up."""
        with self._lock:
            return sum(kept.ranking.table.nbytes for kept in self._kept.values())

    def _forget(self) -> None:
        while self.kept_bytes > self._most or len(self._kept) > _MOST_KEPT:
            with self._lock:
                if not self._kept:
                    return
                self._kept.popitem(last=False)


def _read_more(folder: JobFolder, kept: _Kept) -> None:
    """Read the chunks that came since; all of them where one of those read is there no more."""
    store = ChunkStore(folder.chunks)
    names = store.names()
    if any(names.get(number) != name for number, name in kept.names.items()):
        kept.names, kept.ranking = {}, _Kept().ranking
    if len(names) == len(kept.names):
        return
    criteria = ScreeningRequest.from_dict(folder.request()).criteria
    table, unscreened, read = kept.ranking.table, list(kept.ranking.unscreened), dict(kept.names)
    parts: list[pa.Table] = []
    try:
        for number, content in store.each(but=kept.names):
            checkpoint()
            if number not in names:  # it came just now: the next page has it
                continue
            more, failed = table_of(content, criteria)
            parts.append(more)
            unscreened += failed
            read[number] = names[number]
            if len(parts) == JOIN_AT:
                table, parts = joined([table, *parts]), []
    finally:  # who gave up waiting leaves to the next what was read
        table = joined([table, *parts])
        unscreened.sort(key=lambda blade: blade.index)
        kept.names, kept.ranking = read, PartialRanking(table, rank_order(table), unscreened)

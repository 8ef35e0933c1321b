"""Chunks of a job that are not stored yet: computed by the engine, a few at a time, and stored."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from functools import partial
from typing import Generic, TypeVar

from sdm_core.errors import RubscreenError
from service.jobs.chunk_store import ChunkStore
from service.jobs.control import Control
from service.jobs.durable_files import check_room, is_full
from service.jobs.engine import Engine, EngineGone
from service.jobs.errors import NoRoom
from service.jobs.job_folder import JobFolder

Part = TypeVar("Part")
# Chunks in the engine for each of its workers: enough that none waits, few enough that another job gets in.
_AHEAD = 2
LOOK_EVERY_S = 0.2
logger = logging.getLogger("rubscreen.jobs")


class ChunkRun(Generic[Part]):
    """One run of a job that consists of chunks.

    Parameters
    ----------
    engine
        Where chunks are computed.
    folder
        Of the job.
    control
        Of the run.
    reserve_bytes
        Room to leave on the disk.

    Attributes
    ----------
    store
        Where chunks are kept.
    """

    def __init__(self, engine: Engine, folder: JobFolder, control: Control, reserve_bytes: int) -> None:
        self._engine, self._folder, self._control = engine, folder, control
        self._reserve = reserve_bytes
        self.store = ChunkStore(folder.chunks)

    def compute(
        self,
        chunks: Iterator[tuple[int, Part]],
        submit: Callable[[Part], Future[bytes]],
        content: Callable[[Future[bytes], Part], bytes],
        stored: Callable[[Part, bytes], None],
    ) -> None:
        """Compute and store each of `chunks`, numbers and what they are made of.

        Parameters
        ----------
        submit
            Begins one in the engine.
        content
            What is to be stored, of one that is done.
        stored
            Told of each once it is.

        Raises
        ------
        Cancelled, HandedBack
            As `Control.check`; and whatever `content` raises, but `EngineGone`: then it is begun again.
        """
        control = self._control
        again: deque[tuple[int, Part]] = deque()
        pending: dict[Future[bytes], tuple[int, Part]] = {}
        try:
            while True:
                most = max(1, _AHEAD * self._slots())
                while len(pending) < most and (chunk := again.popleft() if again else next(chunks, None)):
                    self._folder.note(event="submitted", chunk=chunk[0])
                    try:
                        pending[submit(chunk[1])] = chunk
                    except EngineGone as gone:
                        again.append(chunk)
                        self._lost(gone)
                if not pending:
                    return
                done, _ = wait(pending, LOOK_EVERY_S, FIRST_COMPLETED)
                control.check()
                for future in done:
                    number, part = chunk = pending.pop(future)
                    try:
                        found = content(future, part)
                    except EngineGone as gone:
                        again.append(chunk)
                        self._lost(gone)
                        continue
                    self.keep(partial(self.store.put, number, found), len(found))
                    self._folder.note(event="stored", chunk=number)
                    stored(part, found)
        finally:
            for future in pending:
                future.cancel()

    def keep(self, write: Callable[[], None], size: int = 0) -> None:
        """Write, waiting for room on the disk as long as it takes: what was computed is not lost."""
        began = time.monotonic()

        def ready() -> str | None:
            try:
                check_room(self._control.folder, size, self._reserve)
                write()
            except NoRoom as full:
                return f"room on the disk: {full}"
            except OSError as error:
                if not is_full(error):
                    raise
                return "room on the disk: it is full"
            return None

        self._control.until(ready)
        if (waited := time.monotonic() - began) > 2.0:
            logger.warning("job %s waited %.0f s for the disk", self._control.job.id, waited)

    def _slots(self) -> int:
        """Workers there are; waits while there are none."""
        while True:
            try:
                slots = self._engine.slots()
            except EngineGone as gone:
                self._lost(gone)
                continue
            if slots:
                self._control.wait_for(None)
                return slots
            self._control.wait_for("a worker: the scheduler has none")
            self._control.sleep(1.0)

    def _lost(self, gone: RubscreenError) -> None:
        self._control.wait_for(f"the workers: {gone}")
        self._control.sleep(1.0)

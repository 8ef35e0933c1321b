"""The run of a screening: chunks that are not stored yet are computed, a few at a time, and stored."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from concurrent.futures import Future, wait
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from sdm_core.interruption import interruptible
from service.jobs.chunk_run import LOOK_EVERY_S, ChunkRun
from service.jobs.control import Control
from service.jobs.engine import Engine, WorkerKilled
from service.jobs.job_folder import JobFolder
from service.jobs.screening.blade_lines import BladeLine, read_chunks
from service.jobs.screening.chunk import chunk_payload, compute_in_worker
from service.jobs.screening.chunk_content import ChunkContent, UnscreenedBlade, rows_of
from service.jobs.screening.request import ScreeningRequest
from service.jobs.screening.results import write_results
from service.jobs.screening.watched import OnStored

_ALONE_KILLS = "its computation ended the worker, in each of several tries: too large, or a fault of ours"
logger = logging.getLogger("rubscreen.jobs")


@dataclass
class _Tally:
    """Blades of the job, those stored, and those of them not screened."""

    total: int
    done: int = 0
    not_screened: int = 0


class ScreeningKind:
    """Runs screening jobs.

    Parameters
    ----------
    engine
        Where chunks are computed.
    limits
        Settings that bound what the exact core is asked (`service.sizes.check_reach`).
    reserve_bytes
        Room to leave on the disk.
    models_folder
        Where the models are now: not always where they were when the job was accepted, for the data may have
        moved. None takes the request's word.
    on_stored
        Told of every chunk, once it is stored.
    """

    def __init__(
        self,
        engine: Engine,
        limits: Mapping[str, Any],
        reserve_bytes: int,
        models_folder: Path | None = None,
        on_stored: OnStored = lambda content: None,
    ) -> None:
        self._engine, self._limits, self._reserve = engine, dict(limits), reserve_bytes
        self._models, self._on_stored = models_folder, on_stored

    def run(self, folder: JobFolder, control: Control) -> None:
        """Compute what is not stored, then write the ranking.

        Raises
        ------
        DamagedFile
            When the job's own files are not what was written.
        InvalidInput
            When the model cannot be loaded.
        Cancelled, HandedBack
            As `Control.check`.
        """
        asked = folder.request()
        if self._models is not None:
            asked["models_folder"] = str(self._models.resolve())
        request = ScreeningRequest.from_dict(asked)
        run: ChunkRun[list[BladeLine]] = ChunkRun(self._engine, folder, control, self._reserve)
        control.report(stage="looking at what is stored", now=True)
        # Each is read once: to look a single one up means to list them all.
        stored = {}
        for number, content in run.store.whole():
            stored[number] = len(rows_of(content)[1])
            control.check()
        tally = _Tally(sum(1 for _ in read_chunks(folder.path, 1)))
        left = set()
        for number, blades in read_chunks(folder.path, request.blades_per_chunk):
            if number in stored:
                tally.done += len(blades)
                tally.not_screened += stored[number]
            else:
                left.add(number)
            control.check()
        control.report(total=tally.total, done=tally.done, not_screened=tally.not_screened, now=True)
        control.report(stage="starting workers", now=True)

        def told(blades: list[BladeLine], content: bytes) -> None:
            self._on_stored(content)
            tally.done += len(blades)
            tally.not_screened += len(rows_of(content)[1])
            control.report(done=tally.done, not_screened=tally.not_screened, stage="screening")

        run.compute(
            (c for c in read_chunks(folder.path, request.blades_per_chunk) if c[0] in left),
            lambda blades: self._submit(asked, blades, control),
            lambda future, blades: self._content(future, asked, blades, control),
            told,
        )
        control.report(stage="ranking", now=True)
        with interruptible(control.check):  # 100,000 rows take some twenty seconds
            run.keep(partial(write_results, folder, request))
        control.report(stage="", done=tally.done, now=True)

    def _submit(self, asked: dict[str, Any], blades: list[BladeLine], control: Control) -> Future[bytes]:
        payload = chunk_payload(asked, blades, self._limits)
        return self._engine.submit(compute_in_worker, payload, control.job.priority)

    def _content(
        self, future: Future[bytes], asked: dict[str, Any], blades: list[BladeLine], control: Control
    ) -> bytes:
        """The outcome of a chunk; where it kills its workers, of its blades one by one."""
        try:
            return self._engine.result(future)
        except WorkerKilled as killed:
            logger.error("a chunk of %s ends its workers (%s): blade by blade", blades[0].source, killed)
        parts = []
        for blade in blades:
            alone = self._submit(asked, [blade], control)
            try:
                while not wait([alone], LOOK_EVERY_S).done:
                    control.check()
            except BaseException:
                alone.cancel()
                raise
            try:
                parts.append(ChunkContent.from_bytes(self._engine.result(alone)))
            except WorkerKilled:
                lost = UnscreenedBlade(blade.index, blade.source, blade.name, _ALONE_KILLS)
                parts.append(ChunkContent((), (lost,)))
        return ChunkContent.joined(parts).to_bytes()

"""The run of a simulation: speeds that are not stored yet are simulated, then the exact lobes found."""

from __future__ import annotations

from concurrent.futures import Future
from functools import partial

from sdm_core.interruption import interruptible
from service.jobs.chunk_run import ChunkRun
from service.jobs.control import Control
from service.jobs.engine import Engine, WorkerKilled
from service.jobs.errors import TooLargeForWorker
from service.jobs.job_folder import JobFolder
from service.jobs.simulation.chunk import chunk_payload, chunks_of, compute_in_worker
from service.jobs.simulation.results import LOBES, has_lobes, lobes_content, whole_chunks
from service.simulation.order import SimulationOrder
from service.simulation.outcome import unstable_lobes


class SimulationKind:
    """Runs simulation jobs.

    Parameters
    ----------
    engine
        Where chunks are computed.
    reserve_bytes
        Room to leave on the disk.
    """

    def __init__(self, engine: Engine, reserve_bytes: int) -> None:
        self._engine, self._reserve = engine, reserve_bytes

    def run(self, folder: JobFolder, control: Control) -> None:
        """Simulate what is not stored.

        Raises
        ------
        DamagedFile
            When the job's request is not what was written.
        InvalidInput
            When a speed cannot be simulated.
        Cancelled, HandedBack
            As `Control.check`.
        """
        asked = folder.request()
        run: ChunkRun[list[float]] = ChunkRun(self._engine, folder, control, self._reserve)
        control.report(stage="looking at what is stored", now=True)
        stored = whole_chunks(folder)
        done = sum(len(speeds) for number, speeds in chunks_of(asked) if number in stored)
        control.report(total=len(asked["speed_hz"]), done=done, now=True)
        control.report(stage="starting workers", now=True)

        def told(speeds: list[float], content: bytes) -> None:
            nonlocal done
            done += len(speeds)
            control.report(done=done, stage="simulating")

        def content(future: Future[bytes], speeds: list[float]) -> bytes:
            try:
                return self._engine.result(future)
            except WorkerKilled:
                remedy = "it ended its worker, in each of several tries: give fewer revolutions or cells"
                raise TooLargeForWorker("speed_hz", f"{speeds[0]:g} to {speeds[-1]:g}", remedy) from None

        run.compute(
            (chunk for chunk in chunks_of(asked) if chunk[0] not in stored),
            lambda speeds: self._engine.submit(
                compute_in_worker, chunk_payload(asked, speeds), control.job.priority
            ),
            content,
            told,
        )
        if not has_lobes(folder):
            control.report(stage="exact lobes", now=True)
            with interruptible(control.check):
                lobes = unstable_lobes(SimulationOrder.from_dict(asked))
            found = lobes_content(lobes)
            run.keep(partial(run.store.put, LOBES, found), len(found))
        control.report(stage="", done=done, now=True)

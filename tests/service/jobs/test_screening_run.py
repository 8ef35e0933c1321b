"""The run of a screening over engines that fail: what was stored stays, and all of it gets done."""

from __future__ import annotations

import json
import os
import threading
from collections import Counter
from concurrent.futures import Future
from pathlib import Path

import pytest

from sdm_core.errors import Cancelled
from service.jobs.chunk_store import ChunkStore
from service.jobs.control import Control
from service.jobs.durable_files import free_bytes
from service.jobs.engine import EngineGone, WorkerKilled
from service.jobs.job import SCREENING, Job
from service.jobs.job_folder import JobFolder
from service.jobs.screening import blade_lines
from service.jobs.screening.blade_lines import BladeLine
from service.jobs.screening.chunk_content import ChunkContent, UnscreenedBlade
from service.jobs.screening.kind import ScreeningKind
from service.jobs.screening.rankings import Rankings
from service.jobs.screening.request import ScreeningRequest


class FakeEngine:
    """Answers at once with what names the blades asked about; fails as it is told."""

    def __init__(self, workers: int = 2) -> None:
        self.workers = workers
        self.asked: Counter[str] = Counter()
        self.deadly: set[str] = set()
        self.gone_at: set[int] = set()
        self.padding = 0
        self.stop_after: int | None = None
        self.stop = threading.Event()

    def slots(self) -> int:
        if len(self.gone_at) and sum(self.asked.values()) in self.gone_at:
            self.gone_at.discard(sum(self.asked.values()))
            raise EngineGone("the scheduler does not answer")
        return self.workers

    def submit(self, work, payload: bytes, priority: int) -> Future[bytes]:
        future: Future[bytes] = Future()
        names = [entry["source"] for entry in json.loads(payload)["blades"]]
        self.asked.update(names)
        if self.stop_after is not None and sum(self.asked.values()) >= self.stop_after:
            self.stop.set()
        if self.deadly.intersection(names):
            future.set_exception(WorkerKilled("it ended"))
        else:
            lines = [BladeLine(**entry) for entry in json.loads(payload)["blades"]]
            said = "no blade" + os.urandom(self.padding).hex()
            gone = tuple(UnscreenedBlade(b.index, b.source, b.name, said) for b in lines)
            future.set_result(ChunkContent((), gone).to_bytes())
        return future

    def result(self, future: Future[bytes]) -> bytes:
        return future.result(timeout=0)

    def close(self) -> None:
        pass


class Told(Control):
    """Keeps what it is told; cancels when the engine says so."""

    def __init__(self, folder: Path, engine: FakeEngine) -> None:
        super().__init__(Job("0" * 32, SCREENING), folder, None, threading.Event())  # type: ignore[arg-type]
        self.engine, self.waited_for, self.progress = engine, [], {}
        self.on_wait = None
        self.slept = 0

    def check(self) -> None:
        if self.engine.stop.is_set():
            raise Cancelled("stop")

    def sleep(self, seconds: float) -> None:
        self.check()
        self.slept += 1
        assert self.slept < 1000, self.waited_for[-1]
        if self.on_wait is not None:
            self.on_wait()

    def _say(self, values) -> None:
        self.progress |= values
        if values.get("waiting_for"):
            self.waited_for.append(values["waiting_for"])


BLADES, EACH = 20, 4
SOURCES = [f"blades[{i}]" for i in range(BLADES)]


def job_in(place: Path) -> JobFolder:
    place.mkdir(parents=True, exist_ok=True)
    asked = ScreeningRequest(blades_per_chunk=EACH).to_dict()
    (place / "request.json").write_text(json.dumps(asked))
    lines = [BladeLine(i, source, {"name": source}) for i, source in enumerate(SOURCES)]
    (place / blade_lines.FILE).write_bytes(blade_lines.encode(lines))
    return JobFolder(place)


def run(folder: JobFolder, engine: FakeEngine, reserve_bytes: int = 0) -> Told:
    told = Told(folder.path, engine)
    ScreeningKind(engine, {}, reserve_bytes).run(folder, told)
    return told


def unscreened(folder: JobFolder) -> list[UnscreenedBlade]:
    ranking = Rankings().of(folder)
    assert ranking.complete and ranking.rows == 0
    return ranking.unscreened


def test_every_blade_is_asked_about_once_and_told_in_order(tmp_path):
    engine, folder = FakeEngine(), job_in(tmp_path)
    told = run(folder, engine)
    assert engine.asked == Counter(SOURCES)
    assert [blade.source for blade in unscreened(folder)] == SOURCES
    assert (told.progress["done"], told.progress["total"], told.progress["not_screened"]) == (20, 20, 20)


def test_what_is_stored_is_not_computed_again(tmp_path):
    engine, folder = FakeEngine(workers=1), job_in(tmp_path)
    engine.stop_after = 3 * EACH
    with pytest.raises(Cancelled):
        run(folder, engine)
    stored = ChunkStore(folder.chunks).numbers()
    assert 0 < len(stored) < BLADES // EACH
    first = Counter(engine.asked)
    engine.stop_after = None
    engine.stop.clear()
    run(folder, engine)
    for i, source in enumerate(SOURCES):
        assert engine.asked[source] == first[source] + (i // EACH not in stored), source
    assert [blade.source for blade in unscreened(folder)] == SOURCES


def test_a_stored_chunk_that_rotted_is_computed_again_and_no_other(tmp_path):
    engine, folder = FakeEngine(), job_in(tmp_path)
    run(folder, engine)
    rotten = sorted(folder.chunks.iterdir())[2]
    content = rotten.read_bytes()
    rotten.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    (folder.path / "results.parquet").unlink()
    engine.asked.clear()
    run(folder, engine)
    assert engine.asked == Counter(SOURCES[2 * EACH : 3 * EACH])
    assert [blade.source for blade in unscreened(folder)] == SOURCES


def test_a_blade_that_ends_its_workers_costs_only_itself(tmp_path):
    engine, folder = FakeEngine(), job_in(tmp_path)
    engine.deadly = {SOURCES[5], SOURCES[19]}
    run(folder, engine)
    found = unscreened(folder)
    assert [blade.source for blade in found] == SOURCES
    assert {blade.source for blade in found if "ended the worker" in blade.reason} == engine.deadly


def test_a_job_waits_for_workers_that_are_gone_and_goes_on_when_they_are_back(tmp_path):
    engine, folder = FakeEngine(), job_in(tmp_path)
    engine.gone_at = {0, 4 * EACH}
    told = run(folder, engine)
    assert len(told.waited_for) == 2
    assert "the scheduler does not answer" in told.waited_for[0]
    assert told.waiting_for is None
    assert [blade.source for blade in unscreened(folder)] == SOURCES


def test_a_job_waits_while_there_is_no_worker_at_all(tmp_path):
    engine, folder = FakeEngine(workers=0), job_in(tmp_path)
    told = Told(folder.path, engine)

    def one_comes() -> None:
        engine.workers = 1

    told.on_wait = one_comes
    ScreeningKind(engine, {}, 0).run(folder, told)
    assert told.waited_for == ["a worker: the scheduler has none"]
    assert engine.asked == Counter(SOURCES)


@pytest.mark.parametrize("reserve_bytes", [0, 128 * 1024], ids=["full to the last byte", "with a reserve"])
def test_a_full_disk_makes_a_job_wait_and_nothing_is_lost(small_disk, reserve_bytes):
    folder = job_in(small_disk / "job")
    engine = FakeEngine(workers=1)
    engine.padding = 60_000  # 240 kB a chunk that does not compress: five of them do not fit
    ballast = small_disk / "other program's"
    ballast.write_bytes(b"x" * (free_bytes(small_disk) - 800_000))
    told = Told(folder.path, engine)
    seen = {}

    def make_room() -> None:
        seen["chunks"] = ChunkStore(folder.chunks).verified()
        seen["names"] = [path.name for path in folder.chunks.iterdir()]
        seen["free"] = free_bytes(small_disk)
        ballast.unlink(missing_ok=True)
        engine.padding = 0

    told.on_wait = make_room
    ScreeningKind(engine, {}, reserve_bytes).run(folder, told)
    assert "room on the disk" in told.waited_for[0]
    # While it waited: whole chunks alone, and the reserve untouched.
    assert 0 < len(seen["chunks"]) < BLADES // EACH
    assert not [name for name in seen["names"] if not name.endswith(".npz")]
    assert seen["free"] >= reserve_bytes
    assert told.waiting_for is None
    assert engine.asked == Counter(SOURCES)
    assert [blade.source for blade in unscreened(folder)] == SOURCES

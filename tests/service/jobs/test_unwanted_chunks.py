"""What nobody waits for any more is not computed to its end: workers are free for the next job."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from benchmarks.jobs.dask_cluster import DaskCluster
from sdm_core.blade import blade_to_dict, example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import Cancelled
from sdm_core.fourier_engagement import FourierEngagement
from sdm_core.interruption import interruptible
from service.jobs.engine import DaskEngine
from service.jobs.screening.blade_lines import BladeLine
from service.jobs.screening.checks import limits_of
from service.jobs.screening.chunk import chunk_payload, compute_chunk, compute_in_worker
from service.jobs.screening.chunk_content import rows_of
from service.jobs.screening.request import ScreeningRequest
from service.settings import Settings

# Half a minute a blade and contact, all by the exact core.
SLOW = {
    f"smooth {i}": ContactConfiguration({"LE": 1.0}, engagement=FourierEngagement(0.5, (0.3 + 0.01 * i,)))
    for i in range(20)
}
PATIENCE_S = 60.0
ROTOR = blade_to_dict(example_blade("nasa_rotor_37"))


def payload(*documents: dict, **asked) -> bytes:
    request = ScreeningRequest(policy="exact", map_shape=(4, 4), **asked)
    lines = [BladeLine(i, f"blades[{i}]", document) for i, document in enumerate(documents)]
    return chunk_payload(request.to_dict(), lines, limits_of(Settings()))


LONG = payload(*[ROTOR] * 20, contacts=SLOW)
SHORT = payload({"schema": "none", "name": "short"})

Engines = Callable[[], DaskEngine]


@pytest.fixture(params=["of this machine", "of a scheduler"])
def engines(request, tmp_path: Path) -> Iterator[Engines]:
    """Engines on one and the same worker, or each on one of its own."""
    with ExitStack() as stack:
        address = None
        if request.param == "of a scheduler":
            address = stack.enter_context(DaskCluster(tmp_path / "scratch", 1)).address

        def opened() -> DaskEngine:
            engine = DaskEngine(address, 1, tmp_path)
            stack.callback(engine.close)
            return engine

        yield opened


def begun(engine: DaskEngine) -> None:
    """Wait until the worker computes; what is submitted after that waits behind it."""
    end = time.monotonic() + PATIENCE_S
    while not any(engine._connected().processing().values()):
        assert time.monotonic() < end
        time.sleep(0.1)
    time.sleep(3.0)


def test_a_cancelled_chunk_leaves_its_worker_to_the_next(engines):
    engine = engines()
    assert rows_of(engine.submit(compute_in_worker, SHORT, 5).result(PATIENCE_S))[1]
    slow = engine.submit(compute_in_worker, LONG, 5)
    begun(engine)
    assert not slow.done()
    short = engine.submit(compute_in_worker, SHORT, 5)
    slow.cancel()
    assert rows_of(short.result(PATIENCE_S))[1][0].name == "short"


def test_the_chunk_of_a_service_that_is_gone_leaves_its_worker_to_the_next(tmp_path):
    with DaskCluster(tmp_path / "scratch", 1) as cluster:
        gone, other = DaskEngine(cluster.address, 1, tmp_path), DaskEngine(cluster.address, 1, tmp_path)
        gone.submit(compute_in_worker, LONG, 5)
        begun(gone)
        short = other.submit(compute_in_worker, SHORT, 5)
        gone.close()
        assert rows_of(short.result(PATIENCE_S))[1][0].name == "short"
        other.close()


def test_a_chunk_that_is_stopped_notes_no_blade_as_not_screened():
    def stop() -> None:
        raise Cancelled("enough")

    with pytest.raises(Cancelled), interruptible(stop):
        compute_chunk(payload(ROTOR))

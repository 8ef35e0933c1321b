"""The same job on workers of its own and on a scheduler that somebody else runs: the same results."""

from __future__ import annotations

import gc
import tracemalloc

from benchmarks.jobs.dask_cluster import DaskCluster
from benchmarks.jobs.engines import plain_loop, timed
from benchmarks.jobs.following import computed_after_stored, content_of
from benchmarks.jobs.variants import batch
from service.jobs.engine import DaskEngine


def large_result(payload: bytes) -> bytes:
    return payload[::-1]


def test_what_was_computed_leaves_no_memory_behind(tmp_path):
    engine = DaskEngine(None, 1, tmp_path)
    try:

        def compute(chunks: int) -> None:
            for number in range(chunks):
                payload = number.to_bytes(4, "big") * 50_000
                future = engine.submit(large_result, payload, 0)
                assert future.result(timeout=60) == payload[::-1]

        compute(5)
        tracemalloc.start()
        before, _ = tracemalloc.get_traced_memory()
        compute(40)
        gc.collect()
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
        engine.close()
    assert after - before < 1_000_000  # of 8 MB sent


def test_three_workers_of_which_one_is_killed_give_the_bits_of_a_plain_loop(tmp_path):
    with DaskCluster(tmp_path / "scratch") as cluster:
        job, _ = timed(tmp_path / "data", batch(60, 8), cluster)
    chunks = {digest for name, digest in content_of(tmp_path / "data", job).items() if name.endswith(".npz")}
    assert plain_loop(tmp_path / "data", job)[0] == chunks
    assert computed_after_stored(tmp_path / "data", job) == []

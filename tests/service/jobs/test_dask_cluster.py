"""The same job on workers of its own and on a scheduler that somebody else runs: the same results."""

from __future__ import annotations

from benchmarks.jobs.dask_cluster import DaskCluster
from benchmarks.jobs.engines import plain_loop, timed
from benchmarks.jobs.following import computed_after_stored, content_of
from benchmarks.jobs.variants import batch


def test_three_workers_of_which_one_is_killed_give_the_bits_of_a_plain_loop(tmp_path):
    with DaskCluster(tmp_path / "scratch") as cluster:
        job, _ = timed(tmp_path / "data", batch(60, 8), cluster)
    chunks = {digest for name, digest in content_of(tmp_path / "data", job).items() if name.endswith(".npz")}
    assert plain_loop(tmp_path / "data", job)[0] == chunks
    assert computed_after_stored(tmp_path / "data", job) == []

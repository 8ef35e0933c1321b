"""``python -m benchmarks.jobs.engines``: one job on a local cluster, on three workers, and in a plain loop.

The three workers and their scheduler are started by hand, and one worker is killed meanwhile. Results are
compared bit for bit; the overhead is the time on one worker over that of a plain loop over the same chunks in
this process.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import shutil
import time
from pathlib import Path

import torch

from benchmarks.jobs.dask_cluster import DaskCluster
from benchmarks.jobs.following import content_of, notes_of, submit, until_over
from benchmarks.jobs.service_process import ServiceProcess
from benchmarks.jobs.variants import batch
from service.jobs.screening.blade_lines import read_chunks
from service.jobs.screening.checks import limits_of
from service.jobs.screening.chunk import chunk_payload, compute_chunk
from service.settings import Settings


def timed(
    data: Path, question: dict, cluster: DaskCluster | None = None, **settings: object
) -> tuple[str, float]:
    """The job, and seconds from the first chunk submitted to the last stored."""
    where = {} if cluster is None else {"scheduler": cluster.address}
    with ServiceProcess(
        data, min_free_bytes=0, max_body_bytes=2**26, drain_s=0, **where, **settings
    ) as service:
        job = submit(service.url, question, "engines")
        killed = False

        def look(document: dict) -> None:
            nonlocal killed
            if cluster is not None and not killed and document["progress"]["done"] > 0:
                cluster.workers[0].kill()
                killed = True

        document = until_over(service.url, job, 3600.0, look)
        assert document["state"] == "done", document
        assert cluster is None or killed
    times = [note["at"] for note in notes_of(data, job) if note["event"] in ("submitted", "stored")]
    return job, _seconds(times[0], times[-1])


def plain_loop(data: Path, job: str) -> tuple[set[str], float]:
    """Checksums of the chunks of a job computed one after the other here, and the seconds."""
    torch.set_num_threads(1)  # as workers do
    folder = data / "jobs" / job
    request = json.loads((folder / "request.json").read_text())
    limits = limits_of(Settings())
    found, began = set(), time.perf_counter()
    for _, blades in read_chunks(folder, request["blades_per_chunk"]):
        found.add(hashlib.sha256(compute_chunk(chunk_payload(request, blades, limits))).hexdigest())
    return found, time.perf_counter() - began


def _seconds(first: str, last: str) -> float:
    from datetime import datetime

    return (datetime.fromisoformat(last) - datetime.fromisoformat(first)).total_seconds()


def main() -> None:
    """Measure, and say so."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blades", type=int, default=200)
    parser.add_argument("--grid", type=int, default=64)
    parser.add_argument("--folder", type=Path, default=Path("out/engines"))
    asked = parser.parse_args()
    shutil.rmtree(asked.folder, ignore_errors=True)
    question = batch(asked.blades, asked.grid)
    one, one_s = timed(asked.folder / "one", question, engine_workers=1)
    local, local_s = timed(asked.folder / "local", question, engine_workers=2)
    with DaskCluster(asked.folder / "scratch") as cluster:
        hand, hand_s = timed(asked.folder / "hand", question, cluster)
    expected = content_of(asked.folder / "local", local)
    chunks = {digest for name, digest in expected.items() if name.endswith(".npz")}
    same = content_of(asked.folder / "hand", hand) == expected == content_of(asked.folder / "one", one)
    looped, loop_s = plain_loop(asked.folder / "one", one)
    print(f"{asked.blades} blades x 2 contacts, {asked.grid} x {asked.grid}, {len(chunks)} chunks")
    print(f"plain loop {loop_s:.1f} s; one local worker {one_s:.1f} s: {one_s / loop_s - 1:+.1%}")
    print(f"two local workers {local_s:.1f} s; three by hand, one of them killed, {hand_s:.1f} s")
    print(f"bit-identical: {same and looped == chunks}")


if __name__ == "__main__":
    main()

"""``python -m benchmarks.jobs.kills``: one job, and its processes killed at random moments.

The service is killed (SIGKILL) at `--services` moments and a worker at `--workers` others; the outcome is
compared bit for bit with that of an undisturbed run."""

from __future__ import annotations

import argparse
import random
import shutil
import time
from contextlib import suppress
from pathlib import Path

import psutil

from benchmarks.jobs.following import (
    OVER,
    computed_after_stored,
    content_of,
    notes_of,
    state_of,
    submit,
    until_over,
)
from benchmarks.jobs.service_process import ServiceProcess
from benchmarks.jobs.variants import batch


def undisturbed(data: Path, question: dict, settings: dict) -> dict[str, str]:
    """Files of the job when nothing happens to it."""
    with ServiceProcess(data, **settings) as service:
        job = submit(service.url, question, "undisturbed")
        began = time.monotonic()
        end = until_over(service.url, job, 7200.0)
        print(f"undisturbed: {end['state']} in {time.monotonic() - began:.0f} s", flush=True)
        assert end["state"] == "done", end
        return content_of(data, job)


def killed(
    data: Path, question: dict, settings: dict, services: int, workers: int, rng: random.Random
) -> tuple[str, dict]:
    """Identifier and last document of a job whose processes are killed so often.

    With a `database_url` among the settings there are two replicas; another takes the place of a killed one,
    but for the last: that is gone for good.
    """
    kinds = ["service"] * services + ["worker"] * workers
    rng.shuffle(kinds)
    replicas = 2 if "database_url" in settings else 1
    running = [ServiceProcess(data, **settings).ready() for _ in range(replicas)]
    try:
        job = submit(running[0].url, question, "killed")
        for number, kind in enumerate(kinds, 1):
            _sleep_into_work(running[0], job, rng)
            document = state_of(running[0].url, job)
            if document["state"] in OVER:
                print(f"over after {number - 1} kills")
                break
            victim = rng.randrange(len(running))
            if kind == "worker":
                _kill_one(running[victim], rng)
            else:
                running[victim].kill()
                if replicas == 1 or "service" in kinds[number:]:
                    running[victim] = ServiceProcess(data, **settings).ready()
                else:
                    del running[victim]
            progress = document["progress"]
            print(f"kill {number:2d}, {kind}: {progress['done']} of {progress['total']} done", flush=True)
        return job, until_over(running[0].url, job, 3600.0)
    finally:
        for service in running:
            service.kill()


def _sleep_into_work(service: ServiceProcess, job: str, rng: random.Random) -> None:
    """To a random moment: one in four while it starts, the others some seconds into its work."""
    if rng.random() < 0.25:
        time.sleep(rng.uniform(0.0, 8.0))
        return
    before, end = state_of(service.url, job)["progress"]["done"], time.monotonic() + 90.0
    while time.monotonic() < end:
        now = state_of(service.url, job)
        if now["state"] in OVER or now["progress"]["done"] > before:
            break
        time.sleep(0.2)
    time.sleep(rng.uniform(0.0, 6.0))


def _kill_one(service: ServiceProcess, rng: random.Random) -> None:
    there = service.workers()
    if there:
        with suppress(psutil.NoSuchProcess):
            rng.choice(there).kill()


def main() -> None:
    """Measure, and say so."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blades", type=int, default=1000)
    parser.add_argument("--grid", type=int, default=64)
    parser.add_argument("--services", type=int, default=20)
    parser.add_argument("--workers", type=int, default=20)
    parser.add_argument("--database-url", help="of an empty PostgreSQL database: two replicas share it")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, default=Path("out/kills"))
    asked = parser.parse_args()
    shutil.rmtree(asked.folder, ignore_errors=True)
    question = batch(asked.blades, asked.grid)
    settings = {"min_free_bytes": 0, "max_body_bytes": 64 * 2**20, "log_level": "WARNING"}
    expected = undisturbed(asked.folder / "undisturbed", question, settings)
    data = asked.folder / "killed"
    if asked.database_url:
        settings |= {"database_url": asked.database_url, "job_lease_s": 5}
    rng = random.Random(asked.seed)
    job, document = killed(data, question, settings, asked.services, asked.workers, rng)
    found = content_of(data, job)
    submitted = sum(note["event"] == "submitted" for note in notes_of(data, job))
    runs = sum(note["event"] == "begun" for note in notes_of(data, job))
    print(f"state {document['state']}, runs {runs}, chunks {len(expected) - 1}, submitted {submitted}")
    print(f"computed again after it was stored: {computed_after_stored(data, job)}")
    print(f"bit-identical: {found == expected}")


if __name__ == "__main__":
    main()

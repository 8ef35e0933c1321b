"""A simulation whose service and workers are killed ends bit for bit as if nothing had happened."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psutil

from benchmarks.jobs.following import computed_after_stored, content_of, notes_of, submit, until_over
from benchmarks.jobs.service_process import ServiceProcess
from sdm_core.blade import blade_to_dict, example_blade

PATH = "/v1/simulations"
SETTINGS = {"engine_workers": 1, "min_free_bytes": 0, "models_poll_s": 0, "drain_s": 0}
# Six chunks of five speeds, each some seconds of one core.
QUESTION = {
    "blade": blade_to_dict(example_blade("nasa_rotor_37")),
    "speed_hz": np.linspace(90.0, 120.0, 30).tolist(),
    "revolutions": 100,
    "cells": 20_000,
}


def stopped_after(data: Path, job: str | None, chunks: int, worker: bool) -> str:
    """Run the service until so many speeds are stored, then kill it, or first its worker."""
    with ServiceProcess(data, **SETTINGS) as service:
        job = submit(service.url, QUESTION, "killed", PATH) if job is None else job

        def look(document: dict) -> None:
            if document["progress"]["done"] >= 5 * chunks:
                raise InterruptedError

        try:
            until_over(service.url, job, 240.0, look, PATH)
        except InterruptedError:
            for process in service.workers() if worker else ():
                process.kill()
                psutil.wait_procs([process], 10)
        service.kill()
    return job


def test_a_simulation_whose_service_and_worker_are_killed_ends_as_if_nothing_had_happened(tmp_path):
    quiet = tmp_path / "quiet"
    with ServiceProcess(quiet, **SETTINGS) as service:
        undisturbed = submit(service.url, QUESTION, "quiet", PATH)
        assert until_over(service.url, undisturbed, 240.0, path=PATH)["state"] == "done"
    data = tmp_path / "data"
    job = stopped_after(data, None, 1, worker=False)
    stopped_after(data, job, 3, worker=True)
    with ServiceProcess(data, **SETTINGS) as service:
        document = until_over(service.url, job, 240.0, path=PATH)
    assert document["state"] == "done", document
    assert content_of(data, job) == content_of(quiet, undisturbed)
    assert computed_after_stored(data, job) == []
    assert sum(note["event"] == "begun" for note in notes_of(data, job)) == 3

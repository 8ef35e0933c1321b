"""A disk that fills up under the whole service, its database on it: it says so, loses nothing, goes on."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx

from benchmarks.jobs.following import computed_after_stored, content_of, state_of, submit, until_over
from benchmarks.jobs.kills import undisturbed
from benchmarks.jobs.service_process import ServiceProcess
from benchmarks.jobs.variants import batch
from service.jobs.durable_files import free_bytes

SETTINGS = {"engine_workers": 1, "min_free_bytes": 0, "models_poll_s": 0, "drain_s": 0}
QUESTION = batch(40, 16)


def filled(place: Path) -> Path:
    """A file that takes all of the room there is, to the last byte."""
    ballast = place / "other program's"
    with ballast.open("ab", buffering=0) as file:
        for size in (65536, 1):
            try:
                while True:
                    file.write(b"x" * size)
            except OSError:
                continue
    assert free_bytes(place) == 0
    return ballast


def until(url: str, job: str, seen: Callable[[dict[str, Any]], bool], patience_s: float = 90.0) -> dict:
    """The first document of a job in which something is to be seen."""
    end = time.monotonic() + patience_s
    while not seen(document := state_of(url, job)):
        assert time.monotonic() < end, document
        time.sleep(0.1)
    return document


def test_a_full_disk_makes_the_service_wait_and_it_goes_on_when_there_is_room(small_disk, tmp_path):
    expected = undisturbed(tmp_path / "undisturbed", QUESTION, SETTINGS)
    data = small_disk / "data"
    with ServiceProcess(data, **SETTINGS) as service:
        job = submit(service.url, QUESTION, "full")
        until(service.url, job, lambda document: document["progress"]["done"] > 0)
        ballast = filled(small_disk)
        waiting = until(service.url, job, lambda document: document["state"] == "waiting")
        assert "room on the disk" in waiting["waiting_for"]
        with httpx.Client(base_url=service.url, timeout=60.0) as http:
            listed = http.get("/v1/screenings").json()["jobs"]
            assert [entry["state"] for entry in listed] == ["waiting"]
            not_ready = http.get("/readyz")
            assert (not_ready.status_code, not_ready.json()["field"]) == (503, "disk")
            refused = http.post("/v1/screenings", json=QUESTION, headers={"Idempotency-Key": "another"})
            assert (refused.status_code, refused.json()["field"]) == (507, "data_folder")
            # What needs no room goes on: answers, and the results so far.
            point = {"contact": {"weights": {"LE": 1.0}}, "speed_hz": [200.0], "ke": [5000.0]}
            asked = http.post("/v1/stability", json={"blade": QUESTION["blades"][0], **point})
            assert asked.status_code == 200
            so_far = http.get(f"/v1/screenings/{job}/results").json()
            assert so_far["total"] > 0 and not so_far["complete"]
        service.kill()
    service = ServiceProcess(data, **SETTINGS).ready(probe="/healthz")  # on the full disk
    try:
        until(service.url, job, lambda document: document["state"] == "waiting")
        ballast.unlink()
        document = until_over(service.url, job, 180.0)
        assert document["state"] == "done"
        assert [entry["id"] for entry in httpx.get(f"{service.url}/v1/screenings").json()["jobs"]] == [job]
    finally:
        service.kill()
    assert content_of(data, job) == expected
    assert computed_after_stored(data, job) == []

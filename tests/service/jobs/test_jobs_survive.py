"""Processes killed in the middle of a job: it ends complete, bit for bit as if nothing had happened.

``python -m benchmarks.jobs.kills`` does the same to a night's batch, forty times.
"""

from __future__ import annotations

import random
import time
from pathlib import Path

import httpx
import pytest
from postgres_server import empty_database, needs_postgres, running_postgres

from benchmarks.jobs.following import computed_after_stored, content_of, notes_of, submit, until_over
from benchmarks.jobs.kills import killed, undisturbed
from benchmarks.jobs.service_process import ServiceProcess
from benchmarks.jobs.variants import batch

SETTINGS = {"engine_workers": 2, "min_free_bytes": 0, "models_poll_s": 0, "drain_s": 0}
QUESTION = batch(60, 16)


@pytest.fixture(scope="module")
def expected(tmp_path_factory) -> dict[str, str]:
    return undisturbed(tmp_path_factory.mktemp("undisturbed"), QUESTION, SETTINGS)


def assert_whole(data: Path, job: str, document: dict, expected: dict[str, str]) -> None:
    assert document["state"] == "done", document
    assert content_of(data, job) == expected
    assert computed_after_stored(data, job) == []


def test_a_job_whose_service_and_workers_are_killed_ends_as_if_nothing_had_happened(tmp_path, expected):
    job, document = killed(tmp_path, QUESTION, SETTINGS, services=2, workers=2, rng=random.Random(3))
    assert_whole(tmp_path, job, document, expected)
    assert sum(note["event"] == "begun" for note in notes_of(tmp_path, job)) >= 2


@needs_postgres
def test_of_two_replicas_one_ends_the_jobs_of_the_other_that_is_gone_for_good(
    tmp_path, expected, postgres_url
):
    settings = SETTINGS | {"database_url": postgres_url, "job_lease_s": 3, "engine_workers": 1}
    job, document = killed(tmp_path, QUESTION, settings, services=2, workers=1, rng=random.Random(5))
    assert_whole(tmp_path, job, document, expected)


def test_a_service_that_is_asked_to_stop_hands_its_job_to_the_next(tmp_path, expected):
    with ServiceProcess(tmp_path, **SETTINGS) as service:
        job = submit(service.url, QUESTION, "stopped")

        def look(document: dict) -> None:
            if document["progress"]["done"] > 0:
                raise InterruptedError

        with pytest.raises(InterruptedError):
            until_over(service.url, job, 120.0, look)
        assert service.stop() == 0
    with ServiceProcess(tmp_path, **SETTINGS) as service:
        document = until_over(service.url, job, 180.0)
    assert_whole(tmp_path, job, document, expected)


@needs_postgres
def test_a_database_that_goes_away_costs_time_and_holds_up_no_end(tmp_path, expected):
    with running_postgres() as server, empty_database(server) as url:
        settings = SETTINGS | {"database_url": url, "job_lease_s": 3}
        with ServiceProcess(tmp_path, **settings) as service:
            job = submit(service.url, QUESTION, "away")
            time.sleep(5.0)
            server.stop()
            assert httpx.get(f"{service.url}/readyz", timeout=60.0).status_code == 503
            refused = httpx.get(f"{service.url}/v1/screenings/{job}", timeout=60.0)
            assert (refused.status_code, refused.json()["field"]) == (503, "database")
            time.sleep(5.0)
            server.start()
            document = until_over(service.url, job, 180.0)
            assert_whole(tmp_path, job, document, expected)
            submit(service.url, QUESTION, "left-behind")
            time.sleep(3.0)
            server.stop()
            assert service.stop(patience_s=60.0) == 0
            server.start()

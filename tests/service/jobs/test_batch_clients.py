"""A batch through the clients: a real service, the real engine, and a service killed while a client waits."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Iterator
from dataclasses import replace

import pyarrow.parquet as pq
import pytest
from served_process import ServedProcess, free_port

from sdm_core.blade import Blade, blade_to_dict, example_blade
from sdm_core.contact import ContactConfiguration
from service.app import create_app
from service.client import AsyncClient, Client, ServiceProblem, screening_order
from service.jobs.job import State
from service.jobs.screening.request import Criteria
from service.screening.screen import screen
from service.settings import Settings
from training.screening import Screener

ROTOR, GENERIC = example_blade("nasa_rotor_37"), example_blade("generic_compressor_blade")
CONTACTS = {"leading": ContactConfiguration.at("LE"), "both": ContactConfiguration.at("LE", "TE")}
SMALL = {"map_shape": (8, 8), "ke_liner": 9000.0}


def damped(factor: float) -> Blade:
    """Rotor 37 with other damping, which raises its critical K_e in proportion."""
    ratio = [factor * each for each in ROTOR.damping_ratio]
    return replace(ROTOR, name=f"rotor 37, damping x {factor:g}", damping_ratio=ratio)


@pytest.fixture(scope="module")
def service(tmp_path_factory) -> Iterator[ServedProcess]:
    settings = {"engine_workers": "1", "drain_s": "0"}
    running = ServedProcess(tmp_path_factory.mktemp("data"), free_port(), settings).start()
    yield running
    running.kill()


@pytest.fixture(scope="module")
def taking(serving, tmp_path_factory) -> Iterator[str]:
    """A service that takes jobs and runs none, with small bodies."""
    settings = Settings(run_jobs=False, data_folder=tmp_path_factory.mktemp("data"), max_body_bytes=30_000)
    with serving(create_app(settings)) as url:
        yield url


def test_a_batch_answers_what_the_screening_of_this_process_does(service, tmp_path):
    blades = [ROTOR, "generic_compressor_blade"]
    seen = []
    with Client(service.url) as client:
        job = client.submit_screening(
            blades, CONTACTS, **SMALL, criteria=Criteria(least_margin=0.2), name="über\u2028 all"
        )
        done = client.wait(job.id, seen.append)
        found = client.screening_results(job.id)
        report = client.screening_report(job.id)
        pictures = [client.screening_map(job.id, 1, "both"), client.screening_boundaries(job.id, 0)]
        missed = client.screening_results(job.id, meets_criteria=False)
        listed = [each.id for each in client.screenings("done")]
    assert seen[-1] == done and done.progress.done == 2 and done.name == "über\u2028 all"
    expected = screen([ROTOR, GENERIC], CONTACTS, Screener.default(), **SMALL)
    assert found.complete and not found.not_screened and len(found.rows) == 4
    for row, near in zip(found.rows, expected.results, strict=True):
        assert (row.blade, row.contact_name, row.contact) == (
            near.blade.name,
            near.contact_name,
            near.contact,
        )
        assert row.smallest_unstable_ke == pytest.approx(near.worst and near.worst.ke, rel=1e-9)
        assert (row.verdict, row.unstable_share) == (near.verdict, near.unstable_share)
        assert [tip.ke for tip in row.critical_speeds] == pytest.approx(
            [tip.ke for tip in near.critical_speeds], rel=1e-9
        )
    # K_e over 9,000 N/m is 1.65, below 0.91, 0.60 and so on: the README's figures.
    assert {row.blade for row in found.rows if row.meets_criteria} == {GENERIC.name}
    assert [row for row in found.rows if not row.meets_criteria] == list(missed.rows)
    assert report.startswith(b"<!doctype html>") or b"<html" in report[:200].lower()
    assert all(picture.startswith(b"\x89PNG") for picture in pictures)
    assert job.id in listed
    found.to_parquet(tmp_path / "r.parquet")
    assert pq.read_table(tmp_path / "r.parquet").equals(found.table)
    assert found.to_csv(tmp_path / "r.csv").count(b"\n") == 5
    assert found.to_dict()["results"][0]["rank"] == 1


def test_the_same_batch_sent_ahead_or_in_the_body_has_the_same_results(service, monkeypatch):
    with Client(service.url) as client:
        first = client.submit_screening([ROTOR, damped(2.0)], CONTACTS, **SMALL)
        monkeypatch.setattr(screening_order, "INLINE_BYTES", 1000)
        ahead = client.submit_screening([ROTOR, damped(2.0)], CONTACTS, **SMALL)
        tables = [client.screening_results(client.wait(job.id).id).table for job in (first, ahead)]
    same = [table.drop_columns(["source"]).replace_schema_metadata() for table in tables]
    assert same[0].equals(same[1])
    assert set(tables[1]["source"].to_pylist()) == {"blades.ndjson:1", "blades.ndjson:2"}


def test_both_clients_wait_on_while_the_service_is_killed_and_started_again(service):
    blades = [damped(1.0 + i / 24) for i in range(24)]  # three chunks
    begun = threading.Event()

    def seen(job) -> None:
        if job.progress.done:  # some of it is stored, and the rest is not
            begun.set()

    async def both(job_id: str) -> list[State]:
        async with AsyncClient(service.url) as client:
            with Client(service.url) as other:
                awaited = client.wait(job_id, seen, timeout_s=400)
                waited = asyncio.to_thread(other.wait, job_id, timeout_s=400)
                killed = asyncio.to_thread(kill_and_start)
                return [job.state for job in (await asyncio.gather(awaited, waited, killed))[:2]]

    def kill_and_start() -> None:
        assert begun.wait(300)
        service.kill()
        service.start()

    with Client(service.url) as client:
        job = client.submit_screening(blades, speed_range_hz=(100.0, 280.0), **SMALL)
        assert asyncio.run(both(job.id)) == [State.DONE] * 2
        rows = client.screening_results(job.id).rows
    assert {row.blade_index for row in rows} == set(range(24))
    notes = (service.data / "jobs" / job.id / "log.jsonl").read_text().splitlines()
    events = [json.loads(note) for note in notes]
    stored = [note["chunk"] for note in events if note["event"] == "stored"]
    assert sorted(stored) == sorted(set(stored)), "a chunk that was stored was computed again"
    assert sum(note["event"] == "begun" for note in events) == 2


def test_an_order_too_long_for_the_body_goes_ahead_as_an_upload(taking):
    with Client(taking) as client:
        job = client.submit_screening([ROTOR] * 4, **SMALL)
        assert job.state is State.QUEUED and job.progress.total in (0, 4)
        with pytest.raises(ServiceProblem) as refused:
            wrong = blade_to_dict(ROTOR) | {"damping_ratio": -1.0}
            client.submit_screening([ROTOR, ROTOR, wrong, ROTOR], **SMALL)
        assert refused.value.problem["field"] == "blades[2].damping_ratio"
        with pytest.raises(ServiceProblem, match=r"for blades\[3\]: name a tip node") as refused:
            other = blade_to_dict(ROTOR) | {"tip_nodes": [f"M{i}" for i in range(9)]}
            client.submit_screening(
                [ROTOR, ROTOR, ROTOR, other], {"LE": ContactConfiguration.at("LE")}, **SMALL
            )
    assert refused.value.problem["field"] == "contacts[0].weights.LE"
    assert refused.value.problem["remedy"].startswith("for blades[3]: ")


def test_the_same_order_under_the_same_key_is_one_job_though_its_blades_went_ahead(taking):
    with Client(taking) as client:
        asked = {**SMALL, "idempotency_key": "night-22"}
        jobs = [client.submit_screening([ROTOR] * 4, **asked) for _ in range(2)]
        assert jobs[0].id == jobs[1].id
        with pytest.raises(ServiceProblem) as refused:
            client.submit_screening([ROTOR] * 5, **asked)
    assert refused.value.problem["status"] == 409


def test_a_file_sent_twice_is_one_upload(taking, tmp_path):
    path = tmp_path / "blades.ndjson"
    path.write_text("\n".join(json.dumps(blade_to_dict(blade)) for blade in (ROTOR, GENERIC)))
    with Client(taking) as client:
        first, again, other = client.upload(path), client.upload(path), client.upload(path, "other.ndjson")
        written = client.upload(blade for blade in (ROTOR, GENERIC))
        assert first.id == again.id != other.id
        assert written.size_bytes and written.form == first.form
        job = client.submit_screening([first, written.id, "nasa_rotor_37"], **SMALL)
        assert client.cancel(job.id).state is State.CANCELLED
        assert client.retry(job.id).attempt == 2
        client.delete_upload(other.id)
        with pytest.raises(ServiceProblem, match="give the id of an upload"):
            client.submit_screening(other.id)


def test_trainings_are_handed_in_listed_cancelled_and_scheduled(taking):
    from service.client import TrainingQuestion

    with Client(taking) as client:
        job = client.submit_training(TrainingQuestion(name="small", rounds=0), idempotency_key="sunday")
        assert (
            client.submit_training(TrainingQuestion(name="small", rounds=0), idempotency_key="sunday").id
            == job.id
        )
        assert [each.name for each in client.trainings("queued")] == ["small"]
        with pytest.raises(ServiceProblem, match="wait until it is done"):
            client.training_result(job.id)
        assert client.cancel_training(job.id).state is State.CANCELLED
        assert client.retry_training(job.id).attempt == 2
        assert client.training(job.id).kind == "training"
        planned = client.schedule_trainings("0 3 * * SUN", "Europe/Paris", TrainingQuestion(rounds=2))
        assert planned.training is not None and planned.training["rounds"] == 2
        assert client.training_schedule() == planned
        assert client.unschedule_trainings().cron is None

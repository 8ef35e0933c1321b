"""Simulations over REST with the real engine: ordered, followed, fetched, drawn, and refused."""

from __future__ import annotations

import asyncio
import copy
import io
from collections.abc import Iterator
from pathlib import Path

import httpx
import numpy as np
import pytest

from benchmarks.jobs.following import computed_after_stored, until_over
from benchmarks.jobs.service_process import ServiceProcess
from sdm_core.blade import blade_to_dict, example_blade
from service.client import AsyncClient, Client
from service.rest.question_schemas import POINTS_EXAMPLE
from service.simulation.constants import CasingConstants, LinerConstants
from service.simulation.order import SimulationOrder
from service.simulation.outcome import simulated

PATH = "/v1/simulations"
ROTOR = example_blade("nasa_rotor_37")
SPEEDS = np.linspace(94.0, 101.0, 9)
QUESTION = {
    "name": "both edges",
    "blade": blade_to_dict(ROTOR),
    "speed_hz": SPEEDS.tolist(),
    "nodes": ["LE", "TE"],
    "revolutions": 8,
    "liner": {"ke": 12000.0},
    "casing": {"clearance_m": [1e-4, 2e-4]},
    "cells": 2000,
}
ORDER = SimulationOrder(
    ROTOR,
    tuple(SPEEDS.tolist()),
    ("LE", "TE"),
    8,
    LinerConstants(ke=12000.0),
    CasingConstants(clearance_m=(1e-4, 2e-4)),
    cells=2000,
)
LIMITS = {"max_simulation_speeds": 40, "max_simulation_revolutions": 5000, "max_simulation_steps": 1e9}


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="module")
def service(data) -> Iterator[ServiceProcess]:
    limits = {name: int(value) for name, value in LIMITS.items()}
    with ServiceProcess(data, engine_workers=1, min_free_bytes=0, drain_s=0, **limits) as running:
        yield running


@pytest.fixture(scope="module")
def http(service) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=service.url, timeout=60.0) as client:
        yield client


@pytest.fixture(scope="module")
def done(http, service) -> dict:
    """The job of `QUESTION`, at its end."""
    reply = http.post(PATH, json=QUESTION, headers={"Idempotency-Key": "both"})
    assert reply.status_code == 202, reply.text
    job = reply.json()
    assert reply.headers["location"] == job["links"]["self"] == f"{PATH}/{job['id']}"
    return until_over(service.url, job["id"], 240.0, path=PATH)


@pytest.fixture(scope="module")
def one(http, service) -> dict:
    """A simulation at one speed, at its end."""
    job = http.post(PATH, json=QUESTION | {"speed_hz": [96.0]}).json()
    return until_over(service.url, job["id"], 240.0, path=PATH)


def arrays(reply: httpx.Response) -> dict[str, np.ndarray]:
    assert reply.headers["content-type"] == "application/x-npz"
    with np.load(io.BytesIO(reply.content), allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def test_a_simulation_ends_with_the_arrays_of_the_library(http, done):
    assert (done["state"], done["kind"], done["error"]) == ("done", "simulation", None)
    assert (done["progress"]["done"], done["progress"]["total"]) == (9, 9)
    expected = simulated(ORDER)
    found = arrays(http.get(f"{PATH}/{done['id']}/results", headers={"Accept": "application/x-npz"}))
    for name, values in expected.speeds.arrays().items():
        if name in ("growth_per_revolution", "chatter_hz"):  # solved with other speeds beside them
            np.testing.assert_allclose(found[name], values, rtol=1e-9)
        else:
            np.testing.assert_array_equal(found[name], values)
    np.testing.assert_array_equal(found["lobes_hz"], expected.lobes_hz)
    figures = http.get(f"{PATH}/{done['id']}/results").json()
    assert figures["complete"] and figures["energy"] is None
    assert figures["peak_m"] == expected.speeds.peak_m.tolist()
    assert figures["wear_lobes"] == expected.speeds.lobes.tolist()
    assert figures["stable"] == [bool(v) for v in expected.speeds.stable]
    assert figures["unstable_speeds_hz"] == expected.lobes_hz.tolist()


def test_many_speeds_have_maps_and_one_has_a_response(http, done, one):
    of_many, of_one = (
        ("wear_map.png", "wear_map.png?node=TE", "spectrum.png"),
        ("response.png", "worn_profile.png"),
    )
    for job, there, elsewhere in ((done, of_many, of_one), (one, of_one, of_many)):
        for name in there:
            reply = http.get(f"{PATH}/{job['id']}/{name}")
            assert reply.headers["content-type"] == "image/png" and reply.content.startswith(b"\x89PNG")
        for name in elsewhere:
            reply = http.get(f"{PATH}/{job['id']}/{name}")
            assert (reply.status_code, reply.json()["field"]) == (404, "id")
            assert there[0].partition("?")[0] in reply.json()["remedy"]
    assert http.get(f"{PATH}/{done['id']}/wear_map.png?node=N2").json()["field"] == "node"


def test_one_speed_keeps_its_response_and_its_energy_balances(http, one):
    figures = http.get(f"{PATH}/{one['id']}/results").json()
    energy = figures["energy"]
    assert abs(energy["imbalance_j"]) < 1e-9 * energy["work_of_contact_j"]
    found = arrays(http.get(f"{PATH}/{one['id']}/results", headers={"Accept": "application/x-npz"}))
    steps = ORDER.at([96.0]).method.samples_per_revolution * 8
    assert len(found["response_time_s"]) >= steps
    assert found["worn_m"].shape == (1, 2, 2000)


def test_the_same_idempotency_key_is_one_simulation(http, done):
    again = http.post(PATH, json=QUESTION, headers={"Idempotency-Key": "both"})
    assert (again.status_code, again.json()["id"]) == (202, done["id"])
    other = http.post(PATH, json=QUESTION | {"revolutions": 9}, headers={"Idempotency-Key": "both"})
    assert other.status_code == 409


def test_a_cancelled_simulation_goes_on_where_it_was_when_it_is_retried(http, service, data):
    long = QUESTION | {"speed_hz": np.linspace(90, 110, 12).tolist(), "nodes": ["LE"], "revolutions": 400}
    long |= {"casing": {}, "cells": 8000}
    job = http.post(PATH, json=long).json()["id"]

    def look(document: dict) -> None:
        if document["progress"]["done"] > 0:
            http.delete(f"{PATH}/{job}")

    assert until_over(service.url, job, 240.0, look, path=PATH)["state"] == "cancelled"
    partly = http.get(f"{PATH}/{job}/results").json()
    assert not partly["complete"] and 0 < len(partly["speed_hz"]) < 12
    assert http.get(f"{PATH}/{job}/wear_map.png").status_code == 200
    assert http.post(f"{PATH}/{job}/retry").status_code == 202
    document = until_over(service.url, job, 240.0, path=PATH)
    assert (document["state"], document["attempt"]) == ("done", 2)
    assert computed_after_stored(data, job) == []
    whole = http.get(f"{PATH}/{job}/results").json()
    assert whole["complete"] and whole["speed_hz"] == long["speed_hz"]


def test_a_simulation_that_has_nothing_yet_says_so(http):
    missing = "0" * 32
    assert http.get(f"{PATH}/{missing}/results").status_code == 404
    assert http.get(f"/v1/screenings/{missing}").status_code == 404


def changed(**fields) -> dict:
    return copy.deepcopy(QUESTION) | fields


@pytest.mark.parametrize(
    ("question", "status", "field", "value", "remedy"),
    [
        (changed(speed_hz=[500.0]), 422, "speed_hz", "500", "modal data from 0 to 300.8"),
        (changed(speed_hz=[100.0, 99.0]), 422, "speed_hz[1]", "99.0", "rising"),
        (changed(speed_hz=[]), 422, "speed_hz", "[]", "at least one"),
        (changed(nodes=["LE", "XX"]), 422, "nodes[1]", "XX", "name each tip node once"),
        (changed(nodes=[]), 422, "nodes", "[]", "list of names"),
        (changed(liner={"ke": -1}), 422, "liner.ke", "-1", "above 0"),
        (changed(liner={"ke": 1e7}), 422, "liner.ke", "10000000.0", "less than 1.224e+06"),
        (changed(liner={"stiffness": 1}), 422, "liner.stiffness", "1", "leave it out"),
        (
            changed(liner={"youngs_modulus_pa": "soft"}),
            422,
            "liner.youngs_modulus_pa",
            "soft",
            "finite number",
        ),
        (changed(casing={"clearance_m": -1e-4}), 422, "casing.clearance_m", "-0.0001", "more clearance"),
        (
            changed(casing={"clearance_m": [1e-4] * 3}),
            422,
            "casing.clearance_m",
            "3 numbers",
            "one a contact node",
        ),
        (changed(casing={"lobes": 1.5}), 422, "casing.lobes", "1.5", "whole number"),
        (changed(casing=[]), 422, "casing", "[]", "give an object"),
        (
            changed(friction={"coefficient": -0.1, "rotation": 1}),
            422,
            "friction.coefficient",
            "-0.1",
            "from 0",
        ),
        (
            changed(friction={"coefficient": 0.1, "rotation": 1}, blade=POINTS_EXAMPLE["blade"]),
            422,
            "friction",
            "nasa",
            "tangential",
        ),
        (changed(steps_per_cell=1, cells=40), 422, "steps_per_cell", "1", "at least"),
        (changed(speed_hz=np.linspace(50, 60, 41).tolist()), 413, "speed_hz", "41 entries", "at most 40"),
        (changed(revolutions=5001), 413, "revolutions", "5001", "at most 5000"),
        (changed(cells=200_000, revolutions=2000), 413, "speeds x revolutions", "", "at most 1000000000"),
    ],
    ids=lambda part: part if isinstance(part, str) else "",
)
def test_bad_input_names_field_value_and_remedy(http, question, status, field, value, remedy):
    reply = http.post(PATH, json=question)
    problem = reply.json()
    assert reply.status_code == status, problem
    assert problem["field"].startswith(field)
    assert value in problem["value"] and remedy in problem["remedy"]


def test_the_clients_order_wait_and_fetch_arrays(service, done, one):
    with Client(service.url) as client:
        job = client.submit_simulation(
            ROTOR,
            SPEEDS,
            ["LE", "TE"],
            revolutions=8,
            liner=LinerConstants(ke=12000.0),
            casing={"clearance_m": [1e-4, 2e-4]},
            cells=2000,
            name="by the client",
        )
        assert client.wait_simulation(job.id, timeout_s=240.0).progress.done == 9
        found, before = client.simulation_results(job.id), client.simulation_results(done["id"])
        assert found.complete and found.response is None
        for name, values in found.arrays.items():
            np.testing.assert_array_equal(values, before.arrays[name])
        assert client.simulation_chart(job.id, "wear_map", "TE").startswith(b"\x89PNG")
        assert {job.id, done["id"], one["id"]} <= {each.id for each in client.simulations("done")}

    async def awaited() -> None:
        async with AsyncClient(service.url) as client:
            results = await client.simulation_results(one["id"])
            assert results.response is not None and results.speeds.speed_hz.tolist() == [96.0]
            assert one["id"] in [each.id async for each in client.simulations()]

    asyncio.run(awaited())

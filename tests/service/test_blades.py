"""``POST /v1/blades``: profiles built, modal data checked."""

from __future__ import annotations

import copy
from collections.abc import Iterator

import httpx
import pytest

from sdm_core.blade import blade_to_dict, example_blade
from service.app import create_app
from service.rest.profile_schema import BLADES_EXAMPLE
from service.rest.schemas import BladeReply
from service.settings import Settings


@pytest.fixture(scope="module")
def client(serving) -> Iterator[httpx.Client]:
    with serving(create_app(Settings(max_mesh_nodes=1000))) as url:  # noqa: SIM117
        with httpx.Client(base_url=url, timeout=60.0) as client:
            yield client


@pytest.fixture(scope="module")
def built(client) -> dict:
    answer = client.post("/v1/blades", json=BLADES_EXAMPLE)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_a_profile_becomes_a_blade_file_with_its_reduction_error(built):
    reply = BladeReply.model_validate(built)
    assert reply.build is not None and reply.build.reduction is not None
    assert reply.build.reduced_size < reply.build.full_size
    assert max(map(abs, reply.build.reduction.frequency_error)) < 1e-3
    assert reply.findings == []


def test_a_built_blade_is_taken_by_the_other_endpoints(client, built):
    question = {
        "blade": built["blade"],
        "contact": {"weights": {"LE": 1.0}},
        "speed_hz": [150.0, 250.0],
        "ke": [1.0, 1.0],
        "policy": "exact",
    }
    answer = client.post("/v1/stability", json=question)
    assert answer.status_code == 200, answer.text
    assert answer.json()["stable"] == [True, True]


def test_modal_data_come_back_as_they_were_understood(client):
    blade = blade_to_dict(example_blade("nasa_rotor_37"))
    answer = client.post("/v1/blades", json={"blade": blade}).json()
    assert answer["build"] is None
    assert answer["blade"] == blade


def test_unit_scaled_mode_shapes_are_pointed_out(client):
    blade = blade_to_dict(example_blade("nasa_rotor_37"))
    for state in blade["states"]:
        state.pop("mode_shape_radial", None)
        state.pop("mode_shape_tangential", None)
        for row in state["mode_shape"]:
            largest = max(map(abs, row))
            row[:] = [value / largest for value in row]
    findings = client.post("/v1/blades", json={"blade": blade}).json()["findings"]
    assert any("mass-normalised" in finding["remedy"] for finding in findings)


@pytest.mark.parametrize(
    ("part", "change", "status", "field"),
    [
        ("parametric", {"chord_m": [0.05, -1]}, 422, "profile.parametric.chord_m[1]"),
        ("parametric", {"chrod_m": 0.05}, 422, "profile.parametric.chrod_m"),
        ("mesh", {"span": 900}, 413, "profile.mesh"),
        ("mesh", {"span": 1000, "chord": 1000}, 422, "profile.mesh"),
        (None, {"design_speed_hz": "fast"}, 422, "profile.design_speed_hz"),
        (None, {"sections": {"file": "/etc/hostname"}, "parametric": None}, 422, "profile.sections.file"),
        (None, {"name": "x" * 500}, 413, "profile.name"),
    ],
)
def test_an_unusable_profile_is_refused_by_field(client, part, change, status, field):
    body = copy.deepcopy(BLADES_EXAMPLE)
    (body["profile"] if part is None else body["profile"][part]).update(change)
    answer = client.post("/v1/blades", json=body)
    assert (answer.status_code, answer.json()["field"]) == (status, field)


@pytest.mark.parametrize("body", [{}, {"profile": BLADES_EXAMPLE["profile"], "blade": {}}, [], {"blades": 1}])
def test_neither_both_or_something_else_is_refused(client, body):
    assert client.post("/v1/blades", json=body).status_code == 422


def test_a_shape_turned_inside_out_is_refused_with_its_place(client):
    body = copy.deepcopy(BLADES_EXAMPLE)
    del body["profile"]["parametric"]
    z = [0.001 * i for i in range(11)]
    half = [0.01, 0.003, -0.01]  # the sides change places near the tip
    body["profile"]["sections"] = {
        "z_m": [z] * 3,
        "r_m": [[0.2 + 0.03 * i] * 11 for i in range(3)],
        "theta_1_rad": [[-h] * 11 for h in half],
        "theta_2_rad": [[h] * 11 for h in half],
    }
    answer = client.post("/v1/blades", json=body)
    assert answer.status_code == 422
    assert "% of the span" in answer.json()["remedy"]

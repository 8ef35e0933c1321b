"""The answers of the wire contract, version 1: fields, shapes, null for what a source does not compute."""

from __future__ import annotations

import io
import json
import time

import numpy as np
import pytest

from service.rest.schemas import BoundaryReply, MapReply, PointsReply, SensitivitiesReply

REPLIES = {
    "/v1/stability": PointsReply,
    "/v1/boundary": BoundaryReply,
    "/v1/sensitivities": SensitivitiesReply,
    "/v1/map": MapReply,
}


def _strict(text: str) -> dict:
    """Parse JSON, refusing the NaN and Infinity that JSON does not have."""

    def refuse(token: str) -> None:
        raise AssertionError(f"{token} is not JSON")

    return json.loads(text, parse_constant=refuse)


@pytest.mark.parametrize("policy", [None, "auto", "exact", "surrogate"])
@pytest.mark.parametrize("path", REPLIES)
def test_every_answer_is_as_its_openapi_model_says(http, question, path, policy):
    answer = http.post(path, json=question(path, policy=policy))
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "application/json"
    document = _strict(answer.text)
    REPLIES[path].model_validate(document, strict=False)
    assert set(document) == set(REPLIES[path].model_fields)


def test_points_say_which_source_answered_and_why(http, question):
    body = question(speed_hz=[100.0, 100.0, 100.0], ke=[1e3, 1e4, 2e6])
    reply = http.post("/v1/stability", json=body).json()
    assert reply["stable"] == [True, None, False]
    assert reply["source"] == ["surrogate", "surrogate", "exact"]
    assert reply["reason"] == ["confident", "confident", "out_of_domain"]
    assert reply["unstable_probability"] == [pytest.approx(1 / 11), 0.5, None]
    assert reply["spectral_radius"] == [None, None, 200.0]
    assert reply["growth_per_revolution"] == [None, None, pytest.approx(np.log(200.0))]
    assert reply["chatter_hz"] == [None, None, 330.0]
    assert reply["error_estimate"] == [None, None, 1e-6]
    assert reply["unstable_multipliers"] == [None, None, 2]
    assert reply["wear_lobes"] == [None, None, 3.3]
    assert (reply["model"], reply["solver"]) == ("rule-1", "rule")


def test_an_exact_boundary_lists_intervals_and_a_surrogate_one_does_not(http, question):
    exact = http.post("/v1/boundary", json=question("/v1/boundary", policy="exact")).json()
    assert exact["critical_ke"] == [1e4, 1e4, 1e4]
    assert exact["unstable_ke"] == [[[1e4, 1e5]]] * 3
    quick = http.post("/v1/boundary", json=question("/v1/boundary", policy="surrogate")).json()
    assert quick["unstable_ke"] == [None, None, None]


def test_no_crossing_below_the_largest_stiffness_is_null(http, question):
    reply = http.post("/v1/boundary", json=question("/v1/boundary", ke_max=10.0, policy="exact")).json()
    assert reply["critical_ke"] == [None, None, None]
    assert reply["unstable_ke"] == [[], [], []]


def test_sensitivities_have_a_row_for_each_speed_and_a_column_for_each_parameter(http, question):
    reply = http.post("/v1/sensitivities", json=question("/v1/sensitivities")).json()
    assert reply["parameter"] == ["frequency of mode 1", "damping of mode 1"]
    assert reply["relative"] == [[2.0, 0.0]] * 2
    assert [len(row) for row in reply["value"] + reply["derivative"]] == [2] * 4
    low = http.post("/v1/sensitivities", json=question("/v1/sensitivities", ke_max=10.0)).json()
    assert low["critical_ke"] == [None, None]
    assert low["derivative"] == low["relative"] == [[None, None]] * 2
    assert low["value"] == reply["value"]


def test_a_map_has_a_row_for_each_stiffness_and_a_column_for_each_speed(http, question):
    reply = http.post("/v1/map", json=question("/v1/map", ke=[1e3, 1e4, 2e4, 2e6])).json()
    assert reply["stable"] == [[True] * 3, [None] * 3, [False] * 3, [False] * 3]
    assert reply["source"][3] == ["exact"] * 3
    assert reply["unstable_probability"][3] == [None] * 3
    assert reply["speed_hz"] == [180.0, 240.0, 286.5]
    assert reply["exact_share"] == 0.25
    assert reply["unstable_share"] == pytest.approx(2 / 3)


def test_a_map_with_nothing_decided_has_no_unstable_share(http, question):
    assert http.post("/v1/map", json=question("/v1/map", ke=[1e4])).json()["unstable_share"] is None


@pytest.mark.parametrize("path", REPLIES)
def test_an_answer_says_under_which_certificate_it_was_given(http, question, problem, path):
    said = {"alpha": 1e-3, "confidence": 0.95, "distribution": "rules/1", "spreads": 12.0}
    for alpha in (None, 1e-3):
        assert http.post(path, json=question(path, alpha=alpha)).json()["certificate"] == said
    assert http.post(path, json=question(path, policy="exact")).json()["certificate"] is None
    refused = problem(http.post(path, json=question(path, alpha=2e-3)), 422, "alpha")
    assert refused["value"] == "0.002" and "0.001" in refused["remedy"]
    for alpha in (0, -1, 1.5, "1e-3", True, [1e-3]):
        problem(http.post(path, json=question(path, alpha=alpha)), 422, "alpha")


@pytest.mark.parametrize("form", ["application/x-npz", "application/octet-stream"])
def test_a_map_as_npz_holds_the_same_and_needs_no_pickle(http, question, form):
    body = question("/v1/map", ke=[1e3, 1e4, 2e6])
    plain = http.post("/v1/map", json=body).json()
    answer = http.post("/v1/map", json=body, headers={"Accept": form})
    assert answer.headers["content-type"] == form
    assert answer.headers["vary"] == "Accept"
    with np.load(io.BytesIO(answer.content), allow_pickle=False) as npz:
        assert npz["source"].tolist() == plain["source"]
        assert npz["reason"].tolist() == plain["reason"]
        assert npz["speed_hz"].tolist() == plain["speed_hz"]
        assert np.isnan(npz["stable"][1]).all() and (npz["stable"][0] == 1.0).all()
        assert (str(npz["model"]), str(npz["solver"])) == ("rule-1", "rule")


@pytest.mark.parametrize(
    "contact", [{}, {"arcs": [[0.0, 0.25]]}, {"arcs": None, "engagement": {"mean": 0.5, "sine": [0.4]}}]
)
def test_a_map_as_png_is_a_picture(http, question, contact):
    body = question("/v1/map", ke=[0.0, 1e4, 2e4])
    body["contact"].update(contact)
    body["blade"]["name"] = "50 % span $\\frac{\n"
    answer = http.post("/v1/map", json=body, headers={"Accept": "image/png"})
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "image/png"
    assert answer.content.startswith(b"\x89PNG\r\n")


@pytest.mark.parametrize(
    ("fields", "field"),
    [
        ({"speed_hz": [100.0]}, "speed_hz"),
        ({"ke": [2e4, 1e4]}, "ke"),
        ({"speed_hz": [10.0, 10.0]}, "speed_hz"),
    ],
)
def test_only_axes_that_rise_can_be_charted(http, question, problem, fields, field):
    answer = http.post("/v1/map", json=question("/v1/map", **fields), headers={"Accept": "image/png"})
    assert "application/json" in problem(answer, 422, field)["remedy"]
    assert http.post("/v1/map", json=question("/v1/map", **fields)).status_code == 200


@pytest.mark.parametrize(
    ("accept", "form"),
    [
        ("*/*", "application/json"),
        ("", "application/json"),
        ("application/*", "application/json"),
        ("image/*", "image/png"),
        ("text/html, application/x-npz;q=0.5, application/json;q=0.1", "application/x-npz"),
        ("application/json;q=0, application/octet-stream", "application/octet-stream"),
    ],
)
def test_the_form_of_a_map_is_the_one_the_client_likes_best(http, question, accept, form):
    answer = http.post("/v1/map", json=question("/v1/map"), headers={"Accept": accept})
    assert answer.headers["content-type"] == form


@pytest.mark.parametrize(
    "accept", ["text/html", "image/jpeg", "application/json;q=0", "application/json;q=x"]
)
def test_a_form_there_is_not_is_refused(http, question, problem, accept):
    answer = http.post("/v1/map", json=question("/v1/map"), headers={"Accept": accept})
    document = problem(answer, 406, "Accept")
    assert document["value"] == accept and "image/png" in document["remedy"]


def test_a_map_of_forty_thousand_points_is_read_and_written_within_a_quarter_second(own_http, question):
    speeds, ke = np.linspace(100, 300, 200), np.linspace(0, 2e6, 200)
    body = question("/v1/map", speed_hz=speeds.tolist(), ke=ke.tolist())

    def took() -> float:
        began = time.perf_counter()
        assert np.shape(own_http.post("/v1/map", json=body).json()["source"]) == (200, 200)
        return time.perf_counter() - began

    assert min(took() for _ in range(4)) < 0.25

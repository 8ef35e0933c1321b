"""Models over REST: listed without being loaded, promoted through the gate, rolled back, told of."""

from __future__ import annotations

import json
from pathlib import Path

import httpx
import pytest
from nearby_models import nearby, with_lines
from typer.testing import CliRunner

from service import cli
from service.app import create_app
from service.client import Client, ServiceProblem
from service.rest.model_schemas import ModelChange, ModelHistory
from service.settings import Settings
from training import promotion_check, registry
from training.activation import active_id, history
from training.promotion import promote
from training.promotion_check import Remeasured

JSON = {"Content-Type": "application/json"}


@pytest.fixture
def folder(tmp_path) -> Path:
    nearby(tmp_path)
    return tmp_path


@pytest.fixture(autouse=True)
def fresh_points(monkeypatch) -> list[str]:
    """What fresh points say against a candidate: nothing, unless a test says so."""
    said: list[str] = []
    monkeypatch.setattr(
        promotion_check, "remeasured", lambda candidate, active: Remeasured(tuple(said), {"points": 0})
    )
    return said


@pytest.fixture
def http(serving, folder):
    settings = Settings(models_folder=folder, models_poll_s=0.02)
    with serving(create_app(settings)) as url, httpx.Client(base_url=url, timeout=60.0) as client:
        yield client


def test_a_promoted_model_answers_and_is_on_record(http, folder):
    first, second = active_id(folder), nearby(folder, 1.001).id
    reply = http.post(f"/v1/models/{second}/promote").json()
    assert reply == {"model": second, "was": first, "overridden": [], "answering": True}
    assert http.get("/readyz").json()["model"] == second == active_id(folder)
    told = ModelHistory.model_validate(http.get("/v1/models/history").json())
    assert [(change.event, change.model) for change in told.changes] == [
        ("first", first),
        ("promoted", second),
    ]
    assert told.changes[1].measured == {"points": 0}


def test_a_promotion_asked_twice_changes_once(http, folder):
    second = nearby(folder, 1.001).id
    assert http.post(f"/v1/models/{second}/promote").json()["was"] != second
    again = ModelChange.model_validate(http.post(f"/v1/models/{second}/promote").json())
    assert (again.model, again.was) == (second, second) and len(history(folder)) == 2


def test_a_worse_model_is_refused_with_every_reason_and_passes_by_force(http, folder, fresh_points, problem):
    first = active_id(folder)
    worse = nearby(folder, 1.001, certificates=with_lines(verified_share=lambda share: share * 3)).id
    fresh_points += ["it calls 9 of 2,000 fresh points stable that are not"]
    refused = problem(http.post(f"/v1/models/{worse}/promote", json={"force": False}), 409, "model")
    assert refused["type"].endswith(":promotion-refused") and refused["value"] == worse
    assert len(refused["reasons"]) > 1 and refused["reasons"][-1] == fresh_points[0]
    assert all(reason in refused["remedy"] for reason in refused["reasons"])
    assert active_id(folder) == first
    forced = http.post(f"/v1/models/{worse}/promote", json={"force": True}).json()
    assert forced["overridden"] == refused["reasons"] and active_id(folder) == worse
    assert history(folder)[-1].forced


def test_a_rollback_returns_to_the_model_before_and_then_no_further(http, folder, problem):
    first, second = active_id(folder), nearby(folder, 1.001).id
    promote(second, folder, check=lambda candidate, active: Remeasured((), {}))
    reply = http.post("/v1/models/rollback").json()
    assert reply == {"model": first, "was": second, "overridden": [], "answering": True}
    refused = problem(http.post("/v1/models/rollback"), 409, "models folder")
    assert refused["type"].endswith(":model-not-changed")


def test_another_replica_of_the_folder_takes_it_up(serving, folder, http):
    second = nearby(folder, 1.001).id
    replica = create_app(Settings(models_folder=folder, models_poll_s=0.02))
    with serving(replica) as url, httpx.Client(base_url=url, timeout=60.0) as other:
        assert other.get("/readyz").json()["model"] != second
        http.post(f"/v1/models/{second}/promote")
        for _ in range(500):
            if other.get("/readyz").json()["model"] == second:
                return
    raise AssertionError("the other replica never took it up")


def test_a_model_of_no_such_name_is_not_there(http, problem):
    for name in ("0123456789abcdef", "..", "a b", "%2e%2e", "history.jsonl", "active"):
        for answer in (http.get(f"/v1/models/{name}"), http.post(f"/v1/models/{name}/promote")):
            assert answer.status_code in (404, 405), answer.text
    problem(http.get("/v1/models/0123456789abcdef"), 404, "model")


def test_a_damaged_model_is_shown_and_not_promoted_even_by_force(http, folder, problem):
    second = nearby(folder, 1.001).id
    weights = folder / second / "model.safetensors"
    assert http.get(f"/v1/models/{second}").json()["damage"] is None
    weights.write_bytes(weights.read_bytes()[:-8])
    shown = http.get(f"/v1/models/{second}").json()
    assert "checksum" in shown["damage"] and shown["card"] == {}
    problem(http.post(f"/v1/models/{second}/promote", json={"force": True}), 409, "model")


def test_one_model_is_as_in_the_list_and_has_its_whole_card(http, folder):
    nearby(folder, 1.001)
    for entry in http.get("/v1/models").json()["models"]:
        assert http.get(f"/v1/models/{entry['id']}").json() == entry
        assert entry["card"] == json.loads((folder / entry["id"] / "card.json").read_text())


def test_models_are_listed_without_a_network_being_built_or_weights_read_again(http, folder, monkeypatch):
    nearby(folder, 1.001)
    assert len(http.get("/v1/models").json()["models"]) == 2
    monkeypatch.setattr(registry, "BoundaryNetwork", None)
    monkeypatch.setattr(registry, "_whole_files", None)
    assert [entry["damage"] for entry in http.get("/v1/models").json()["models"]] == [None, None]


@pytest.mark.parametrize(
    ("body", "field"), [("[]", "body"), ('{"force": "yes"}', "force"), ('{"forced": true}', "forced")]
)
def test_a_promotion_that_says_something_else_is_refused(http, folder, problem, body, field):
    answer = http.post(f"/v1/models/{active_id(folder)}/promote", content=body, headers=JSON)
    problem(answer, 422, field)


def test_the_models_that_came_with_the_package_are_not_changed(own_http, problem):
    shipped = active_id(registry.SHIPPED)
    for path in (f"/v1/models/{shipped}/promote", "/v1/models/rollback"):
        assert "--models" in problem(own_http.post(path), 409, "models folder")["remedy"]


def test_the_client_promotes_and_rolls_back(http, folder, fresh_points):
    first, second = active_id(folder), nearby(folder, 1.001).id
    with Client(str(http.base_url)) as client:
        assert client.model(second).card["made"] == "boundaries times 1.001"
        fresh_points.append("worse")
        with pytest.raises(ServiceProblem) as refused:
            client.promote(second)
        assert refused.value.problem["reasons"] == ["worse"]
        assert client.promote(second, force=True).overridden == ["worse"]
        assert client.rollback().model == first
        assert [change.event for change in client.model_history().changes] == [
            "first",
            "promoted",
            "rolled back",
        ]


def rubscreen(*arguments: str):
    return CliRunner().invoke(cli.app, list(arguments), env={"COLUMNS": "200", "TERM": "dumb"})


def test_the_command_line_does_over_http_what_it_does_in_a_folder(http, folder, fresh_points):
    first, second = active_id(folder), nearby(folder, 1.001).id
    there = ("--url", str(http.base_url))
    fresh_points.append("it is worse by far")
    refused = rubscreen("models", "promote", second, *there)
    assert refused.exit_code == 1 and "it is worse by far" in refused.stderr and "--force" in refused.stderr
    forced = rubscreen("models", "promote", second, "--force", *there)
    assert f"{second} is active in {http.base_url}, after {first}" in forced.stdout.replace("\n", "")
    assert rubscreen("models", "rollback", *there).exit_code == 0 and active_id(folder) == first
    listed = json.loads(rubscreen("models", "list", "--json", "-", *there).stdout)["models"]
    assert [entry["id"] for entry in listed if entry["active"]] == [first] and len(listed) == 2
    told = json.loads(rubscreen("models", "history", "--json", "-", *there).stdout)
    near = json.loads(rubscreen("models", "history", "--json", "-", "--models", str(folder)).stdout)
    assert told == near and [change["forced"] for change in told["history"]] == [False, True, False]
    both = rubscreen("models", "list", "--models", str(folder), *there)
    assert both.exit_code == 2 and "leave it out with --url" in both.stderr

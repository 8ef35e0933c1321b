"""A running service takes up the model that becomes active, and no request notices more than its name."""

from __future__ import annotations

import json
import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from nearby_models import nearby

from sdm_core.blade import blade_from_dict
from sdm_core.contact import ContactConfiguration
from service.app import create_app
from service.rest import replies
from service.rest.active_model import WatchedModel
from service.rest.question_schemas import BOUNDARY_EXAMPLE
from service.settings import Settings
from training.activation import active_id
from training.promotion import promote, rollback
from training.promotion_check import Remeasured
from training.screening import Screener

SPEEDS = np.linspace(150.0, 300.0, 12)
KE_MAX = 1e6
# The surrogate's own boundary: every number in it depends on the weights.
QUESTION = BOUNDARY_EXAMPLE | {"speed_hz": SPEEDS.tolist(), "ke_max": KE_MAX, "policy": "surrogate"}
BLADE = blade_from_dict(BOUNDARY_EXAMPLE["blade"])
CONTACT = ContactConfiguration.from_dict(BOUNDARY_EXAMPLE["contact"])


def unmeasured(candidate, active):
    """In place of fresh points: nothing to say."""
    return Remeasured((), {})


def wait_until(true: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + 30.0
    while not true():
        assert time.monotonic() < deadline, what
        time.sleep(0.01)


@pytest.fixture
def folder(tmp_path) -> Path:
    nearby(tmp_path)
    return tmp_path


@pytest.fixture
def http(serving, folder):
    """A client of a service that looks at the pointer of `folder` all the time."""
    settings = Settings(models_folder=folder, models_poll_s=0.01, max_waiting=1000)
    with serving(create_app(settings)) as url, httpx.Client(base_url=url, timeout=60.0) as client:
        yield client


def model_of(http: httpx.Client) -> str:
    return http.get("/readyz").json()["model"]


def exact_reply(folder: Path, model_id: str) -> dict[str, Any]:
    """What the model answers, computed here."""
    found = Screener.default(folder, model_id).boundary(BLADE, CONTACT, SPEEDS, KE_MAX, "surrogate")
    return json.loads(replies.to_json(replies.boundary_to_dict(found)))


def test_no_request_is_lost_or_answered_by_half_a_model_while_models_change(http, folder):
    first, second = active_id(folder), nearby(folder, 1.001).id
    expected = {model: exact_reply(folder, model) for model in (first, second)}
    assert not set(expected[first]["critical_ke"]) & set(expected[second]["critical_ke"])
    stop, answers = threading.Event(), []

    def ask(client: httpx.Client) -> httpx.Response:
        return client.post("/v1/boundary", json=QUESTION)

    def fifty_a_second(pool: ThreadPoolExecutor) -> None:
        while not stop.wait(0.02):
            answers.append(pool.submit(ask, http))

    with ThreadPoolExecutor(8) as pool:
        asking = threading.Thread(target=fifty_a_second, args=(pool,))
        asking.start()
        try:
            for _ in range(5):
                promote(second, folder, check=unmeasured)
                wait_until(lambda: model_of(http) == second, "the promoted model never answered")
                assert rollback(folder).model == first
                wait_until(lambda: model_of(http) == first, "the model rolled back to never answered")
        finally:
            stop.set()
            asking.join()
    got = [answer.result() for answer in answers]
    assert {response.status_code for response in got} == {200}
    named = [response.json()["model"] for response in got]
    assert set(named) == {first, second}
    for response, model in zip(got, named, strict=True):
        assert response.json() == expected[model]


def test_who_asked_before_the_change_is_answered_by_the_model_of_then(folder):
    first, second = active_id(folder), nearby(folder, 1.001).id
    model = WatchedModel(folder, poll_s=0.0)
    began = model.now
    promote(second, folder, check=unmeasured)
    model.follow()
    assert (began.model_id, model.now.model_id) == (first, second)
    old = began.screener.boundary(BLADE, CONTACT, SPEEDS, KE_MAX, "surrogate")
    assert json.loads(replies.to_json(replies.boundary_to_dict(old))) == exact_reply(folder, first)


def point_at(folder: Path, model: str) -> None:
    """Move the pointer without asking anybody."""
    (folder / ".pointer").write_text(model + "\n")
    (folder / ".pointer").replace(folder / "active")


def cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-100])


BROKEN = {
    "weights cut short": lambda folder, model: cut(folder / model / "model.safetensors"),
    "a card cut short": lambda folder, model: cut(folder / model / "card.json"),
    "a card that is not its own": lambda folder, model: (folder / model / "card.json").write_bytes(
        (folder / active_id(folder) / "card.json").read_bytes()
    ),
    "gone": lambda folder, model: (folder / model).rename(folder / ".gone"),
}


@pytest.mark.parametrize("how", BROKEN)
def test_the_old_model_answers_when_the_new_one_is_damaged(http, folder, how, caplog):
    first, second, third = active_id(folder), nearby(folder, 1.001).id, nearby(folder, 1.002).id
    BROKEN[how](folder, second)
    with caplog.at_level(logging.ERROR, "rubscreen.service"):
        point_at(folder, second)
        wait_until(lambda: http.get("/readyz").json()["fault"] is not None, "the fault was never shown")
        time.sleep(0.1)  # many looks at the pointer
    assert len(caplog.records) == 1 and f"{first} goes on answering" in caplog.text
    ready, models = http.get("/readyz").json(), http.get("/v1/models").json()
    assert ready["model"] == first and second in ready["fault"] and models["fault"] == ready["fault"]
    assert [entry["id"] for entry in models["models"] if entry["active"]] == [first]
    assert http.post("/v1/boundary", json=QUESTION).json() == exact_reply(folder, first)
    point_at(folder, third)
    wait_until(lambda: model_of(http) == third, "the next model never answered")
    assert http.get("/readyz").json()["fault"] is None


def test_a_model_that_fails_the_self_check_never_answers(http, folder):
    first, blind = active_id(folder), nearby(folder, 1e4).id  # it calls a blade deep in its lobe stable
    promote(blind, folder, force=True, check=unmeasured)
    wait_until(lambda: http.get("/readyz").json()["fault"] is not None, "the fault was never shown")
    ready = http.get("/readyz").json()
    assert ready["model"] == first and "self_check" in ready["fault"]
    rollback(folder)
    wait_until(lambda: http.get("/readyz").json()["fault"] is None, "the fault never went")
    assert model_of(http) == first


def test_a_pointer_that_is_taken_away_changes_nothing_but_the_fault(http, folder):
    first = active_id(folder)
    (folder / "active").unlink()
    wait_until(lambda: http.get("/readyz").json()["fault"] is not None, "the fault was never shown")
    assert model_of(http) == first


def test_a_service_that_began_without_a_model_takes_up_the_first_one(serving, tmp_path):
    settings = Settings(models_folder=tmp_path, models_poll_s=0.01)
    with serving(create_app(settings)) as url, httpx.Client(base_url=url, timeout=60.0) as http:
        assert http.get("/readyz").status_code == 503
        made = nearby(tmp_path)
        wait_until(lambda: http.get("/readyz").status_code == 200, "the first model never answered")
        assert model_of(http) == made.id


def test_a_damaged_model_answers_once_it_is_mended_and_pointed_at_again(folder):
    model, second = WatchedModel(folder, poll_s=0.0), nearby(folder, 1.001)
    whole = (folder / second.id / "model.safetensors").read_bytes()
    cut(folder / second.id / "model.safetensors")
    point_at(folder, second.id)
    model.follow()
    assert model.now.model_id != second.id and model.fault is not None
    (folder / second.id / "model.safetensors").write_bytes(whole)
    point_at(folder, second.id)
    model.follow()
    assert model.now.model_id == second.id and model.fault is None and model.loading is None


def test_a_service_told_not_to_look_keeps_its_model(serving, folder):
    first, second = active_id(folder), nearby(folder, 1.001).id
    settings = Settings(models_folder=folder, models_poll_s=0)
    with serving(create_app(settings)) as url, httpx.Client(base_url=url, timeout=60.0) as http:
        promote(second, folder, check=unmeasured)
        time.sleep(0.2)
        assert model_of(http) == first
        assert not any(thread.name == "active model" for thread in threading.enumerate())

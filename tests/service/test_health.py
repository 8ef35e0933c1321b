"""Alive and ready are two things, and a damaged model takes away only the second."""

from __future__ import annotations

from collections.abc import Iterator

import httpx
import numpy as np
import pytest

from sdm_core.errors import DamagedFile
from sdm_core.version import __version__
from service.app import create_app
from service.rest import active_model


def test_a_service_with_a_model_is_alive_and_ready(http):
    assert http.get("/healthz").json() == {"status": "alive", "version": __version__}
    said = {"status": "ready", "model": "rule-1", "solver": "rule", "loading": None, "fault": None}
    ready = http.get("/readyz").json()
    assert list(ready.pop("checks")) == ["self_check"]
    assert ready == said


def test_a_service_that_answers_wrongly_is_not_ready(own_http, screener, problem):
    screener.critical = 1.0
    document = problem(own_http.get("/readyz"), 503, "self_check")
    assert document["value"].startswith("[0.0, 0.0]")
    assert own_http.get("/healthz").status_code == 200


def test_a_service_that_cannot_decide_is_not_ready(own_http, screener, problem):
    screener._verdict = lambda ke: np.full(ke.shape, np.nan)
    problem(own_http.get("/readyz"), 503, "self_check")


@pytest.fixture
def damaged(monkeypatch, screener, serving) -> Iterator[httpx.Client]:
    """A service whose model file is truncated."""

    class Damaged:
        def __new__(cls, model: None, on_exact=None, on_confident=None):
            screener.model_id = None
            return screener

        @staticmethod
        def default(models_folder, on_exact=None, on_confident=None):
            raise DamagedFile("model.safetensors", "512 of 90112 bytes", "install the service again")

    monkeypatch.setattr(active_model, "Screener", Damaged)
    with serving(create_app()) as url, httpx.Client(base_url=url, timeout=20.0) as client:
        yield client


def test_a_damaged_model_leaves_the_service_alive_but_not_ready(damaged, problem):
    assert damaged.get("/healthz").status_code == 200
    document = problem(damaged.get("/readyz"), 503, "model.safetensors")
    assert document["value"] == "512 of 90112 bytes"
    assert "install the service again" in document["remedy"]


def test_a_damaged_model_leaves_the_exact_core(damaged, question, problem):
    answer = damaged.post("/v1/stability", json=question(policy="exact"))
    assert answer.json()["source"] == ["exact", "exact"]
    assert answer.json()["model"] is None
    for policy in ("auto", "surrogate"):
        refused = damaged.post("/v1/stability", json=question(policy=policy))
        assert 'policy "exact"' in problem(refused, 503, "model.safetensors")["remedy"]
        assert refused.headers["retry-after"]


def test_no_model_of_the_list_is_the_one_that_answers_when_it_is_damaged(damaged):
    assert not any(model["active"] for model in damaged.get("/v1/models").json()["models"])

"""A service told to keep its exact answers keeps them, across requests, models and its own end."""

from __future__ import annotations

import time

import httpx
import pytest
from nearby_models import nearby

from service.app import create_app
from service.rest.question_schemas import POINTS_EXAMPLE
from service.settings import Settings
from training.activation import active_id
from training.promotion import promote
from training.promotion_check import Remeasured
from training.served_answers import ServedAnswers

EXACT = POINTS_EXAMPLE | {"policy": "exact"}


@pytest.mark.parametrize("keep", [True, False])
def test_exact_answers_of_a_service_are_kept_where_it_is_told_to(serving, tmp_path, keep):
    nearby(tmp_path / "models")
    other = nearby(tmp_path / "models", 1.001).id
    folder = tmp_path / "served" if keep else None
    settings = Settings(models_folder=tmp_path / "models", served_answers_folder=folder, models_poll_s=0.01)
    with serving(create_app(settings)) as url, httpx.Client(base_url=url, timeout=60.0) as http:
        assert http.post("/v1/stability", json=EXACT).status_code == 200
        promote(other, tmp_path / "models", check=lambda *models: Remeasured((), {}))
        deadline = time.monotonic() + 30.0
        while http.get("/readyz").json()["model"] != active_id(tmp_path / "models"):
            assert time.monotonic() < deadline, "the promoted model never answered"
        moved = EXACT | {"speed_hz": [1.01 * speed for speed in EXACT["speed_hz"]]}
        assert http.post("/v1/stability", json=moved).status_code == 200
    if not keep:
        assert not (tmp_path / "served").exists()
        return
    speeds = set(ServedAnswers.read(tmp_path / "served").speed_hz)
    assert set(EXACT["speed_hz"]) | set(moved["speed_hz"]) <= speeds

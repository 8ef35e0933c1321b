"""`rubscreen verify`: what it picks, what it says, and that it says so when two answers differ."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from sdm_core.errors import TooMuchWork
from service import cli
from service.verification import comparison

COMMAND = ["verify", "nasa_rotor_37", "--speed", "200Hz:300Hz", "--points", "8"]


def run(*options: str):
    return CliRunner().invoke(cli.app, [*COMMAND, *options])


def test_exact_core_surrogate_and_integration_agree_on_rotor_37(tmp_path):
    done = run("--json", str(tmp_path / "v.json"), "--png", str(tmp_path / "v.png"))
    assert done.exit_code == 0, done.output
    assert "agree on 8 of 8 points" in done.output
    points = json.loads((tmp_path / "v.json").read_text())["points"]
    assert {"lobe tip", "near boundary"} <= {point["kind"] for point in points}
    for point in points:
        assert point["agrees"] and not point["served_wrongly"]
        assert abs(point["radius_witness"] / point["radius_exact"] - 1) < 1e-9
        assert point["exact"] == (point["radius_exact"] < 1)
    # Each pair lies on both sides of the boundary.
    sides = [point["exact"] for point in points if point["kind"] in ("lobe tip", "near boundary")]
    assert sides[::2] == [True] * len(sides[::2]) and sides[1::2] == [False] * len(sides[1::2])
    assert (tmp_path / "v.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "wrong",
    [
        lambda said: replace(said, stable=not said.stable),
        lambda said: replace(said, spectral_radius=said.spectral_radius * (1 + 1e-4)),
        lambda said: replace(said, chatter_hz=said.chatter_hz * 1.01, nearly_equal=()),
    ],
    ids=["verdict", "radius", "frequency"],
)
def test_a_witness_that_differs_is_shown_and_ends_with_status_1(monkeypatch, wrong):
    truly = comparison.time_witness
    monkeypatch.setattr(comparison, "time_witness", lambda problem: wrong(truly(problem)))
    done = run()
    assert done.exit_code == 1
    assert "agree on 0 of 8 points" in done.output


def test_a_served_answer_that_is_wrong_ends_with_status_1(monkeypatch):
    from training.screening import Screener

    truly = Screener.points

    def flattering(self, blade, contact, speed_hz, ke, policy="auto", alpha=None):
        found = truly(self, blade, contact, speed_hz, ke, policy, alpha)
        return found if policy == "exact" else replace(found, stable=np.ones(len(speed_hz)))

    monkeypatch.setattr(Screener, "points", flattering)
    done = run()
    assert done.exit_code == 1
    assert "agree on 8 of 8 points" in done.output and "as the exact core does" in done.output


def test_a_point_that_cannot_be_integrated_is_said_and_counts_as_not_agreed(monkeypatch):
    def refusing(problem):
        raise TooMuchWork("rtol", "500000 steps a revolution", "raise the speed")

    monkeypatch.setattr(comparison, "time_witness", refusing)
    done = run()
    assert done.exit_code == 1
    assert "raise the speed" in done.output

"""Whoever audits the surrogate is told of what it promised, and of nothing else."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from sdm_core.blade import example_blade
from sdm_core.contact import ContactConfiguration
from training.answers import CONFIDENT, SURROGATE
from training.confident_answers import ConfidentAnswers
from training.registry import load_model
from training.screening import Screener

ROTOR, LE = example_blade("nasa_rotor_37"), ContactConfiguration.at("LE")
SPEEDS = np.linspace(100.0, 300.0, 40)
KE = np.geomspace(2e3, 4e4, 40)


@pytest.fixture(scope="module")
def model():
    return load_model()


@pytest.fixture
def told() -> list[ConfidentAnswers]:
    return []


def test_of_points_the_verdicts_given_without_verification_are_told(model, told):
    found = Screener(model, on_confident=told.append).points(ROTOR, LE, SPEEDS, KE, alpha=1e-3)
    sure = found.source == SURROGATE
    (answers,) = told
    assert 0 < sure.sum() < len(SPEEDS) and (found.reason[sure] == CONFIDENT).all()
    assert (answers.model, answers.alpha) == (model.id, 1e-3)
    np.testing.assert_array_equal(answers.speed_hz, SPEEDS[sure])
    np.testing.assert_array_equal(answers.ke, KE[sure])
    np.testing.assert_array_equal(answers.stable, found.stable[sure] == 1.0)


def test_of_a_map_each_verdict_is_told_with_the_speed_and_stiffness_it_was_given_at(model, told):
    found = Screener(model, on_confident=told.append).map(ROTOR, LE, SPEEDS, KE)
    (answers,) = told
    assert len(answers) == (found.source == SURROGATE).sum()
    row, column = np.searchsorted(KE, answers.ke), np.searchsorted(SPEEDS, answers.speed_hz)
    np.testing.assert_array_equal(answers.stable, found.stable[row, column] == 1.0)


def test_a_boundary_beyond_the_range_is_a_promise_of_stability_at_its_end(model, told):
    found = Screener(model, on_confident=told.append).boundary(ROTOR, LE, SPEEDS, 12e3)
    none = np.isnan(found.critical_ke) & (found.source == SURROGATE)
    (answers,) = told
    assert 0 < none.sum() < len(SPEEDS)
    np.testing.assert_array_equal(answers.speed_hz, SPEEDS[none])
    assert answers.stable.all() and (answers.ke == 12e3).all()


@pytest.mark.parametrize("policy", ["surrogate", "exact"])
def test_what_was_asked_for_without_a_certificate_promises_nothing(model, told, policy):
    screener = Screener(model, on_confident=told.append)
    screener.points(ROTOR, LE, SPEEDS, KE, policy)
    screener.map(ROTOR, LE, SPEEDS[:4], KE[:4], policy)
    screener.boundary(ROTOR, LE, SPEEDS[:4], 12e3, policy)
    assert told == []


def test_an_observer_that_fails_costs_no_answer(model, caplog):
    def fail(answers: ConfidentAnswers) -> None:
        raise OSError("the disk is full")

    with caplog.at_level(logging.ERROR, "rubscreen.training"):
        found = Screener(model, on_confident=fail).points(ROTOR, LE, SPEEDS, KE)
    assert np.isfinite(found.stable).all() and "the disk is full" in caplog.text


def test_a_sample_is_drawn_from_all_answers_alike_and_not_from_the_row_where_all_are_stable():
    ke = np.repeat([0.0, 1.0, 2.0, 3.0, 4.0], 20)
    answers = ConfidentAnswers(ROTOR, LE, np.arange(100.0), ke, ke < 3, "m", 1e-3)
    rng = np.random.default_rng(0)
    drawn = [answers.drawn(8, rng) for _ in range(500)]
    assert all(len(sample) == 8 and len(set(sample.speed_hz)) == 8 for sample in drawn)
    places = np.concatenate([sample.speed_hz for sample in drawn]).astype(int)
    counts = np.bincount(places, minlength=100)
    assert (counts[:20] == 0).all()
    # 50 expected of each: chi-squared of 79 degrees of freedom below its 99.9 % point.
    assert ((counts[20:] - 50.0) ** 2 / 50.0).sum() < 124
    assert len(answers.drawn(1000, rng)) == 80

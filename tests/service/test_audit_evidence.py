"""Evidence that a certified rate is broken: seldom false however often it is looked at, and soon there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from benchmarks.audit import answers_until_alarm
from service.audit.tally import FALSE_ALARM
from training.audit_evidence import log_evidence
from training.certificate import LADDER

DELTA = FALSE_ALARM


@pytest.mark.parametrize("alpha", LADDER)
def test_a_rate_that_is_just_kept_raises_a_false_alarm_in_fewer_than_one_path_of_a_hundred(alpha):
    alarms = np.sum(answers_until_alarm(alpha, alpha, 4_000, 100_000, seed=3) < np.inf)
    assert alarms / 4_000 < DELTA
    # That many, or more, would still be seen once in a thousand times if the promise were just kept.
    assert alarms <= binom.isf(1e-3, 4_000, DELTA)


@pytest.mark.parametrize(
    ("times", "alpha", "soon"),
    [(5, 1e-3, 8_000), (5, 5e-4, 16_000), (100, 1e-4, 600), (100, 5e-4, 120), (500, 1e-4, 100)],
)
def test_a_broken_rate_is_found_about_as_soon_as_a_test_of_that_one_rate_would(times, alpha, soon):
    found = answers_until_alarm(times * alpha, alpha, 1_000, 60_000, seed=4)
    assert np.quantile(found, 0.95) <= soon


def test_a_rate_below_the_bound_raises_none():
    assert (answers_until_alarm(0.2 * 5e-4, 5e-4, 2_000, 100_000, seed=5) == np.inf).mean() > 0.999


@pytest.mark.parametrize("alpha", LADDER)
def test_what_one_more_answer_adds_is_a_wash_where_the_rate_is_just_kept(alpha):
    for errors, answers in ((0, 0), (0, 500), (2, 300), (7, 7), (3, 10_000)):
        now, right, wrong = (
            log_evidence(k, n, alpha)
            for k, n in ((errors, answers), (errors, answers + 1), (errors + 1, answers + 1))
        )
        assert (1 - alpha) * np.exp(right - now) + alpha * np.exp(wrong - now) == pytest.approx(1, rel=1e-12)


def test_errors_speak_against_the_rate_and_right_answers_for_it():
    for errors in range(5):
        row = [log_evidence(errors, n, 5e-4) for n in range(errors, 5_000, 50)]
        assert (np.diff(row) < 0).all()
    assert (np.diff([log_evidence(k, 100, 5e-4) for k in range(100)]) > 0).all()


def test_all_wrong_and_very_many_are_still_numbers():
    assert np.isfinite(log_evidence(10**6, 10**6, 1e-4))
    assert log_evidence(0, 10**9, 1e-4) < -1000

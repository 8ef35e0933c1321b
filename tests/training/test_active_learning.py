"""Asking: where the surrogate is unsure, never twice the same, until the certified figure is reached."""

from dataclasses import replace

import numpy as np
import pytest

from training import monitoring
from training.active_learning import ActiveLearner, chosen
from training.contact_class import ARCS, PERMANENT
from training.design_space import DesignSpace
from training.monitoring import Goal, Monitor
from training.surrogate import PredictedBoundary

SPACE = DesignSpace()


class Known:
    """A surrogate whose boundary lies at a κ of 0.1, unsure where f2/f1 is above 3."""

    def __init__(self, moved=0.0):
        self.moved = moved

    def boundary(self, cases):
        unsure = cases.omega[:, 1] / cases.omega[:, 0] > 3
        log_ke = np.log10(0.1 * cases.stiffness_scale) + self.moved * unsure
        return PredictedBoundary(log_ke, np.where(unsure, 0.3, 0.003))


def unsure_share(cases):
    return float((cases.omega[:, 1] / cases.omega[:, 0] > 3).mean())


def test_the_first_cases_fill_the_space_in_both_classes_of_contact():
    first = ActiveLearner(SPACE, seed=1).ask(400)
    assert 390 <= len(first) <= 400
    assert first.permanent.mean() == pytest.approx(0.5, abs=0.02)
    assert SPACE.contains(first).mean() > 0.9


def test_later_ones_are_where_the_surrogate_is_unsure_or_has_just_moved():
    for committee in ([Known()], [Known(), Known(moved=0.2)]):
        learner = ActiveLearner(SPACE, seed=1)
        first = learner.ask(300)
        for surrogate in committee:
            learner.learnt(surrogate)
        asked = learner.ask(300)
        assert len(asked) == 300
        assert unsure_share(asked) > 0.9 > 0.6 > unsure_share(first)


def test_no_case_is_asked_for_twice():
    learner = ActiveLearner(SPACE, seed=1)
    asked = [learner.ask(200)]
    learner.learnt(Known())
    asked += [learner.ask(200), learner.ask(200)]
    speeds = np.concatenate([cases.speed_hz for cases in asked])
    assert len(np.unique(speeds)) == len(speeds)


def test_cases_are_chosen_without_replacement_in_proportion_to_their_risk():
    rng = np.random.default_rng(3)
    draws = [chosen(np.array([1.0, 3.0, 0.0]), 1, rng)[0] for _ in range(4000)]
    counts = np.bincount(draws, minlength=3)
    assert counts[2] == 0
    assert counts[1] / 4000 == pytest.approx(0.75, abs=4 * np.sqrt(0.75 * 0.25 / 4000))
    everything = chosen(rng.random(50), 50, rng)
    np.testing.assert_array_equal(everything, np.arange(50))


def test_what_lies_far_beyond_the_largest_stiffness_is_not_asked_for():
    class Far(Known):
        def boundary(self, cases):
            found = super().boundary(cases)
            return replace(found, log_ke=np.log10(SPACE.largest_ke(cases)) + 8.0)

    learner = ActiveLearner(SPACE, seed=1)
    learner.learnt(Known())
    cases = learner.ask(50)
    near = learner.risk(cases)
    learner.learnt(Far())
    learner.learnt(Far())
    assert (learner.risk(cases) < 1e-2 * near).all()


def test_asking_stops_at_the_certified_figure_of_every_class_of_contact(monkeypatch):
    def judged(cases, ke, *, workers, progress=None):
        return (ke <= 0.1 * cases.stiffness_scale).astype(float)

    monkeypatch.setattr(monitoring, "point_verdicts", judged)
    monitor = Monitor.drawn((PERMANENT, ARCS), 2000, seed=1, workers=1)
    sure = monitor.verified_shares(Known(), SPACE, Goal(alpha=5e-2))
    wrong = monitor.verified_shares(Known(moved=1.0), SPACE, Goal(alpha=1e-3))
    assert 0.0 < sure[PERMANENT] < 1.0 and 0.0 < sure[ARCS] < 1.0
    assert wrong == {PERMANENT: np.inf, ARCS: np.inf}
    least = Goal(5e-2, dict(sure))
    assert least.reached(sure)
    assert not Goal(5e-2, {**sure, ARCS: 0.99 * sure[ARCS]}).reached(sure)
    assert not least.reached(wrong)

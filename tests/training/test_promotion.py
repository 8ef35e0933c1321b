"""A model becomes active by being at least as good, and whoever overrules that is on record."""

import json
from dataclasses import replace

import numpy as np
import pytest
from nearby_models import nearby, with_lines

from sdm_core.errors import InvalidInput
from training import calibration, pipeline
from training.activation import FIRST, FOUND, PROMOTED, ROLLED_BACK, active_id, history
from training.contact_class import ARCS, PERMANENT
from training.fit import FitSettings
from training.held_out import Counted, held_out
from training.pipeline import TrainingSettings, train
from training.promotion import PromotionRefused, promote, rollback
from training.promotion_check import POINTS, Remeasured, reference_points, remeasured
from training.promotion_gate import more_frequent
from training.reference_space import NAME
from training.registry import load_model
from training.surrogate import Architecture


def unmeasured(candidate, active):
    """In place of fresh points: nothing to say."""
    return Remeasured((), {})


@pytest.fixture
def folder(tmp_path):
    """A folder whose active model is the shipped one's twin."""
    nearby(tmp_path)
    return tmp_path


@pytest.fixture
def shipped(tmp_path):
    """A folder whose active model is the shipped one's twin, with its own figures of permanent contact."""
    nearby(tmp_path, figures=None)
    return tmp_path


@pytest.fixture(scope="module")
def fresh():
    """Fresh points, labelled once for all."""
    sample = reference_points(POINTS, 77, PERMANENT)
    return {PERMANENT: lambda points, seed: sample}


def reasons(folder, candidate):
    """Why it is refused, by its card alone; None when it is not."""
    try:
        promote(candidate.id, folder, check=unmeasured)
    except PromotionRefused as refused:
        assert active_id(folder) != candidate.id
        return " | ".join(refused.reasons)
    assert active_id(folder) == candidate.id
    return None


def with_figures(**groups):
    """A card whose groups (`alone`, ...) or figures have these entries."""

    def changed(card):
        for name, value in groups.items():
            evaluation = card["evaluation"]
            evaluation[name] = evaluation[name] | value if isinstance(value, dict) else value
        return card

    return changed


def test_a_model_as_good_as_the_active_one_takes_its_place(folder):
    before = active_id(folder)
    candidate = nearby(folder, 1.0001)
    assert reasons(folder, candidate) is None
    first, change = history(folder)
    assert (first.event, first.model, first.was) == (FIRST, before, None)
    assert (change.event, change.model, change.was, change.forced) == (
        PROMOTED,
        candidate.id,
        before,
        False,
    )


WORSE = {
    "false-stable rate of 0.0001 is certified now": {
        "certificates": lambda found: tuple(replace(c, table=c.table[:-1]) for c in found)
    },
    "certified now, the candidate is not": {
        "certificates": lambda found: tuple(replace(c, contact=ARCS) for c in found)
    },
    "but on elsewhere": {
        "certificates": lambda found: tuple(replace(c, distribution="elsewhere") for c in found)
    },
    "certified for nothing": {"certificates": lambda found: ()},
    "certified on 199,999 points, now 200,000": {
        "certificates": lambda found: tuple(replace(c, points=c.points - 1) for c in found)
    },
    "certified with 90% confidence": {
        "certificates": lambda found: tuple(replace(c, confidence=0.9) for c in found)
    },
    "the exact core would answer 1.85%": {
        "certificates": with_lines(verified_share=lambda share: 1.5 * share)
    },
    "14 of 10,140 false stable, now 2": {"card": with_figures(alone={"false_stable": 14})},
    "auto: 8 of 10,026 false stable, now 0": {"card": with_figures(auto={"false_stable": 8})},
    "near the boundary: 24 of 491 false unstable, now 4": {
        "card": with_figures(alone_hard={"false_unstable": 24})
    },
    "median boundary error 0.05%": {"card": with_figures(median_boundary_error=5e-4)},
    "boundary error of 99% of the points 4.00%": {"card": with_figures(p99_boundary_error=0.04)},
    "99% of the points inf%": {"card": with_figures(p99_boundary_error=float("inf"))},
    "median boundary error not stated": {"card": with_figures(median_boundary_error=None)},
    "held-out figures on elsewhere": {"card": with_figures(distribution="elsewhere")},
    "held-out figures from 500 points, now 20,000": {"card": with_figures(alone={"points": 500})},
    "its card has no held-out figures": {"card": lambda card: card | {"evaluation": {}}},
    "does not say false stable, auto": {"card": lambda card: _without(card, "auto")},
}


def _without(card, group):
    del card["evaluation"][group]
    return card


@pytest.mark.parametrize("said", WORSE)
def test_a_model_that_is_worse_is_refused_and_told_why(folder, said):
    assert said in (reasons(folder, nearby(folder, 1.0001, **WORSE[said])) or "promoted")


NOT_WORSE = {
    "a fifth more verified": {"certificates": with_lines(verified_share=lambda share: 1.2 * share)},
    "as many more mistakes as chance makes": {"card": with_figures(alone={"false_stable": 13})},
    "a little more boundary error": {"card": with_figures(median_boundary_error=1.2e-4)},
    "more points": {"certificates": lambda found: tuple(replace(c, points=10**6) for c in found)},
}


@pytest.mark.parametrize("how", NOT_WORSE)
def test_a_difference_that_chance_or_nobody_would_notice_is_let_pass(folder, how):
    assert reasons(folder, nearby(folder, 1.0001, **NOT_WORSE[how])) is None


def test_each_class_of_contact_is_compared_with_its_own(folder):
    def both(card):
        figures = card["evaluation"]
        return card | {"evaluation": {PERMANENT: figures, ARCS: {**figures, "median_boundary_error": 0.01}}}

    def and_arcs(found):
        return (*found, *(replace(c, contact=ARCS, seed=5) for c in found))

    wider = nearby(folder, 1.0001, card=both, certificates=and_arcs)
    assert reasons(folder, wider) is None  # permanent contact as before, and arcs besides
    narrower = nearby(folder, 1.0002)
    assert "arcs of contact, reference/1: certified now, the candidate is not" in reasons(folder, narrower)
    worse = nearby(
        folder,
        1.0003,
        card=lambda card: _arcs_worse(both(card)),
        certificates=and_arcs,
    )
    found = reasons(folder, worse)
    assert "arcs of contact, surrogate alone: 50 of 10,140" in found and "permanent" not in found


def _arcs_worse(card):
    card["evaluation"][ARCS] = card["evaluation"][ARCS] | {
        "alone": card["evaluation"][ARCS]["alone"] | {"false_stable": 50}
    }
    return card


def test_a_card_speaks_of_permanent_contact_unless_it_names_the_class():
    figures = {"auto": {}, "distribution": NAME, "median_boundary_error": 0.1}
    assert held_out({"evaluation": figures}) == held_out({"evaluation": {PERMANENT: figures}})
    apart = {"distribution": NAME, PERMANENT: {k: v for k, v in figures.items() if k != "distribution"}}
    assert held_out({"evaluation": apart}) == held_out({"evaluation": figures})
    assert held_out({}) == held_out({"evaluation": None}) == {}


def test_an_equal_model_is_seldom_called_worse():
    # Both counts of 10,000 drawn at one rate: at most 1 in 100 may be refused, and the margin makes it fewer.
    rng = np.random.default_rng(1)
    for rate in (1e-4, 1e-3, 1e-2):
        drawn = rng.binomial(10_000, rate, (3000, 2))
        p = [more_frequent(Counted(int(a), 10_000), Counted(int(b), 10_000)) for a, b in drawn]
        assert np.mean(np.array(p) < 0.01) <= 0.015
    assert more_frequent(Counted(0, 100), Counted(0, 100)) == 1.0
    assert more_frequent(Counted(300, 10_000), Counted(100, 10_000), 1.25) < 1e-10


@pytest.mark.parametrize("factor", [0.85, 1.15, 2.0])
def test_a_model_trained_on_wrong_labels_is_refused_whatever_its_card_says(shipped, fresh, factor):
    # What a network fitted to labels off by a factor learns is this; its card is the good model's.
    liar = nearby(shipped, factor, figures=None)
    with pytest.raises(PromotionRefused) as refused:
        promote(liar.id, shipped, check=lambda *models: remeasured(*models, samplers=fresh))
    said = " ".join(refused.value.reasons)
    assert "its card says that 50% of the boundary errors exceed 0.0" in said
    if factor > 1:
        assert "of contact" in said or "certified for" in said
        assert "fresh points false stable, the active model" in said
    assert len(history(shipped)) == 1


def test_training_on_wrong_labels_ends_without_a_promotion(tmp_path, monkeypatch):
    surrogate = load_model().surrogate

    def labels_times(factor):
        def labels(cases, space=None, *, workers, progress=None):
            return factor * 10.0 ** surrogate.boundary(cases).log_ke / cases.stiffness_scale

        def verdicts(cases, ke, *, workers, progress=None):
            return (ke <= labels(cases, workers=1) * cases.stiffness_scale).astype(float)

        def truth(cases, ke, *, workers, progress=None):
            critical = labels(cases, workers=1) * cases.stiffness_scale
            return critical, ke > critical

        monkeypatch.setattr(pipeline, "critical_kappa", labels)
        monkeypatch.setattr(calibration, "point_verdicts", verdicts)
        monkeypatch.setattr(calibration, "truth", truth)

    network = FitSettings(Architecture(width=48, blocks=2), epochs=30, batch=128, learning_rate=4e-3)
    settings = TrainingSettings(
        4000, rounds=0, calibration_points=20_000, evaluation_points=2_000, seed=3, threads=1, fit=network
    )
    labels_times(1.0)
    good = train(tmp_path / "models", settings, data_folder=tmp_path / "good")
    labels_times(1.5)  # wrong in the training set, the calibration and the evaluation alike
    wrong = train(tmp_path / "models", settings, data_folder=tmp_path / "wrong")
    assert good.refused == () and active_id(tmp_path / "models") == good.model.id != wrong.model.id
    assert wrong.model.certificate(PERMANENT).alphas  # by its own card it is as good
    assert any("fresh points" in reason for reason in wrong.refused)


def test_a_true_card_is_borne_out_by_fresh_points(shipped, fresh):
    candidate = nearby(shipped, 1.00001, figures=None)
    promote(candidate.id, shipped, check=lambda *models: remeasured(*models, samplers=fresh))
    measured = history(shipped)[-1].measured[PERMANENT]
    assert measured["points"] == POINTS and measured["median_boundary_error"] < 5e-4
    assert measured["false_stable"][0] <= 3 and "active" in measured


def test_the_fresh_points_of_a_promotion_are_its_own_and_exact(folder):
    seen = []

    def sampler(points, seed):
        seen.append((points, seed))
        return reference_points(32, seed, PERMANENT)

    first, second = nearby(folder, 1.001), nearby(folder, 1.002)
    for model in (first, second, first):
        found = remeasured(model, None, samplers={PERMANENT: sampler})
        assert found.figures[PERMANENT]["points"] == 32
    (_, a), (_, b), (points, again) = seen
    assert a == again != b and points == POINTS and min(a, b) > 2**40


def test_a_class_of_contact_that_cannot_be_measured_anew_is_not_promoted(folder, fresh):
    arcs = nearby(folder, 1.001, certificates=lambda found: (*found, replace(found[0], contact=ARCS)))
    found = remeasured(arcs, None, samplers=fresh)
    assert "arcs of contact: there is no way to measure it anew" in found.reasons


def test_force_promotes_a_worse_model_and_the_history_says_so(folder):
    worse = nearby(folder, 1.0001, certificates=lambda found: ())
    made = promote(worse.id, folder, force=True, check=unmeasured)
    assert active_id(folder) == worse.id
    assert "it is certified for nothing" in made.overridden
    last = json.loads((folder / "history.jsonl").read_text().splitlines()[-1])
    assert last["forced"] is True and last["reasons"] == list(made.overridden)


def test_promoting_the_active_model_changes_nothing(folder):
    made = promote(active_id(folder), folder, check=unmeasured)
    assert made.model == made.was and len(history(folder)) == 1


def test_rollbacks_go_back_one_model_at_a_time(folder):
    a = active_id(folder)
    b, c = nearby(folder, 1.001).id, nearby(folder, 1.002).id
    for model in (b, c):
        promote(model, folder, check=unmeasured)
    assert [rollback(folder).model, active_id(folder), rollback(folder).model] == [b, b, a]
    with pytest.raises(InvalidInput, match="none was active before"):
        rollback(folder)
    promote(c, folder, check=unmeasured)
    assert rollback(folder).model == a
    events = [(e.event, e.model) for e in history(folder)]
    assert events == [
        (FIRST, a),
        (PROMOTED, b),
        (PROMOTED, c),
        (ROLLED_BACK, b),
        (ROLLED_BACK, a),
        (PROMOTED, c),
        (ROLLED_BACK, a),
    ]
    assert [e.at for e in history(folder)] == sorted(e.at for e in history(folder))


def test_a_pointer_moved_by_hand_is_found_and_can_be_rolled_back(folder):
    a, b, c = active_id(folder), nearby(folder, 1.001).id, nearby(folder, 1.002).id
    (folder / "active").write_text(b + "\n")
    assert [(e.event, e.model) for e in history(folder)] == [(FIRST, a), (FOUND, b)]
    promote(c, folder, check=unmeasured)
    assert [e.event for e in history(folder)] == [FIRST, FOUND, PROMOTED]
    assert [rollback(folder).model, rollback(folder).model] == [b, a]

"""The comparison with generic surrogates is fair: same labels, same points, same share verified."""

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
import pytest

from benchmarks.baselines import estimators
from benchmarks.baselines.comparison import measured
from benchmarks.baselines.figures import SHARES, judged, least_certain
from benchmarks.baselines.inputs import lobes, phases, raw
from benchmarks.baselines.methods import Classification, Regression
from benchmarks.baselines.ours import LobesAlone, OurNetwork, Ours
from benchmarks.baselines.samples import VERIFIED_SHARE, Labels, Trial
from sdm_core.stability import stability
from training.contact_class import ARCS, PERMANENT
from training.reference_space import reference_sample

CONTACTS = (PERMANENT, ARCS)


@pytest.fixture(scope="module", params=CONTACTS)
def small(request) -> tuple[Labels, Trial]:
    return Labels.drawn(request.param, 120, 1), Trial.drawn(request.param, 150, 1)


@lru_cache
def synthetic() -> Trial:
    """20,000 points, 500 cases over and over, whose truth is K_e against a made-up boundary."""
    sample, rng = reference_sample(500, 1), np.random.default_rng(1)
    cases = sample.cases[np.tile(np.arange(500), 40)]
    critical = 0.01 * cases.stiffness_scale * np.exp(rng.normal(size=len(cases)))
    ke = critical * 10.0 ** rng.uniform(-2.0, 2.0, len(cases))
    return Trial(PERMANENT, cases, ke, critical, ke > critical, VERIFIED_SHARE[PERMANENT])


@dataclass
class Witness:
    """A method that keeps what it was given, and knows the answers."""

    trial: Trial
    name: str = "witness"
    inputs: str = "all"
    given: list = field(default_factory=list)

    def fit(self, labels):
        self.given.append((labels.cases, labels.log_kappa))
        return self

    def score(self, cases, log_kappa):
        self.given.append((cases, log_kappa))
        return log_kappa - self.boundary(cases)

    def boundary(self, cases):
        self.given.append((cases, cases.speed_hz))
        return np.log10(self.trial.critical_ke / cases.stiffness_scale)


@pytest.mark.parametrize(
    "score",
    [
        np.random.default_rng(0).normal(size=20_000),
        np.zeros(20_000),
        np.full(20_000, np.nan),
        np.where(np.arange(20_000) % 3, np.inf, -np.inf),
        np.round(np.random.default_rng(0).normal(size=20_000)),
    ],
    ids=["spread out", "all alike", "not numbers", "infinite", "many alike"],
)
@pytest.mark.parametrize("share", VERIFIED_SHARE.values())
def test_exactly_the_same_number_of_points_is_verified_whatever_the_scores_are(score, share):
    assert least_certain(score, share).sum() == round(share * 20_000)
    trial = replace(synthetic(), share=share)
    figures = judged(score, np.zeros(20_000), trial)
    answered = figures.helped.answered_stable + figures.helped.answered_unstable
    assert (figures.verified, answered) == (round(share * 20_000), 20_000 - round(share * 20_000))


def test_points_are_verified_in_the_order_of_their_certainty():
    score = np.array([3.0, -0.1, 0.5, -2.0, 0.2])
    assert least_certain(score, 0.4).tolist() == [False, True, False, False, True]


def test_a_perfect_oracle_makes_no_error_and_needs_no_verification():
    trial = synthetic()
    score = np.log10(trial.ke / trial.critical_ke)
    figures = judged(score, np.log10(trial.critical_ke / trial.cases.stiffness_scale), trial)
    for found in (figures.alone, figures.alone_near, figures.helped, figures.helped_near):
        assert found.false_stable == found.false_unstable == found.rate == 0
    assert figures.alone.answered_stable == (~trial.unstable).sum() > 0
    assert figures.alone_near.answered_stable + figures.alone_near.answered_unstable == trial.near.sum() > 0
    assert figures.to_verify == 0.0
    assert figures.median_boundary_error == pytest.approx(0.0, abs=1e-12)


def test_an_oracle_that_says_the_opposite_is_always_wrong_and_proves_nothing():
    trial = synthetic()
    figures = judged(-np.log10(trial.ke / trial.critical_ke), np.zeros(len(trial)), trial)
    assert figures.alone.rate == figures.helped.rate == 1.0
    assert figures.alone.false_stable == trial.unstable.sum()
    assert figures.alone.false_unstable == (~trial.unstable).sum()
    assert figures.to_verify == np.inf


def test_errors_that_are_the_least_certain_points_are_found_by_verifying_them_and_one_more_is_left():
    trial = synthetic()
    score = np.log10(trial.ke / trial.critical_ke)
    count = round(trial.share * len(trial))
    order = np.argsort(np.abs(score))
    for wrong, left in ((count, 0), (count + 1, 1)):
        mistaken = score.copy()
        mistaken[order[:wrong]] *= -1
        helped = judged(mistaken, np.zeros(len(trial)), trial).helped
        assert helped.false_stable + helped.false_unstable == left


def test_fifty_unstable_points_called_stable_must_be_verified_to_prove_one_in_a_thousand():
    trial = synthetic()
    score = np.log10(trial.ke / trial.critical_ke)
    unstable = np.flatnonzero(trial.unstable)
    sure, unsure = score.copy(), score.copy()
    wrong = unstable[np.argsort(score[unstable])][:: len(unstable) // 50][:50]
    sure[wrong], unsure[wrong] = -100.0, -1e-9
    assert judged(sure, np.zeros(len(trial)), trial).to_verify == np.inf
    assert judged(unsure, np.zeros(len(trial)), trial).to_verify == 0.0025 == SHARES[-2]


def test_every_method_sees_the_same_labels_and_points_and_can_change_none(small):
    labels, trial = small
    first, second = Witness(trial), Witness(trial)
    for method in (first, second):
        measured(method, labels, trial)
    for (cases, values), (again, same) in zip(first.given, second.given, strict=True):
        assert cases is again
        assert np.array_equal(values, same)
    for array in (labels.log_kappa, labels.cases.omega, trial.cases.arcs, trial.ke, trial.unstable):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0


def test_fewer_labels_are_part_of_more_labels(small):
    labels, _ = small
    fewer = labels.first(50)
    assert len(fewer) == 50
    assert np.array_equal(fewer.log_kappa, labels.log_kappa[:50])
    assert np.array_equal(fewer.cases.contact_matrix, labels.cases.contact_matrix[:50])


def test_labels_and_points_are_of_one_class_of_contact_and_have_no_case_in_common(small):
    labels, trial = small
    assert np.all(labels.cases.permanent == (trial.contact == PERMANENT))
    assert np.all(trial.cases.permanent == (trial.contact == PERMANENT))
    assert not np.isin(trial.cases.speed_hz / trial.cases.omega[:, 0], labels.cases.speed_hz).any()


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("encoding", [raw, phases, lobes], ids=["raw", "phases", "lobes"])
def test_inputs_do_not_depend_on_units_mode_signs_or_where_round_the_casing_counting_starts(
    encoding, contact
):
    cases = reference_sample(200, 3, contact).cases
    rng = np.random.default_rng(0)
    sign = rng.choice([-1.0, 1.0], cases.omega.shape)
    arcs = cases.arcs
    if contact == ARCS:  # from the second arc on, where there is one: the first comes a turn later
        second = cases.arc_count > 1
        arcs = arcs.copy()
        for i in np.flatnonzero(second):
            n = cases.arc_count[i]
            arcs[i, :n] = np.r_[arcs[i, 1:n], arcs[i, :1] + 1.0] - 0.37
    other = replace(
        cases,
        omega=60.0 * cases.omega,
        speed_hz=60.0 * cases.speed_hz,
        contact_matrix=1e3 * cases.contact_matrix * sign[:, :, None] * sign[:, None, :],
        arcs=arcs,
    )
    before, after = encoding(cases), encoding(other)
    assert after.columns == pytest.approx(before.columns, rel=1e-4, abs=1e-4)
    assert after.start == pytest.approx(before.start, rel=1e-8, abs=1e-8)


def test_only_the_inputs_with_lobes_know_where_a_lobe_is():
    cases = reference_sample(50, 4).cases
    told = [encoding(cases) for encoding in (raw, phases, lobes)]
    assert [bool(given.start.any()) for given in told] == [False, False, True]
    lobe = told[2].start
    for given in told[:2]:
        assert not any(np.allclose(column, lobe, atol=1e-3) for column in given.columns.T)
    assert any(np.allclose(column, lobe, atol=1e-3) for column in told[2].columns.T)


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning")
@pytest.mark.parametrize(
    "method",
    [
        Regression("forest", "raw", raw, estimators.forest, estimators.disagreement_of_trees),
        Regression("boosted trees", "raw", raw, estimators.boosted),
        Classification("boosted trees, verdicts", "raw", raw, estimators.boosted_classifier),
        Classification("forest, verdicts", "lobes", lobes, estimators.forest_classifier),
        Regression("MLP", "lobes", lobes, estimators.mlp),
        Regression(
            "process",
            "raw",
            raw,
            lambda rows: estimators.GaussianProcess(60),
            estimators.GaussianProcess.spread,
        ),
        OurNetwork("raw", raw),
        Ours(),
        LobesAlone(),
    ],
    ids=lambda method: method.name,
)
def test_every_method_does_better_than_always_giving_the_same_verdict(method, small):
    labels, trial = small
    found = measured(method, labels, trial)
    assert found.labels == len(labels)
    assert found.figures.verified == round(trial.share * len(trial))
    assert found.figures.alone.rate < min(trial.unstable.mean(), 1 - trial.unstable.mean())
    assert np.isfinite(found.figures.median_boundary_error)


def test_what_the_lobes_alone_know_is_the_boundary_of_a_blade_with_one_mode():
    sample = reference_sample(400, 5)
    one = np.flatnonzero(sample.cases.mode_count == 1)
    cases = sample.cases[one]
    boundary = LobesAlone().fit(None).boundary(cases)  # type: ignore[arg-type]
    critical = 10.0**boundary * cases.stiffness_scale
    for i in range(0, len(one), 10):
        problem = cases.problem(i)
        assert stability(problem.with_ke(0.999 * critical[i])).stable
        assert not stability(problem.with_ke(1.001 * critical[i])).stable

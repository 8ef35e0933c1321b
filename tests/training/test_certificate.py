"""The certificate: what is proven of the false-stable rate is true, whoever computes it."""

from dataclasses import replace
from fractions import Fraction
from math import comb

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdm_core.errors import InvalidInput
from training import learn_then_test
from training.certificate import BANDS, LADDER, Certificate, certify
from training.contact_class import ARCS, PERMANENT
from training.learn_then_test import binomial_p_value, fixed_sequence, simultaneous_sequences
from training.registry import load_model
from training.seeds import seed_for
from training.surrogate import PredictedBoundary
from training.verification_band import FIVE_PERCENT as LEAST_HALF_WIDTH

SPREAD, REACH = 0.01, 2.0


def synthetic(count, seed, noise):
    """A surrogate whose error, in spreads, is logistic with scale `noise`, at K_e within two decades."""
    rng = np.random.default_rng(seed)
    boundary = PredictedBoundary(3.0 + SPREAD * noise * rng.logistic(size=count), np.full(count, SPREAD))
    ke = 10 ** (3.0 + rng.uniform(-REACH, REACH, count))
    return boundary, ke, ke > 1e3


def true_rate(spreads, noise):
    """P(unstable | accepted as stable) of `synthetic`, in closed form.

    With e the error and w the half width, points at u in (−2, 2) decades are accepted below e − w and
    unstable above 0: E[(e − w)⁺]/(2 − w) = σ ln(1 + exp(−w/σ))/(2 − w), σ the scale of e.
    """
    width, scale = max(spreads * SPREAD, LEAST_HALF_WIDTH), SPREAD * noise
    return scale * np.log1p(np.exp(-width / scale)) / (REACH - width)


# The first lies just below the rate of the band of 16 spreads, where a wrong test is caught soonest.
ONE_OR_MORE_RATES = [(0.99 * true_rate(16.0, 6.0),), (5e-3,), (2e-2, 1e-2, 5e-3, 2e-3, 1e-3)]


def certified(count, seed, noise, alphas=LADDER, confidence=0.95) -> Certificate:
    boundary, ke, unstable = synthetic(count, seed, noise)
    inside = np.ones(count, dtype=bool)
    return certify(
        boundary,
        inside,
        ke,
        unstable,
        distribution="synthetic",
        contact=PERMANENT,
        seed=seed,
        alphas=alphas,
        confidence=confidence,
    )


def broken_promises(noise, alphas, count, calibrations=200):
    """In how many repeated calibrations at least one line of the table is false."""
    broken = 0
    for seed in range(calibrations):
        table = certified(count, seed, noise, alphas).table
        broken += any(true_rate(line.spreads, noise) > line.alpha for line in table)
    return broken


def plain_rate(errors, accepted, rate):
    """What the test would be without statistics: passed when the observed rate is within the bound."""
    return 0.0 if errors <= rate * accepted else 1.0


def test_the_synthetic_rate_in_closed_form_is_the_rate_that_is_observed():
    boundary, ke, unstable = synthetic(2_000_000, 1, 6.0)
    for spreads in (13.0, 25.0):
        accepted = boundary.score(ke) < -spreads
        observed = (accepted & unstable).sum() / accepted.sum()
        expected = true_rate(spreads, 6.0)
        assert observed == pytest.approx(expected, abs=4 * np.sqrt(expected / accepted.sum()))


@pytest.mark.parametrize("alphas", ONE_OR_MORE_RATES)
def test_at_most_eighteen_of_two_hundred_calibrations_break_a_promise(alphas):
    # 5 % of 200 is 10; more than 18 would happen to a valid procedure once in 150 times.
    assert broken_promises(6.0, alphas, 8_000) <= 18


@pytest.mark.parametrize("alphas", ONE_OR_MORE_RATES)
def test_the_plain_observed_rate_would_break_more(alphas, monkeypatch):
    monkeypatch.setattr(learn_then_test, "binomial_p_value", plain_rate)
    assert broken_promises(6.0, alphas, 8_000) > 18


@given(st.integers(0, 12), st.integers(0, 40), st.sampled_from([Fraction(1, 100), Fraction(1, 5)]))
def test_p_value_is_the_binomial_sum(errors, further, rate):
    accepted = errors + further
    exact = sum(comb(accepted, i) * rate**i * (1 - rate) ** (accepted - i) for i in range(errors + 1))
    assert binomial_p_value(errors, accepted, float(rate)) == pytest.approx(float(exact), rel=1e-9)


def test_nothing_is_proven_by_accepting_nothing():
    assert fixed_sequence([0, 0], [0, 0], 0.5, 0.05) == 0


def test_without_errors_a_ten_thousandth_takes_twenty_nine_thousand_nine_hundred_and_fifty_six_points():
    assert fixed_sequence([0], [29_956], 1e-4, 0.05) == 1
    assert fixed_sequence([0], [29_955], 1e-4, 0.05) == 0


rules = st.lists(st.tuples(st.integers(0, 40_000), st.integers(0, 3)), min_size=1, max_size=10)


@given(rules)
def test_a_stricter_rate_never_verifies_less(steps):
    accepted, errors = np.cumsum(steps, axis=0).T.tolist()
    accepted = [a + e for a, e in zip(accepted, errors, strict=True)]
    counts = simultaneous_sequences(errors, accepted, LADDER, 0.95)
    assert list(counts) == sorted(counts, reverse=True)


@given(rules)
def test_shares_of_the_error_never_add_up_to_more_than_it(steps):
    # Handing on a share can only help a rate that alone, at the whole 5 %, would hold as well.
    accepted, errors = np.cumsum(steps, axis=0).T.tolist()
    accepted = [a + e for a, e in zip(accepted, errors, strict=True)]
    together = simultaneous_sequences(errors, accepted, LADDER, 0.95)
    for rate, count in zip(LADDER, together, strict=True):
        least = fixed_sequence(errors, accepted, rate, 0.05 / len(LADDER))
        most = fixed_sequence(errors, accepted, rate, 0.05)
        assert least <= count <= most


def test_a_sequence_tested_to_its_end_hands_its_share_on():
    # 0 of 40,000: p = 0.018 for 1e-4, above a fifth of 5 % and below the whole of it.
    assert simultaneous_sequences([0], [40_000], LADDER, 0.95) == (1,) * 5
    # With a second band that no rate keeps, none is tested to its end: p is above its own 1 %, ...
    assert simultaneous_sequences([0, 900], [40_000, 80_000], LADDER, 0.95) == (1, 1, 1, 1, 0)
    # ... but below the 2.5 % it has of its own where there are two rates.
    assert simultaneous_sequences([0, 900], [40_000, 80_000], (1e-2, 1e-4), 0.95) == (1, 1)


def test_a_better_surrogate_is_verified_less():
    good, poor = certified(60_000, 1, 0.5), certified(60_000, 1, 6.0)
    for alpha in poor.alphas:
        assert good.line(alpha).spreads <= poor.line(alpha).spreads
    assert good.line(1e-3).spreads < poor.line(1e-3).spreads
    assert good.line(1e-3).verified_share < poor.line(1e-3).verified_share


def test_rates_that_cannot_be_proven_are_listed_as_not_reached():
    few = certified(3_000, 1, 0.1)
    assert few.alphas == (1e-2, 5e-3) and few.not_reached == (1e-3, 5e-4, 1e-4)
    assert certified(60_000, 1, 60.0).alphas == ()


def test_points_outside_the_design_space_are_verified_and_prove_nothing():
    boundary, ke, unstable = synthetic(20_000, 3, 0.5)
    names = {"distribution": "synthetic", "contact": PERMANENT, "seed": 3}
    half = np.arange(20_000) < 10_000
    found = certify(boundary, half, ke, unstable, **names).line(1e-2)
    alone = certify(
        PredictedBoundary(boundary.log_ke[:10_000], boundary.spread[:10_000]),
        half[:10_000],
        ke[:10_000],
        unstable[:10_000],
        **names,
    ).line(1e-2)
    assert (found.accepted, found.errors) == (alone.accepted, alone.errors)
    assert found.verified_share == pytest.approx(0.5 + 0.5 * alone.verified_share)


def test_a_line_counts_what_it_says():
    boundary = PredictedBoundary(np.full(1200, 3.0), np.full(1200, 1e-4))
    ke = np.concatenate([np.full(1000, 500.0), np.full(100, 1001.0), np.full(100, 2000.0)])
    unstable = np.concatenate([np.zeros(1000, bool), np.ones(100, bool), np.arange(100) >= 7])
    found = certify(
        boundary, np.ones(1200, bool), ke, unstable, distribution="three", contact=PERMANENT, seed=0
    ).line(1e-2)
    assert (found.accepted, found.errors) == (1000, 0)
    assert found.verified_share == pytest.approx(100 / 1200)
    assert found.false_unstable_rate == pytest.approx(0.07)


def test_an_unknown_rate_is_refused_and_those_there_are_named():
    certificate = certified(60_000, 1, 0.5)
    with pytest.raises(InvalidInput, match=r"alpha = 0\.002: .*0\.01, 0\.005, 0\.001, 0\.0005.*synthetic"):
        certificate.line(2e-3)
    with pytest.raises(InvalidInput, match="none"):
        replace(certificate, table=()).line()


def test_a_certificate_survives_its_card():
    certificate = certified(60_000, 1, 0.5)
    assert Certificate.from_dict(certificate.to_dict()) == certificate


def test_calibration_shares_no_seed_with_training_or_evaluation():
    seeds = []
    for seed in range(300):
        seeds += [seed_for("calibration", seed), seed_for("evaluation", seed)]
    assert len(set(seeds)) == len(seeds)
    assert min(seeds) > 2**40  # training draws from its seed and the next number
    card = load_model().card
    used = [e["seed"] for e in (*card["certificates"], *card["evaluation"].values())]
    assert len(set(used)) == len(used) and min(used) > 2**40


def test_the_shipped_certificate_reaches_every_rate_of_the_ladder():
    certificates = load_model().certificates
    assert [c.contact for c in certificates] == [PERMANENT, ARCS]
    for certificate, loose, strict in zip(certificates, (0.02, 0.05), (0.05, 0.12), strict=True):
        assert certificate.distribution == "reference/1"
        assert certificate.alphas == LADDER and certificate.confidence == 0.95
        for line in certificate.table:
            assert binomial_p_value(line.errors, line.accepted, line.alpha) <= 0.05
            assert line.false_unstable_rate <= 0.01
        assert certificate.line(1e-3).verified_share <= loose
        assert certificate.line(1e-4).verified_share <= strict


@pytest.mark.filterwarnings("ignore:All provided predict_params:UserWarning")
def test_mapie_chooses_the_same_bands_on_the_same_scores():
    mapie = pytest.importorskip("mapie.risk_control", reason="MAPIE is not installed")
    false_stable = mapie.BinaryRisk(
        risk_occurrence=lambda unstable, accepted: unstable == 1,
        risk_condition=lambda unstable, accepted: accepted == 1,
        higher_is_better=False,
    )
    bands = np.array([band.spreads for band in BANDS[PERMANENT]])
    thresholds = bands / (1 + bands)
    compared = set()
    for seed, noise in ((1, 6.0), (2, 3.0), (3, 1.5), (4, 6.0)):
        boundary, ke, unstable = synthetic(20_000, seed, noise)
        below = np.maximum(-boundary.score(ke), 0.0)
        below[below * SPREAD <= LEAST_HALF_WIDTH] = 0.0
        certain = below / (1 + below)
        for alpha in (2e-2, 1e-2, 5e-3, 1e-3):
            theirs = mapie.BinaryClassificationController(
                lambda scores: np.column_stack([1 - scores, scores]),
                false_stable,
                alpha,
                confidence_level=0.95,
                best_predict_param_choice=false_stable,
                list_predict_params=thresholds,
                fwer_method="fixed_sequence",
            ).calibrate(certain, unstable.astype(int))
            ours = certified(20_000, seed, noise, (alpha,)).table
            spreads = ours[0].spreads if ours else None
            held = theirs.valid_predict_params
            assert spreads == (bands[len(held) - 1] if len(held) else None), (seed, alpha)
            compared.add(spreads)
    assert len(compared) >= 4  # not the same answer every time

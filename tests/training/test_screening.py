"""Surrogate or exact: the policy, on the shipped model and real blades."""

from dataclasses import replace

import numpy as np
import pytest

from sdm_core.blade import EXAMPLES, Blade, ModalState, example_blade
from sdm_core.boundary import boundary, verdicts
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput, OutOfSpeedRange, TooMuchWork
from sdm_core.fourier_engagement import FourierEngagement
from training.answers import (
    CONFIDENT,
    EXACT,
    NEAR_BOUNDARY,
    OUT_OF_DOMAIN,
    REQUESTED,
    SURROGATE,
    CertificateUsed,
)
from training.cases import CaseBatch
from training.contact_class import ARCS as WITH_ARCS
from training.contact_class import PERMANENT
from training.evaluation import evaluate
from training.features import MODE_FEATURES, PHASE_FEATURES, features
from training.labelling import critical_kappa, point_verdicts
from training.reference_space import NAME, reference_sample
from training.screening import Screener

LE = ContactConfiguration.at("LE")
ARCS = ContactConfiguration({"LE": 1.0}, [[0.0, 0.25], [0.5, 0.75]])
SMOOTH = ContactConfiguration.at("LE", engagement=FourierEngagement(0.5, [0.4]))


@pytest.fixture(scope="module")
def screener():
    return Screener.default()


@pytest.fixture(scope="module")
def rotor_37():
    return example_blade("nasa_rotor_37")


@pytest.fixture(scope="module")
def unseen():
    sample = reference_sample(1500, seed=60_001)
    critical = critical_kappa(sample.cases, workers=1) * sample.cases.stiffness_scale
    return sample, critical


def test_the_shipped_model_keeps_its_promises_on_points_it_never_saw(screener, unseen):
    sample, critical = unseen
    model = screener.model
    found = evaluate(
        model.surrogate.boundary(sample.cases),
        model.certificate(PERMANENT).line().band,
        model.design_space.contains(sample.cases),
        sample.ke,
        critical,
        sample.ke > critical,
        distribution=NAME,
    )
    assert found.median_boundary_error <= 0.01
    assert found.auto.false_stable == 0
    assert found.auto.false_unstable_rate <= 0.01
    assert found.auto.exact_share <= 0.10
    assert found.alone.false_stable_rate <= 0.01


def test_the_shipped_model_keeps_its_promises_with_arcs(screener):
    sample = reference_sample(1500, 60_002, WITH_ARCS)
    unstable = point_verdicts(sample.cases, sample.ke, workers=1) != 1.0
    model = screener.model
    boundary, line = model.surrogate.boundary(sample.cases), model.certificate(WITH_ARCS).line(1e-4)
    says_unstable = boundary.score(sample.ke) > 0
    assert (says_unstable != unstable).mean() <= 0.005
    verified = line.band.verify(boundary, sample.ke)
    assert verified.mean() <= 0.12
    assert not (unstable & ~says_unstable & ~verified).any()
    assert (~unstable & says_unstable & ~verified).sum() <= 0.01 * (says_unstable & ~verified).sum()


def test_the_shipped_model_needs_its_phase_features(screener, unseen, monkeypatch):
    sample, critical = unseen
    informed = screener.model.surrogate.boundary(sample.cases).log_ke

    def shuffled(cases):
        found = features(cases)
        blind = [i for i, name in enumerate(MODE_FEATURES) if name in PHASE_FEATURES]
        by_mode = found.inputs[:, : 5 * len(MODE_FEATURES)].view(len(found.inputs), len(MODE_FEATURES), 5)
        by_mode[:, blind] = by_mode.roll(1, dims=0)[:, blind]
        return found

    monkeypatch.setattr("training.surrogate.features", shuffled)
    blind = screener.model.surrogate.boundary(sample.cases).log_ke
    truth = np.log10(critical)
    assert np.median(np.abs(blind - truth)) > 4 * np.median(np.abs(informed - truth))


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize("nodes", [("LE",), ("TE",), ("LE", "TE")])
def test_an_automatic_map_of_a_real_blade_has_every_verdict_of_the_exact_core(screener, name, nodes):
    blade, contact = example_blade(name), ContactConfiguration.at(*nodes)
    speed = np.linspace(0.06 * blade.first_frequency_hz, blade.speed_range_hz[1], 60)
    ke = np.linspace(0.0, 1e5, 60)
    assert screener.model.design_space.contains(CaseBatch.from_blade(blade, contact, speed)).all()
    found = screener.map(blade, contact, speed, ke)
    grid = np.meshgrid(speed, ke)
    exact = verdicts(blade, contact, grid[0].ravel(), grid[1].ravel()).reshape(60, 60)
    np.testing.assert_array_equal(found.stable, exact)
    assert found.exact_share <= 0.10
    assert ((found.source == EXACT) == (found.reason == NEAR_BOUNDARY)).all()
    assert np.isnan(found.unstable_probability[found.source == EXACT]).all()


def test_boundary_of_a_real_blade_is_that_of_the_exact_core(screener, rotor_37):
    speed = np.linspace(60.0, 300.0, 120)
    found = screener.boundary(rotor_37, LE, speed, 2.5e4)
    exact = boundary(rotor_37, LE, speed, 2.5e4)
    np.testing.assert_array_equal(np.isnan(found.critical_ke), np.isnan(exact.critical_ke))
    there = ~np.isnan(exact.critical_ke)
    error = np.abs(found.critical_ke[there] / exact.critical_ke[there] - 1)
    assert np.median(error) < 0.01 and error.max() < 0.05
    answered = found.source == SURROGATE
    assert (error <= found.error_estimate[there] + 1e-9)[answered[there]].mean() > 0.95


def test_points_say_where_their_answer_comes_from(screener, rotor_37):
    critical = boundary(rotor_37, LE, np.array([250.0]), 1e6).critical_ke[0]
    ke = critical * np.array([0.2, 0.999, 1.001, 5.0])
    found = screener.points(rotor_37, LE, np.full(4, 250.0), ke)
    assert list(found.source) == [SURROGATE, EXACT, EXACT, SURROGATE]
    assert list(found.reason) == [CONFIDENT, NEAR_BOUNDARY, NEAR_BOUNDARY, CONFIDENT]
    assert list(found.stable) == [1.0, 1.0, 0.0, 0.0]
    assert np.isnan(found.spectral_radius[[0, 3]]).all()
    assert found.spectral_radius[1] < 1 < found.spectral_radius[2]
    assert found.unstable_probability[0] < 0.01 and found.unstable_probability[3] > 0.99
    assert found.model == screener.model_id


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_automatic_map_with_arcs_has_every_verdict_of_the_exact_core(screener, name):
    blade, contact = (
        example_blade(name),
        ContactConfiguration({"LE": 1.0, "TE": 0.5}, [[0.1, 0.3], [0.6, 0.95]]),
    )
    speed = np.linspace(0.06 * blade.first_frequency_hz, blade.speed_range_hz[1], 40)
    ke = np.linspace(0.0, 1e5, 40)
    found = screener.map(blade, contact, speed, ke, alpha=1e-4)
    grid = np.meshgrid(speed, ke)
    exact = verdicts(blade, contact, grid[0].ravel(), grid[1].ravel()).reshape(40, 40)
    np.testing.assert_array_equal(found.stable, exact)
    assert found.exact_share <= 0.15
    assert found.certificate.alpha == 1e-4


def test_beyond_the_stiffness_it_was_trained_for_the_exact_core_answers(screener, rotor_37):
    for contact, kappa in ((LE, 4.0), (ARCS, 1.5)):
        reach = kappa * CaseBatch.from_blade(rotor_37, contact, np.array([250.0])).stiffness_scale[0]
        ke = reach * np.array([0.9, 1.1])
        found = screener.points(rotor_37, contact, np.full(2, 250.0), ke)
        assert (found.source[1], found.reason[1]) == (EXACT, OUT_OF_DOMAIN)
        assert found.reason[0] != OUT_OF_DOMAIN
        with pytest.raises(InvalidInput, match=r"ke = .*the surrogate knows this blade up to"):
            screener.points(rotor_37, contact, np.full(2, 250.0), ke, policy="surrogate")


def test_smooth_engagement_and_low_speed_are_answered_exactly_and_say_so(screener, rotor_37):
    smooth = screener.points(rotor_37, SMOOTH, np.array([250.0]), np.array([1e3]))
    assert (smooth.source[0], smooth.reason[0]) == (EXACT, OUT_OF_DOMAIN)
    slow = screener.boundary(rotor_37, LE, np.array([20.0]), 2.5e4)
    assert (slow.source[0], slow.reason[0]) == (EXACT, OUT_OF_DOMAIN)
    asked = screener.map(rotor_37, LE, np.array([250.0]), np.array([1e3]), policy="exact")
    assert (asked.source[0, 0], asked.reason[0, 0]) == (EXACT, REQUESTED)


def test_the_surrogate_alone_refuses_what_lies_outside_its_domain(screener, rotor_37):
    many = ContactConfiguration.at("LE", arcs=[[0.2 * i, 0.2 * i + 0.1] for i in range(5)])
    with pytest.raises(InvalidInput, match="more than 4 arcs of contact"):
        screener.points(rotor_37, many, np.array([250.0]), np.array([1e3]), policy="surrogate")
    with pytest.raises(InvalidInput, match="smooth engagement"):
        screener.points(rotor_37, SMOOTH, np.array([250.0]), np.array([1e3]), policy="surrogate")
    with pytest.raises(InvalidInput, match=r"speed_hz\[1\] = 20 Hz: speed/f1 outside"):
        screener.boundary(rotor_37, LE, np.array([250.0, 20.0]), 2.5e4, policy="surrogate")


def test_more_exact_work_than_allowed_is_refused(rotor_37):
    small = Screener(None, exact_budget_s=0.5)
    with pytest.raises(TooMuchWork, match="at most 25"):
        small.points(rotor_37, LE, np.full(30, 250.0), np.full(30, 1e3), policy="exact")
    with pytest.raises(TooMuchWork):
        small.map(rotor_37, ARCS, np.linspace(100, 200, 40), np.linspace(0, 1e3, 40), policy="exact")


def test_without_a_model_only_exact_answers_are_given(rotor_37):
    empty = Screener(None)
    with pytest.raises(InvalidInput, match="no model is loaded"):
        empty.points(rotor_37, LE, np.array([250.0]), np.array([1e3]))
    assert empty.points(rotor_37, LE, np.array([250.0]), np.array([1e3]), policy="exact").stable[0] == 1.0


def test_bad_questions_are_refused_whatever_the_policy(screener, rotor_37):
    for policy in ("auto", "surrogate", "exact"):
        with pytest.raises(InvalidInput, match=r"contact\.weights\.tip"):
            screener.points(
                rotor_37, ContactConfiguration.at("tip"), np.array([250.0]), np.array([1.0]), policy
            )
        with pytest.raises(OutOfSpeedRange):
            screener.boundary(rotor_37, LE, np.array([999.0]), 1e4, policy)
    with pytest.raises(InvalidInput, match="policy"):
        screener.map(rotor_37, LE, np.array([250.0]), np.array([1.0]), policy="guess")
    with pytest.raises(InvalidInput, match="ke = 1 numbers"):
        screener.points(rotor_37, LE, np.array([250.0, 260.0]), np.array([1.0]))


def test_a_blade_whose_contact_node_never_moves_is_stable_without_a_crossing(screener):
    still = Blade("still", ("a", "b"), 1e-3, [ModalState(0.0, np.array([100.0]), np.array([[0.0, 1.0]]))])
    contact = ContactConfiguration.at("a")
    found = screener.boundary(still, contact, np.array([30.0]), 1e6)
    assert np.isnan(found.critical_ke[0]) and found.unstable_ke[0] == ()
    assert screener.points(still, contact, np.array([30.0]), np.array([1e6])).stable[0] == 1.0


def with_bands(screener, **spreads):
    """The same model with one line for each alpha, of chosen bands."""
    certificate = screener.model.certificate(PERMANENT)
    lines = tuple(replace(certificate.table[0], alpha=float(a), spreads=s) for a, s in spreads.items())
    return Screener(replace(screener.model, certificates=(replace(certificate, table=lines),)))


def test_a_stricter_rate_never_verifies_less_and_says_under_what_it_answered(screener, rotor_37):
    speed, ke = np.linspace(60.0, 300.0, 40), np.linspace(0.0, 2.5e4, 40)
    banded = with_bands(screener, **{"1e-2": 2.0, "5e-4": 40.0, "1e-4": 80.0})
    loose, usual, strict = (banded.map(rotor_37, LE, speed, ke, alpha=a) for a in (1e-2, None, 1e-4))
    assert loose.exact_share < usual.exact_share < strict.exact_share
    for less, more in ((loose, usual), (usual, strict)):
        assert (more.source[less.source == EXACT] == EXACT).all()
    assert loose.certificate == CertificateUsed(1e-2, 0.95, NAME, 2.0)
    assert usual.certificate == CertificateUsed(5e-4, 0.95, NAME, 40.0)
    few, many = (banded.points(rotor_37, LE, speed, np.full(40, 1e4), alpha=a) for a in (1e-2, 1e-4))
    assert few.exact_share < many.exact_share
    assert many.certificate == strict.certificate
    sure, unsure = (banded.boundary(rotor_37, LE, speed, 2.5e4, alpha=a) for a in (1e-2, 1e-4))
    assert sure.exact_share < unsure.exact_share
    assert unsure.certificate == strict.certificate


def test_every_certified_rate_can_be_asked_for_and_no_other(screener, rotor_37):
    asked = (rotor_37, LE, np.array([250.0]), np.array([1e3]))
    for alpha in (1e-2, 5e-3, 1e-3, 5e-4, 1e-4):
        assert screener.map(*asked, alpha=alpha).certificate.alpha == alpha
    for ask in (screener.points, screener.map):
        with pytest.raises(InvalidInput, match=r"alpha = 0\.002: .*0\.01, 0\.005, 0\.001, 0\.0005, 0\.0001"):
            ask(*asked, alpha=2e-3)
    with pytest.raises(InvalidInput, match="alpha = 1e-05"):
        screener.boundary(rotor_37, LE, np.array([250.0]), 1e4, alpha=1e-5)
    for alpha in (0.0, -1e-3, 2.0, np.nan, True, "1e-3"):
        with pytest.raises(InvalidInput, match="alpha"):
            screener.map(*asked, alpha=alpha)


def test_without_the_surrogate_or_without_verification_there_is_no_certificate(screener, rotor_37):
    speed, ke = np.array([250.0]), np.array([1e3])
    assert screener.map(rotor_37, LE, speed, ke, "exact", alpha=1e-3).certificate is None
    assert screener.points(rotor_37, SMOOTH, speed, ke, alpha=1e-3).certificate is None
    assert screener.boundary(rotor_37, LE, np.array([20.0]), 1e4).certificate is None  # out of domain
    assert screener.map(rotor_37, LE, speed, ke, "surrogate").certificate is None
    with pytest.raises(InvalidInput, match="the surrogate alone keeps no rate"):
        screener.map(rotor_37, LE, speed, ke, "surrogate", alpha=1e-3)

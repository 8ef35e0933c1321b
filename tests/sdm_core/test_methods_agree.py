"""Independent methods give the same answer; fast paths and their slow twins are held together."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from named_problems import benchmark_blade, random_problem, receptance

from sdm_core.boundary import boundary, verdicts
from sdm_core.contact import ContactConfiguration
from sdm_core.floquet.arc_boundary import least_destabilising_ke
from sdm_core.floquet.characteristic import CharacteristicEquation
from sdm_core.floquet.fredholm import LeadingMultipliers
from sdm_core.permanent_contact.closed_form import crossings
from sdm_core.permanent_contact.receptance import swept
from sdm_core.permanent_contact.root_count import unstable_root_count
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.semi_discretization import Converged
from sdm_core.stability import stability

ARCS = {
    "one arc": [[0.1, 0.4]],
    "two arcs": [[0.0, 0.25], [0.5, 0.75]],
    "an arc past 1": [[0.2, 0.3], [0.9, 1.15]],
    "four arcs": [[0.02, 0.1], [0.3, 0.35], [0.5, 0.72], [0.8, 0.97]],
}


@pytest.mark.parametrize("seed", range(60))
def test_closed_form_and_root_count_agree_on_every_number_of_unstable_roots(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng)
    ke_max = 20 * problem.ke
    found = crossings(receptance(problem), problem.speed_hz, ke_max)
    assert found.consistent
    ke = ke_max * np.exp(rng.uniform(-5, 0, 12))
    near = np.concatenate([found.ke[:3] * (1 - 1e-5), found.ke[:3] * (1 + 1e-5)])
    for value, count in zip(
        np.r_[ke, near],
        unstable_root_count(receptance(problem), problem.speed_hz, np.r_[ke, near]),
        strict=True,
    ):
        assert count == 2 * found.direction[found.ke <= value].sum()


@pytest.mark.parametrize("seed", range(20))
def test_both_proofs_count_the_same_unstable_roots_in_permanent_contact(seed):
    problem = random_problem(np.random.default_rng(seed), kappa=0.1)
    count = unstable_root_count(receptance(problem), problem.speed_hz, np.array([problem.ke]))[0]
    assert CharacteristicEquation(problem).count_outside() == count


@pytest.mark.parametrize("arcs", [None, *ARCS.values()], ids=["permanent", *ARCS])
@pytest.mark.parametrize("seed", range(4))
def test_exact_multiplier_is_the_limit_of_semi_discretization(arcs, seed):
    # Up to three modes and one revolution of few oscillations, so that a dense matrix converges.
    problem = random_problem(np.random.default_rng(seed), arcs, kappa=0.08, most_modes=3)
    problem = replace(problem, speed_hz=max(problem.speed_hz, problem.omega.max() / (2 * np.pi * 9)))
    exact = stability(problem)
    assert exact.error_estimate < 1e-9
    refined = Converged(5e-5).dominant(problem.delay_equation())
    assert refined.converged
    assert abs(refined.multiplier) == pytest.approx(exact.spectral_radius, rel=1e-4)


def test_first_crossing_alone_is_the_first_of_all():
    for seed in range(30):
        problem = random_problem(np.random.default_rng(seed))
        ke_max = 30 * problem.ke
        sweep = swept(receptance(problem), ke_max)
        every = crossings(receptance(problem), problem.speed_hz, ke_max, sweep=sweep)
        first = crossings(receptance(problem), problem.speed_hz, ke_max, sweep=sweep, first_only=True)
        assert len(every.ke) == 0 or first.ke[0] == pytest.approx(every.ke[0], rel=1e-10)


def test_boundary_with_one_arc_all_round_is_that_of_permanent_contact():
    blade = benchmark_blade()
    # A gap of a billionth of a revolution: other code, the same physics.
    nearly = ContactConfiguration({"tip": 1.0}, [(0.0, 1.0 - 1e-9)])
    assert not nearly.permanent
    speed = np.array([0.21, 0.33])
    permanent = boundary(blade, ContactConfiguration.at("tip"), speed, 4.0)
    arcs = boundary(blade, nearly, speed, 4.0)
    np.testing.assert_allclose(arcs.critical_ke, permanent.critical_ke, rtol=1e-6)
    np.testing.assert_allclose(arcs.chatter_hz, permanent.chatter_hz, rtol=1e-6)


@pytest.mark.parametrize("arcs", ARCS.values(), ids=list(ARCS))
def test_arc_boundary_separates_proven_verdicts(arcs):
    blade = benchmark_blade()
    contact = ContactConfiguration({"tip": 1.0}, arcs)
    found = boundary(blade, contact, np.array([0.23]), 40.0)
    assert np.isfinite(found.critical_ke).all()
    assert found.error_estimate[0] < 1e-8
    ke = found.critical_ke[0]
    below, above = verdicts(blade, contact, np.full(2, 0.23), ke * np.array([1 - 1e-6, 1 + 1e-6]))
    assert (below, above) == (1.0, 0.0)
    at = stability(RubbingBlade.from_blade(blade, contact, 0.23, ke))
    assert at.spectral_radius == pytest.approx(1.0, abs=1e-9)
    assert at.chatter_hz == pytest.approx(found.chatter_hz[0], rel=1e-6)


def test_chatter_frequency_in_permanent_contact_is_that_of_the_crossing_root():
    for seed in range(8):
        problem = random_problem(np.random.default_rng(seed))
        found = crossings(receptance(problem), problem.speed_hz, 30 * problem.ke)
        if not len(found.ke):
            continue
        at = stability(problem.with_ke(found.ke[0]))
        assert at.spectral_radius == pytest.approx(1.0, abs=1e-9)
        assert at.chatter_hz == pytest.approx(found.frequency_hz[0], rel=1e-7)


def test_what_the_root_count_does_not_confirm_is_not_decided(monkeypatch):
    blade, contact = benchmark_blade(), ContactConfiguration.at("tip")
    speed = np.array([0.23, 0.3])
    monkeypatch.setattr("sdm_core.boundary.unstable_root_count", lambda *_: np.full(3, np.nan))
    found = boundary(blade, contact, speed, 4.0)
    assert np.isinf(found.error_estimate).all()
    assert np.isnan(verdicts(blade, contact, speed, np.array([1e-3, 2.0]))).all()
    none_below = boundary(blade, contact, speed, 1e-6)
    assert np.isnan(none_below.critical_ke).all() and np.isinf(none_below.error_estimate).all()


@pytest.mark.parametrize("seed", range(20))
def test_no_crossing_lies_below_the_small_gain_bound(seed):
    # For one mode the bound is ξ√(1 − ξ²)ω²/φ², half of the smallest K_e over all speeds.
    problem = random_problem(np.random.default_rng(seed))
    bound = least_destabilising_ke(problem)
    found = crossings(receptance(problem), problem.speed_hz, 100 * problem.ke)
    assert bound > 0 and (found.ke > bound).all()
    arcs = random_problem(np.random.default_rng(seed), ARCS["two arcs"])
    assert stability(arcs.with_ke(0.999 * bound)).stable is True


def test_an_arc_boundary_with_an_undecided_verdict_is_not_proven(monkeypatch):
    contact = ContactConfiguration({"tip": 1.0}, ARCS["one arc"])

    def unresolved(expansion, ke):
        none = np.zeros(len(ke), dtype=bool)
        return LeadingMultipliers(np.zeros((len(ke), 1)), np.zeros((len(ke), 1)), np.full(len(ke), -1), none)

    monkeypatch.setattr("sdm_core.floquet.arc_boundary.leading_multipliers", unresolved)
    monkeypatch.setattr(
        "sdm_core.floquet.arc_boundary.batch_multipliers",
        lambda problems, **_: SimpleNamespace(stable=np.full(len(problems), np.nan)),
    )
    found = boundary(benchmark_blade(), contact, np.array([0.23]), 1.0)
    assert np.isinf(found.error_estimate).all()

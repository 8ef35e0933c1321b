"""What must not change the answer, and what the physics forbids."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from named_problems import random_problem, receptance

from sdm_core.characteristic import CharacteristicEquation
from sdm_core.closed_form import crossings
from sdm_core.contact import ContactConfiguration
from sdm_core.delay_equation import Engagement
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.semi_discretization import Averaged
from sdm_core.stability import stability

TWO_ARCS = [[0.1, 0.3], [0.55, 0.8]]


def radius(problem: RubbingBlade) -> float:
    return stability(problem).spectral_radius


@pytest.mark.parametrize("arcs", [None, TWO_ARCS], ids=["permanent", "arcs"])
@pytest.mark.parametrize("seed", range(3))
def test_mode_signs_node_order_and_mode_order_do_not_matter(arcs, seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, arcs)
    n = len(problem.omega)
    reference = radius(problem)
    signs = rng.choice([-1.0, 1.0], n)
    assert radius(replace(problem, contact_shape=problem.contact_shape * signs)) == pytest.approx(
        reference, rel=1e-9
    )
    nodes = replace(problem, contact_shape=problem.contact_shape[rng.permutation(3)])
    assert radius(nodes) == pytest.approx(reference, rel=1e-9)
    order = rng.permutation(n)
    modes = replace(
        problem,
        omega=problem.omega[order],
        damping_ratio=problem.damping_ratio[order],
        contact_shape=problem.contact_shape[:, order],
    )
    assert radius(modes) == pytest.approx(reference, rel=1e-9)


@pytest.mark.parametrize("arcs", [None, TWO_ARCS], ids=["permanent", "arcs"])
def test_only_ratios_of_time_matter(arcs):
    problem = random_problem(np.random.default_rng(5), arcs)
    faster = replace(problem, omega=3 * problem.omega, speed_hz=3 * problem.speed_hz, ke=9 * problem.ke)
    assert radius(faster) == pytest.approx(radius(problem), rel=1e-9)


def test_rotating_the_casing_does_not_move_the_multipliers():
    problem = random_problem(np.random.default_rng(2), TWO_ARCS)
    turned = ContactConfiguration({"a": 1.0}, [[0.25, 0.5], [0.8, 1.0]])
    shifted = replace(problem, arcs=turned.arcs, segments=turned.segments)
    here = ContactConfiguration({"a": 1.0}, [[0.1, 0.35], [0.65, 0.85]])
    original = replace(problem, arcs=here.arcs, segments=here.segments)
    assert radius(shifted) == pytest.approx(radius(original), rel=1e-9)


def test_splitting_a_node_into_two_halves_changes_nothing():
    problem = random_problem(np.random.default_rng(3))
    split = np.vstack([problem.contact_shape, problem.contact_shape]) * np.sqrt(0.5)
    assert radius(replace(problem, contact_shape=split)) == pytest.approx(radius(problem), rel=1e-9)


def test_the_delayed_force_vanishes_where_every_revolution_repeats():
    # At μ = 1 the displacement a revolution ago is the present one, so K_e has no effect there:
    # a wrong sign of the delayed term doubles the force instead.
    for arcs in (None, TWO_ARCS):
        problem = random_problem(np.random.default_rng(7), arcs)
        loaded = CharacteristicEquation(problem).fundamental(np.array([1.0]))
        free = CharacteristicEquation(problem.with_ke(0.0)).fundamental(np.array([1.0]))
        np.testing.assert_allclose(loaded, free, atol=1e-10)
        equation = problem.delay_equation()
        t = np.linspace(0.0, equation.tau, 51)
        a, b = equation.means(t[:-1], t[1:])
        n = len(problem.omega)
        unloaded = problem.with_ke(0.0).delay_equation().a.constant
        np.testing.assert_allclose(
            (a + b)[:, n:, :n], np.broadcast_to(unloaded[n:, :n], (50, n, n)), rtol=1e-9
        )


@pytest.mark.parametrize("seed", range(10))
def test_a_damped_blade_chatters_just_above_a_natural_frequency(seed):
    problem = random_problem(np.random.default_rng(seed))
    found = crossings(receptance(problem), problem.speed_hz, 30 * problem.ke)
    assert (found.frequency_hz[:1] * 2 * np.pi > problem.omega.min()).all()


def test_state_of_the_paper_has_n_times_n_plus_two_entries():
    problem = random_problem(np.random.default_rng(0))
    n = len(problem.omega)
    method = Averaged(24)
    assert method.state_size(problem.delay_equation()) == n * (24 + 2)
    assert method.monodromy(problem.delay_equation()).shape == (n * 26, n * 26)


@settings(max_examples=60, deadline=None)
@given(
    start=st.floats(0.0, 0.99),
    length=st.floats(0.01, 1.0),
    cuts=st.lists(st.floats(0.001, 0.999), min_size=0, max_size=8, unique=True),
)
def test_means_of_the_engagement_add_up_to_the_engaged_fraction(start, length, cuts):
    contact = ContactConfiguration({"a": 1.0}, [(start, start + length)])
    assert sum(s.length for s in contact.segments) == pytest.approx(1.0)
    edges = np.r_[0.0, np.sort(cuts), 1.0] * 0.02
    edges = edges[np.r_[True, np.diff(edges) > 1e-9]]
    means = Engagement(contact.arcs, 0.02).mean(edges[:-1], edges[1:])
    assert (means > -1e-6).all() and (means < 1 + 1e-6).all()
    total = (means * np.diff(edges)).sum() / (edges[-1] - edges[0])
    if edges[-1] == 0.02:
        assert total == pytest.approx(contact.engaged_fraction, abs=1e-9)


def test_an_undamped_blade_without_contact_is_not_decided():
    problem = random_problem(np.random.default_rng(1))
    undamped = replace(problem, damping_ratio=np.zeros_like(problem.damping_ratio)).with_ke(0.0)
    assert stability(undamped).stable is None

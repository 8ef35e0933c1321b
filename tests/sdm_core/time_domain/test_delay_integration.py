"""The delay equation integrated in time: against closed forms, jitcdde, known answers and the exact core."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from named_problems import MATHIEU_RADIUS, MILLING_RADIUS, mathieu, milling

from benchmarks.random_blades import random_rubbing_blade
from sdm_core.errors import InvalidInput, TooMuchWork
from sdm_core.fourier_engagement import FourierEngagement
from sdm_core.rubbing_blade import RubbingBlade, single_state_problem
from sdm_core.stability import stability
from sdm_core.time_domain.fitted_growth import fitted_growth
from sdm_core.time_domain.method_of_steps import MethodOfSteps
from sdm_core.time_domain.motion import held_node, integrated, state_weights
from sdm_core.time_domain.revolution import Revolution
from sdm_core.time_domain.revolution_map import leading_floquet_modes
from sdm_core.time_domain.witness import time_witness

ARCS = [[0.1, 0.35], [0.62, 0.8]]


def one_mode(ke: float, arcs: list | None = None) -> RubbingBlade:
    return single_state_problem([100.0], 0.01, [[2.0]], [1.0], speed_hz=17.0, ke=ke, arcs=arcs)


def two_modes(arcs: list | None = None, ke: float = 4000.0) -> RubbingBlade:
    return single_state_problem([100.0, 310.0], 0.004, [[2.0], [-3.0]], [1.0], 41.0, ke, arcs)


def damped(omega: float, xi: float, x: float, v: float, t: np.ndarray) -> np.ndarray:
    """Displacement of ẍ + 2ξωẋ + ω²x = 0 from (x, v)."""
    root = omega * np.sqrt(1 - xi**2)
    return np.exp(-xi * omega * t) * (x * np.cos(root * t) + (v + xi * omega * x) / root * np.sin(root * t))


def test_without_cutting_a_blade_vibrates_freely():
    problem = one_mode(0.0)
    motion = integrated(problem, np.array([0.3]), 5)
    t = np.linspace(0, motion.duration, 400)
    expected = damped(problem.omega[0], 0.01, 0.3, 0.0, t)
    assert np.abs(motion.at(t)[0][:, 0] - expected).max() < 1e-9


@pytest.mark.parametrize("ke", [500.0, 40_000.0])
def test_over_the_first_revolution_a_held_blade_swings_about_what_it_was_held_at(ke):
    problem = one_mode(ke)
    omega, force, held = problem.omega[0], ke * 4.0, 0.3
    stiffer = np.sqrt(omega**2 + force)
    rest = force / stiffer**2 * held
    t = np.linspace(0, problem.tau, 300)
    expected = rest + damped(stiffer, 0.01 * omega / stiffer, held - rest, 0.0, t)
    motion = integrated(problem, np.array([held]), 1)
    assert np.abs(motion.at(t)[0][:, 0] - expected).max() < 1e-9


def test_out_of_its_arcs_a_blade_is_free():
    problem = one_mode(40_000.0, ARCS)
    motion = integrated(problem, np.array([0.3]), 4)
    start, end = (3 + 0.35) * problem.tau, (3 + 0.62) * problem.tau
    (x,), (v,) = (part[0] for part in motion.at(np.array([start])))
    t = np.linspace(start, end, 50)
    assert np.abs(motion.at(t)[0][:, 0] - damped(problem.omega[0], 0.01, x, v, t - start)).max() < 1e-9


@pytest.mark.parametrize("arcs", [None, ARCS], ids=["permanent", "arcs"])
def test_velocity_is_the_derivative_of_displacement_at_every_instant(arcs):
    problem = two_modes(arcs)
    motion = integrated(problem, np.array([1.0, -0.4]), 3)
    t = np.linspace(0.05, 2.95, 200) * problem.tau
    h = 1e-6 * problem.tau
    (after, _), (before, _) = motion.at(t + h), motion.at(t - h)
    _, v = motion.at(t)
    assert np.abs((after - before) / (2 * h) - v).max() < 1e-5 * np.abs(v).max()


@pytest.mark.parametrize("arcs", [None, ARCS], ids=["permanent", "arcs"])
def test_steps_end_at_every_revolution_and_where_the_contact_begins_and_ends(arcs):
    problem = two_modes(arcs)
    for revolution in integrated(problem, np.array([1.0, -0.4]), 3).revolutions:
        ends = revolution.mesh.ends / problem.tau
        for edge in [0.0, 1.0, *(x for arc in arcs or () for x in arc)]:
            assert np.abs(ends - edge).min() < 1e-12


@pytest.mark.parametrize("arcs", [None, ARCS], ids=["permanent", "arcs"])
def test_a_tighter_tolerance_leaves_a_smaller_error(arcs):
    problem, history = two_modes(arcs), np.array([1.0, -0.4])
    t = np.linspace(0, 6 * problem.tau, 500)
    true = integrated(problem, history, 6, rtol=1e-13).at(t)[0]
    error = [np.abs(integrated(problem, history, 6, rtol=10.0**-k).at(t)[0] - true).max() for k in (4, 7, 10)]
    # Steps are cut in whole parts, so that the error falls with the tolerance in leaps.
    assert error[0] > 30 * error[1] > 900 * error[2]
    assert error[2] < 1e-8


def by_jitcdde(problem: RubbingBlade, history: np.ndarray, arcs: list | None, steps: int) -> np.ndarray:
    """Modal displacements at the ends of three revolutions of so many steps (Bogacki, Shampine 3(2))."""
    import symengine
    from jitcdde import jitcdde, t, y

    n, engaged = len(history), symengine.Symbol("engaged")
    force, turn = problem.ke * problem.contact_matrix * problem.tau**2, problem.omega * problem.tau
    rates = {y(j): y(n + j) for j in range(n)}
    for j in range(n):
        pushed = sum(force[j, k] * (y(k, t - 1) - y(k)) for k in range(n))
        friction = 2 * problem.damping_ratio[j] * turn[j] * y(n + j)
        rates[y(n + j)] = -(turn[j] ** 2) * y(j) - friction + engaged * pushed
    other = jitcdde(rates, control_pars=[engaged], delays=[0, 1], max_delay=1, verbose=False)
    other.constant_past(np.r_[history, np.zeros(n)])
    other.generate_lambdas(simplify=False)
    edges, found = sorted({0.0, 1.0, *(x for arc in arcs or () for x in arc)}), []
    for revolution in range(3):
        for a, b in pairwise(edges):
            inside = arcs is None or any(low <= a < high for low, high in arcs)
            other.set_parameters(1.0 if inside else 0.0)
            other.adjust_diff(1e-7)  # it is told of the jump in the derivative
            last = other.integrate_blindly(revolution + b, (b - a) / round(steps * (b - a)))
        found.append(last[:n])
    return np.array(found)


@pytest.mark.parametrize("arcs", [None, ARCS], ids=["permanent", "arcs"])
def test_jitcdde_converges_to_the_same_motion(arcs):
    pytest.importorskip("jitcdde", reason="jitcdde is not installed")
    problem, history = two_modes(arcs), np.array([1.0, -0.4])
    motion = integrated(problem, history, 3).at(np.arange(1, 4) * problem.tau)[0]
    coarse, fine = (np.abs(by_jitcdde(problem, history, arcs, m) - motion).max() for m in (500, 1000))
    assert fine < 3e-4
    assert 6 < coarse / fine < 10  # of third order: the eighth part with half the step


def test_the_delayed_mathieu_equation_has_its_known_multiplier():
    first = leading_floquet_modes(mathieu())[0]
    assert abs(first.multiplier) == pytest.approx(MATHIEU_RADIUS, abs=1e-6)
    assert first.error_estimate < 1e-9


@pytest.mark.parametrize("depth", MILLING_RADIUS)
def test_milling_has_its_known_multiplier(depth):
    assert abs(leading_floquet_modes(milling(depth))[0].multiplier) == pytest.approx(
        MILLING_RADIUS[depth], abs=1e-5
    )


@pytest.mark.parametrize("seed", range(12))
def test_exact_core_and_integration_in_time_give_one_answer(seed):
    rng = np.random.default_rng(seed)
    problem = random_rubbing_blade(rng, modes=1 + seed % 3, arcs=seed % 2 == 1)
    exact, witness = stability(problem), time_witness(problem)
    assert witness.stable == exact.stable
    assert witness.spectral_radius == pytest.approx(exact.spectral_radius, rel=1e-9)
    assert witness.chatter_hz == pytest.approx(exact.chatter_hz, rel=1e-9)
    assert witness.error_estimate < 1e-7 * exact.spectral_radius


def test_the_leading_multipliers_are_those_of_the_exact_core():
    problem = two_modes(ARCS)
    exact = stability(problem).multipliers
    found = leading_floquet_modes(problem.delay_equation(), weights=state_weights(problem))
    assert len(exact) >= 2
    for mine, theirs in zip(found, exact, strict=False):
        assert abs(mine.multiplier - theirs) < 1e-9


def test_smooth_engagement_is_integrated_too():
    engagement = FourierEngagement(0.48, (0.4, 0.1), (0.0, -0.05))
    problem = single_state_problem([100.0], 0.01, [[2.0]], [1.0], 17.0, 40_000.0, engagement=engagement)
    exact = stability(problem)
    assert time_witness(problem).spectral_radius == pytest.approx(exact.spectral_radius, rel=1e-8)


@pytest.mark.parametrize(("ke", "arcs"), [(1000.0, None), (60_000.0, None), (60_000.0, ARCS)])
def test_growth_and_frequency_read_off_the_response_are_those_of_the_dominant_multiplier(ke, arcs):
    problem = two_modes(arcs, ke)
    fit = fitted_growth(integrated(problem, np.array([1.0, -0.4]), 40))
    exact = stability(problem)
    assert abs(fit.growth_per_revolution - exact.growth_per_revolution) <= fit.growth_uncertainty + 1e-9
    assert fit.growth_uncertainty < 1e-4
    assert fit.frequency_hz == pytest.approx(exact.chatter_hz, rel=1e-5)


def test_a_short_response_says_that_its_growth_is_uncertain():
    problem = two_modes(None, 60_000.0)
    growth = stability(problem).growth_per_revolution
    fits = {count: fitted_growth(integrated(problem, np.array([1.0, -0.4]), count)) for count in (8, 14, 40)}
    for fit in fits.values():
        assert abs(fit.growth_per_revolution - growth) < 20 * fit.growth_uncertainty + 1e-9
    assert fits[8].growth_uncertainty > fits[40].growth_uncertainty


def test_a_force_at_a_node_holds_it_where_it_is_said_to_be():
    omega, shape = np.array([600.0, 2000.0]), np.array([2.0, -3.0])
    held = held_node(omega, shape, 2e-3)
    assert held @ shape == pytest.approx(2e-3, rel=1e-12)
    # A force at the node alone: Λ²x is along its mode shape.
    push = omega**2 * held
    assert push[0] / shape[0] == pytest.approx(push[1] / shape[1])


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda p: integrated(p, np.array([1.0]), 3), "history"),
        (lambda p: integrated(p, np.array([1.0, np.nan]), 3), "history[1]"),
        (lambda p: integrated(p, ["a", 1.0], 3), "history[0]"),
        (lambda p: integrated(p, [[1.0], [2.0, 3.0]], 3), "history[0]"),
        (lambda p: integrated(p, [1e300, 0.0], 3), "history[0]"),
        (lambda p: integrated(None, np.ones(2), 3), "problem"),
        (lambda p: integrated(p, np.ones(2), 0), "revolutions"),
        (lambda p: integrated(p, np.ones(2), 2.5), "revolutions"),
        (lambda p: integrated(p, np.ones(2), True), "revolutions"),
        (lambda p: integrated(p.with_ke(1e7), np.ones(2), 2000, rtol=1e-4), "revolutions"),
        (lambda p: integrated(p, np.ones(2), 3, rtol=1e-20), "rtol"),
        (lambda p: integrated(p, np.ones(2), 3, rtol="x"), "rtol"),
        (lambda p: integrated(p, np.ones(2), 3).at(np.array([1.0])), "times[0]"),
        (lambda p: integrated(p, np.ones(2), 3).at(["a"]), "times[0]"),
        (lambda p: integrated(p, np.ones(2), 3).displacement([0.0], [[1.0]]), "mode_shape"),
        (lambda p: integrated(p, np.ones(2), 3).displacement([0.0], [[np.nan], [1.0]]), "mode_shape[0][0]"),
        (lambda p: fitted_growth(integrated(p, np.ones(2), 3)), "revolutions"),
        (lambda p: fitted_growth(integrated(p, np.zeros(2), 8)), "motion"),
        (lambda p: fitted_growth([1.0, 2.0]), "motion"),
        (lambda p: held_node(p.omega, np.zeros(2), 1e-3), "mode_shape"),
        (lambda p: held_node(p.omega, np.ones(3), 1e-3), "mode_shape"),
        (lambda p: held_node([0.0, 1.0], np.ones(2), 1e-3), "omega[0]"),
        (lambda p: held_node(p.omega, np.ones(2), np.nan), "displacement"),
        (lambda p: leading_floquet_modes(p), "equation"),
        (lambda p: leading_floquet_modes(p.delay_equation(), 0), "count"),
        (lambda p: leading_floquet_modes(p.delay_equation(), 2.5), "count"),
        (lambda p: leading_floquet_modes(p.delay_equation(), seed=-1), "seed"),
        (lambda p: leading_floquet_modes(p.delay_equation(), rtol=None), "rtol"),
        (lambda p: leading_floquet_modes(p.delay_equation(), weights=[1.0, 2.0]), "weights"),
        (lambda p: leading_floquet_modes(p.delay_equation(), weights=[1.0, 2.0, 0.0, 1.0]), "weights[2]"),
        (lambda p: time_witness(p.delay_equation()), "problem"),
    ],
)
def test_what_cannot_be_integrated_is_said(call, field):
    with pytest.raises(InvalidInput) as refused:
        call(two_modes())
    assert refused.value.field == field


def test_without_cutting_the_multipliers_are_those_of_free_vibration():
    problem = two_modes(ke=0.0)
    root = problem.omega * np.sqrt(1 - problem.damping_ratio**2)
    free = np.exp((-problem.damping_ratio * problem.omega + 1j * root) * problem.tau)
    found = leading_floquet_modes(problem.delay_equation(), 5, weights=state_weights(problem))
    assert sorted(abs(mode.multiplier) for mode in found) == pytest.approx(sorted(np.abs(free)), rel=1e-9)


def test_as_many_multipliers_as_asked_for_are_found():
    problem = two_modes(ARCS)
    few, many = (leading_floquet_modes(problem.delay_equation(), count) for count in (2, 20))
    assert len(many) == 20
    for one, other in zip(few, many, strict=False):
        assert one.multiplier == pytest.approx(other.multiplier, rel=1e-9)


def test_a_revolution_of_too_many_vibrations_is_refused_before_it_is_begun():
    problem = single_state_problem([1.0, 1e6], 0.01, [[1.0], [1.0]], [1.0], 1.0, 10.0)
    with pytest.raises(TooMuchWork, match="steps a revolution"):
        integrated(problem, np.ones(2), 1)


def test_a_constant_history_is_what_it_was_set_to():
    problem = two_modes()
    mesh = MethodOfSteps(problem.delay_equation()).first_mesh()
    held = Revolution.constant(mesh, np.arange(4.0))
    assert (held.at(np.linspace(0, problem.tau, 7)) == np.arange(4.0)).all()

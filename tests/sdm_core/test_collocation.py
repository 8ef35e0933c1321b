"""Chebyshev collocation: an independent witness of the multipliers."""

import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from named_problems import (
    AT_TIP,
    MATHIEU_RADIUS,
    MILLING_RADIUS,
    benchmark_blade,
    mathieu,
    milling,
    random_problem,
)
from scipy.special import lambertw

from sdm_core.collocation import Collocation
from sdm_core.contact import ContactConfiguration
from sdm_core.delay_equation import Cosine, DelayEquation, Fourier, PeriodicMatrix
from sdm_core.errors import Cancelled, InvalidInput, TooMuchWork
from sdm_core.floquet.characteristic import CharacteristicEquation
from sdm_core.interruption import interruptible
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.semi_discretization import Converged

ARCS = (
    None,
    [[0.1, 0.4]],
    [[0.0, 0.25], [0.5, 0.75]],
    [[0.2, 0.3], [0.9, 1.15]],
    [[0.02, 0.1], [0.3, 0.35], [0.5, 0.72], [0.8, 0.97]],
)


def distance(found: complex, expected: complex) -> float:
    """Relative, a multiplier and its conjugate counting as one."""
    return min(abs(found - expected), abs(np.conj(found) - expected)) / abs(expected)


def with_modulation(problem: RubbingBlade, modulation) -> DelayEquation:
    """The blade with another γ."""
    return DelayEquation.of_second_order(
        np.eye(len(problem.omega)),
        np.diag(2 * problem.damping_ratio * problem.omega),
        np.diag(problem.omega**2),
        problem.ke * problem.contact_matrix,
        problem.tau,
        modulation,
    )


def test_delayed_mathieu_has_its_published_multiplier():
    assert abs(Collocation().multipliers(mathieu(), 1)[0]) == pytest.approx(MATHIEU_RADIUS, rel=1e-6)


@pytest.mark.parametrize("depth", sorted(MILLING_RADIUS))
def test_down_milling_has_its_published_multiplier(depth):
    found = Collocation().multipliers(milling(depth), 1)[0]
    assert abs(found) == pytest.approx(MILLING_RADIUS[depth], rel=5e-6)
    assert distance(found, Collocation().doubled().multipliers(milling(depth), 1)[0]) < 1e-12


@pytest.mark.parametrize(("a", "b", "tau"), [(-1.0, -2.0, 3.0), (0.3, -1.5, 0.7), (-4.0, 1.0, 5.0)])
def test_multipliers_of_the_scalar_equation_are_lamberts(a, b, tau):
    # ż = az + bz(t − τ): μ = e^{sτ}, sτ = aτ + W_k(bτe^{−aτ}).
    s_tau = a * tau + lambertw(b * tau * np.exp(-a * tau), np.arange(-4, 4))
    expected = np.exp(s_tau[np.argsort(-s_tau.real)][:4])
    equation = DelayEquation(PeriodicMatrix(np.array([[a]])), PeriodicMatrix(np.array([[b]])), tau)
    found = Collocation().multipliers(equation, 4)
    np.testing.assert_allclose(np.abs(found), np.abs(expected), rtol=1e-11)


@pytest.mark.parametrize("seed", range(40))
def test_exact_characteristic_equation_has_the_dominant_multiplier_of_collocation(seed):
    problem = random_problem(np.random.default_rng(seed), ARCS[seed % len(ARCS)])
    exact, error = CharacteristicEquation(problem).dominant()
    assert error < 1e-12
    assert distance(Collocation().multipliers(problem, 1)[0], exact) < 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_every_large_multiplier_solves_the_characteristic_equation(seed):
    problem = random_problem(np.random.default_rng(seed), ARCS[seed % len(ARCS)], kappa=0.1)
    found = Collocation().multipliers(problem, 6)
    m = CharacteristicEquation(problem).fundamental(found)
    for mu, matrix in zip(found, m, strict=True):
        assert np.abs(np.linalg.eigvals(matrix) - mu).min() < 1e-9 * abs(mu)
    count = CharacteristicEquation(problem).count_outside()
    assert (np.abs(Collocation().multipliers(problem, 20)) > 1).sum() == count


@pytest.mark.parametrize("slow", [0.03, 0.003])
def test_low_speeds_of_thousands_of_oscillations_keep_the_digits(slow):
    problem = random_problem(np.random.default_rng(1), ARCS[1])
    problem = replace(problem, speed_hz=slow * problem.omega[0] / (2 * np.pi))
    exact, _ = CharacteristicEquation(problem).dominant()
    assert distance(Collocation().multipliers(problem, 1)[0], exact) < 1e-9


@pytest.mark.parametrize(
    "problem",
    [random_problem(np.random.default_rng(3), ARCS[2]), random_problem(np.random.default_rng(4)), mathieu()],
    ids=["arcs", "permanent", "mathieu"],
)
def test_error_falls_a_thousandfold_when_the_order_doubles(problem):
    exact = Collocation(64).multipliers(problem, 1)[0]
    error = [distance(Collocation(m).multipliers(problem, 1)[0], exact) for m in (4, 8, 16, 32)]
    assert error[0] > 1e-6  # or there would be nothing to see
    for coarse, fine in pairwise(error):
        assert fine < max(1e-3 * coarse, 1e-12)


def test_panel_length_does_not_matter_once_converged():
    problem = random_problem(np.random.default_rng(5), ARCS[3])
    one, other = (Collocation(panel_rad=rad).multipliers(problem, 1)[0] for rad in (5.0, 12.0))
    assert distance(one, other) < 1e-12


def test_full_circle_in_two_arcs_is_permanent_contact():
    permanent = random_problem(np.random.default_rng(6))
    arcs = replace(permanent, arcs=((0.0, 0.37), (0.37, 1.0)))
    found, expected = (Collocation().multipliers(p, 4) for p in (arcs, permanent))
    np.testing.assert_allclose(np.abs(found), np.abs(expected), rtol=1e-11)


@pytest.mark.parametrize("shift", [0.13, 0.5, 0.81])
def test_multipliers_do_not_depend_on_where_the_revolution_starts(shift):
    def at(offset: float) -> np.ndarray:
        contact = ContactConfiguration.at("tip", arcs=[[offset, offset + 0.3]])
        return Collocation().multipliers(RubbingBlade.from_blade(benchmark_blade(), contact, 0.21, 2.0), 4)

    np.testing.assert_allclose(np.abs(at(shift)), np.abs(at(0.0)), rtol=1e-11)


def test_smooth_engagement_agrees_with_semi_discretization_and_may_be_shifted():
    problem = RubbingBlade.from_blade(benchmark_blade(), AT_TIP, 0.3, 2.0)
    smooth = with_modulation(problem, Fourier(0.4, (0.4, 0.1), (0.2, 0.0), problem.tau))
    found = Collocation().multipliers(smooth, 1)[0]
    assert distance(found, Collocation().doubled().multipliers(smooth, 1)[0]) < 1e-12
    assert abs(found) == pytest.approx(abs(Converged(1e-6).dominant(smooth).multiplier), rel=1e-5)
    turn = np.exp(2j * np.pi * 0.29 * np.array([1, 2]))
    moved = (np.array([0.4, 0.1]) + 1j * np.array([0.2, 0.0])) * turn
    shifted = Fourier(0.4, tuple(moved.real), tuple(moved.imag), problem.tau)
    assert distance(Collocation().multipliers(with_modulation(problem, shifted), 1)[0], found) < 1e-11


def test_engagement_of_constant_fourier_series_is_permanent_contact():
    problem = random_problem(np.random.default_rng(7))
    constant = with_modulation(problem, Fourier(1.0, (0.0,), (0.0,), problem.tau))
    found, expected = (Collocation().multipliers(p, 1)[0] for p in (constant, problem))
    assert distance(found, expected) < 1e-11


def test_units_of_the_state_do_not_matter():
    equation, scale = mathieu(), np.diag([1.0, 1e-5])
    inverse = np.linalg.inv(scale)

    def similar(matrix: PeriodicMatrix) -> PeriodicMatrix:
        terms = tuple((modulation, scale @ m @ inverse) for modulation, m in matrix.terms)
        return PeriodicMatrix(scale @ matrix.constant @ inverse, terms)

    other = DelayEquation(similar(equation.a), similar(equation.b), equation.tau)
    assert distance(Collocation().multipliers(other, 1)[0], Collocation().multipliers(equation, 1)[0]) < 1e-11


def test_without_delayed_effect_the_multipliers_are_those_of_the_ordinary_equation():
    problem = random_problem(np.random.default_rng(8)).with_ke(0.0)
    rate = problem.omega * (-problem.damping_ratio + 1j * np.sqrt(1 - problem.damping_ratio**2))
    found = Collocation().multipliers(problem)
    expected = np.sort(np.repeat(np.abs(np.exp(rate * problem.tau)), 2))[::-1]
    np.testing.assert_allclose(np.abs(found), expected, rtol=1e-10)


@pytest.mark.parametrize(
    ("settings", "field"),
    [({"order": 3}, "order"), ({"order": 32.0}, "order"), ({"panel_rad": 0.0}, "panel_rad")],
)
def test_unusable_settings_are_refused_by_name(settings, field):
    with pytest.raises(InvalidInput) as refused:
        Collocation(**settings)
    assert refused.value.field == field


def test_far_too_many_oscillations_are_refused_before_they_are_computed():
    problem = replace(random_problem(np.random.default_rng(9), ARCS[1]), speed_hz=1e-3)
    start = time.perf_counter()
    with pytest.raises(TooMuchWork, match=r"tau = .*shorten the delay"):
        Collocation().multipliers(problem, 1)
    swinging = PeriodicMatrix(np.array([[0.0, 80.0], [-80.0, 0.0]]), ((Cosine(100.0), np.eye(2)),))
    with pytest.raises(TooMuchWork, match="too much memory at this order"):
        Collocation(128).multipliers(DelayEquation(swinging, PeriodicMatrix(np.eye(2)), 100.0), 1)
    with pytest.raises(TooMuchWork, match="count = None: name a count"):
        Collocation().multipliers(replace(problem, speed_hz=1.0))
    assert time.perf_counter() - start < 30.0


def test_motion_that_overflows_within_a_revolution_is_refused():
    growing = DelayEquation(PeriodicMatrix(np.array([[900.0]])), PeriodicMatrix(np.array([[0.0]])), 1.0)
    with pytest.raises(InvalidInput, match="overflows"):
        Collocation().multipliers(growing, 1)


def test_collocation_can_be_stopped_from_outside():
    def stop():
        raise Cancelled("enough")

    with interruptible(stop), pytest.raises(Cancelled):
        Collocation().multipliers(mathieu(), 1)

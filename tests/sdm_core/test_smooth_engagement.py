"""Engagement that varies smoothly round the casing, against methods that share nothing with it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from named_problems import random_problem
from scipy.integrate import solve_ivp

from sdm_core.blade import example_blade
from sdm_core.boundary import boundary
from sdm_core.collocation import Collocation
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.floquet import smooth_revolution
from sdm_core.floquet.arc_boundary import boundaries_with_arcs
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.floquet.characteristic import CharacteristicEquation
from sdm_core.floquet.propagation import propagation_of
from sdm_core.fourier_engagement import MOST_HARMONICS, FourierEngagement
from sdm_core.permanent_contact.permanent_boundary import permanent_crossings
from sdm_core.rubbing_blade import RubbingBlade, single_state_problem
from sdm_core.semi_discretization.gauss import Gauss
from sdm_core.stability import stability

ONE = FourierEngagement(1.0)
TWO_ARCS = [[0.0, 0.2], [0.5, 0.8]]
WITNESS = Collocation(48, 6.0)


def random_engagement(rng: np.random.Generator, harmonics: int) -> FourierEngagement:
    """γ from nearly 0 to nearly 1."""
    wave = rng.normal(size=(2, harmonics)) / np.arange(1, harmonics + 1)
    theta = np.arange(4000) / 4000
    phase = 2 * np.pi * np.outer(theta, np.arange(1, harmonics + 1))
    values = np.cos(phase) @ wave[0] + np.sin(phase) @ wave[1]
    margin = 1e-3 * np.ptp(values)
    low, high = values.min() - margin, values.max() + margin
    wave /= high - low
    return FourierEngagement(-low / (high - low), wave[0].tolist(), wave[1].tolist())


def with_engagement(problem: RubbingBlade, engagement: FourierEngagement) -> RubbingBlade:
    return replace(problem, arcs=None, segments=(), engagement=engagement)


def random_smooth_problem(seed: int, kappa: float = 0.05, harmonics: int | None = None) -> RubbingBlade:
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, kappa=kappa, most_modes=4)
    return with_engagement(problem, random_engagement(rng, harmonics or int(rng.integers(1, 8))))


def two_mode_problem(ke: float = 600.0, speed_hz: float = 40.0) -> RubbingBlade:
    engagement = FourierEngagement(0.45, [0.3, -0.1], [0.1, 0.05])
    frequency, shape = np.array([100.0, 400.0]), np.array([[5.0], [4.0]])
    return single_state_problem(
        frequency, np.full(2, 2e-3), shape, np.ones(1), speed_hz, ke, engagement=engagement
    )


def integrated(problem: RubbingBlade, c: complex, times: np.ndarray) -> np.ndarray:
    """Fundamental matrices of ẍ + 2ξΛẋ + (Λ² − cγG)x = 0 in (x, ẋ/ω) at times, by Runge-Kutta steps."""
    n, omega = len(problem.omega), problem.omega

    def rate(t, flat):
        state = flat.reshape(2 * n, 2 * n)
        gamma = problem.engagement.at(np.array([t / problem.tau]))[0]
        force = c * gamma * (problem.contact_matrix @ state[:n]) / omega[:, None]
        slow = -omega[:, None] * state[:n] - 2 * (problem.damping_ratio * omega)[:, None] * state[n:]
        return np.concatenate([omega[:, None] * state[n:], slow + force]).ravel()

    start = np.eye(2 * n, dtype=complex).ravel()
    found = solve_ivp(rate, (0, times[-1]), start, method="DOP853", t_eval=times, rtol=1e-12, atol=1e-13)
    return found.y.T.reshape(len(times), 2 * n, 2 * n)


# Against problems whose answer is known ----------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_engagement_of_one_all_round_is_permanent_contact(seed):
    problem = random_problem(np.random.default_rng(seed), kappa=0.1)
    smooth = with_engagement(problem, ONE)
    found, expected = batch_multipliers([smooth]), batch_multipliers([problem])
    assert found.outside[0] == expected.outside[0]
    assert abs(found.multiplier[0] - expected.multiplier[0]) < 1e-10 * abs(expected.multiplier[0])
    here = boundaries_with_arcs([smooth], 3 * problem.ke)[0]
    there = permanent_crossings([problem], 3 * problem.ke)[0]
    assert here.proven
    assert here.ke[0] == pytest.approx(there.ke[0], rel=1e-9)
    assert here.frequency_hz[0] == pytest.approx(there.frequency_hz[0], rel=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_half_the_engagement_all_round_is_permanent_contact_of_half_the_stiffness(seed):
    problem = random_problem(np.random.default_rng(seed), kappa=0.1)
    half = batch_multipliers([with_engagement(problem, FourierEngagement(0.5))])
    soft = batch_multipliers([problem.with_ke(0.5 * problem.ke)])
    assert half.outside[0] == soft.outside[0]
    assert abs(half.multiplier[0] - soft.multiplier[0]) < 1e-10


def test_smoothed_arcs_tend_to_the_arcs():
    # Fejér's means of a Fourier series stay between the extremes of the function.
    problem, (start, end) = random_problem(np.random.default_rng(5), kappa=0.02), (0.2, 0.7)
    arc = batch_multipliers([replace(problem, **arcs_of([[start, end]]))]).multiplier[0]
    off = []
    for harmonics in (4, 16, 64):
        k = np.arange(1, harmonics + 1)
        wave = (np.exp(2j * np.pi * k * end) - np.exp(2j * np.pi * k * start)) / (2j * np.pi * k)
        wave *= 2 * (1 - k / (harmonics + 1))
        smooth = FourierEngagement(end - start, wave.real.tolist(), wave.imag.tolist())
        off.append(abs(batch_multipliers([with_engagement(problem, smooth)]).multiplier[0] - arc))
    assert off[0] > 2 * off[1] > 4 * off[2] > 0


def arcs_of(arcs: list[list[float]]) -> dict:
    contact = ContactConfiguration({"all": 1.0}, arcs)
    return {"arcs": contact.arcs, "segments": contact.segments, "engagement": None}


# Against witnesses ---------------------------------------------------------------------------------


def test_multipliers_are_those_of_collocation():
    problems = [random_smooth_problem(seed, 10 ** (-2.5 + 2.2 * seed / 19)) for seed in range(20)]
    found = batch_multipliers(problems)
    verdicts = set()
    for i, problem in enumerate(problems):
        witness = np.abs(WITNESS.multipliers(problem, 8))
        assert witness[-1] < 1
        assert found.outside[i] == (witness > 1).sum()
        assert abs(abs(found.multiplier[i]) - witness[0]) < 1e-9
        assert found.error_estimate[i] < 1e-8
        assert abs(abs(found.multiplier[i]) / witness[0] - 1) < found.error_estimate[i] + 1e-11
        verdicts.add(bool(found.outside[i]))
    assert verdicts == {True, False}


@pytest.mark.parametrize("seed", range(4))
def test_multipliers_are_those_of_semi_discretization(seed):
    problem = random_smooth_problem(seed, kappa=0.2)
    steps = int(problem.omega.max() * problem.tau)
    witness = np.abs(Gauss(steps, 5).multipliers(problem.delay_equation()))
    found = batch_multipliers([problem])
    assert found.outside[0] == (witness > 1).sum()
    assert abs(found.multiplier[0]) == pytest.approx(witness[0], abs=1e-9)


@pytest.mark.parametrize("strength", [0.5, 20.0, 400.0])
def test_fundamental_matrix_is_that_of_the_integrated_equation(strength):
    # From one panel length to panels shortened several times over.
    problem = two_mode_problem()
    motion = propagation_of([problem])
    c = strength / motion.phase_shift[0] * np.exp(1j * np.array([0.0, 2.9, np.pi]))
    motion.fundamental(np.zeros(1, dtype=int), 1e-4 * c[:1])  # what is kept of small c serves no large one
    for value, found in zip(c, motion.fundamental(np.zeros(3, dtype=int), c), strict=True):
        expected = integrated(problem, value, np.array([0.0, problem.tau]))[-1]
        assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize("seed", range(4))
def test_panels_too_long_for_their_points_say_so(monkeypatch, seed):
    problem, case = random_smooth_problem(seed, kappa=0.3), np.zeros(8, dtype=int)
    c = problem.ke * (np.exp(2j * np.pi * np.arange(8) / 8) - 1)
    exact = propagation_of([problem]).fundamental(case, c)
    monkeypatch.setattr(smooth_revolution, "_PANEL_CONTACT", 20.0)
    monkeypatch.setattr(smooth_revolution, "_WORST", np.inf)  # else they are halved
    wrong = 0
    for rad in (30.0, 100.0, 200.0, 400.0):
        monkeypatch.setattr(smooth_revolution, "_PANEL_RAD", rad)
        motion = propagation_of([problem])
        off = np.abs(motion.fundamental(case, c) - exact).max() / np.abs(exact).max()
        assert off <= motion.rounding[0] or motion.rounding[0] > 1e-3
        wrong += off > 1e-12
    assert wrong
    monkeypatch.setattr(smooth_revolution, "_WORST", 1e-11)
    halved = propagation_of([problem]).fundamental(case, c)
    assert np.abs(halved - exact).max() < 1e-11 * np.abs(exact).max()


@pytest.mark.parametrize("speed_hz", [13.0, 40.0, 230.0])
def test_chatter_frequency_is_the_largest_component_of_the_integrated_motion(speed_hz):
    problem = two_mode_problem(speed_hz=speed_hz)
    found = stability(problem)
    mu, count, n = found.multiplier, 1024, len(problem.omega)
    times = np.linspace(0.0, problem.tau, count + 1)
    motion = integrated(problem, problem.ke * (1 / mu - 1), times)
    values, vectors = np.linalg.eig(motion[-1])
    state = vectors[:, np.argmin(np.abs(values - mu))]
    contact = (motion[:-1] @ state)[:, :n] @ problem.contact_shape.T
    periodic = contact * np.exp(-np.log(mu) * np.arange(count) / count)[:, None]
    k = np.fft.fftfreq(count, 1 / count)[np.argmax(np.abs(np.fft.fft(periodic, axis=0)).sum(axis=1))]
    expected = abs(np.angle(mu) / (2 * np.pi) + k) * speed_hz
    assert found.chatter_hz == pytest.approx(expected, rel=1e-9)


def test_contact_displacement_is_that_of_the_integrated_equation():
    problem = two_mode_problem(speed_hz=13.0)
    motion, c = propagation_of([problem]), problem.ke * (-1.9 + 0.4j)
    state = np.array([1.0, 0.5j, -0.2, 0.3])
    found = motion.displacement(0, c, state)
    times = np.arange(len(found) + 1) / len(found) * problem.tau
    moved = (integrated(problem, c, times)[:-1] @ state)[:, :2] @ problem.contact_factor
    assert len(found) > 5 * problem.omega.max() * problem.tau / np.pi
    np.testing.assert_allclose(found, moved, atol=1e-8 * np.abs(moved).max())


# What must not change the answer -------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_turning_the_casing_changes_nothing(seed):
    problem = random_smooth_problem(seed, kappa=0.2)
    turned = replace(problem, engagement=problem.engagement.shifted(0.137 + 0.3 * seed))
    found = batch_multipliers([problem, turned])
    assert abs(found.multiplier[0] - found.multiplier[1]) < 1e-10
    assert found.outside[0] == found.outside[1]
    here, there = (CharacteristicEquation(p).chatter_hz(found.multiplier[0]) for p in (problem, turned))
    assert here == pytest.approx(there, rel=1e-12)


def test_signs_order_and_units_of_modes_change_nothing():
    problem = random_smooth_problem(7, kappa=0.1)
    n = len(problem.omega)
    assert n > 1
    signs, order = np.where(np.arange(n) % 2, -1.0, 1.0), np.arange(n)[::-1]
    same = [
        replace(problem, contact_shape=problem.contact_shape * signs),
        replace(
            problem,
            omega=problem.omega[order],
            damping_ratio=problem.damping_ratio[order],
            contact_shape=problem.contact_shape[::-1, order],
        ),
        replace(problem, contact_shape=10 * problem.contact_shape, ke=problem.ke / 100),
        replace(problem, omega=3 * problem.omega, speed_hz=3 * problem.speed_hz, ke=9 * problem.ke),
    ]
    found = batch_multipliers([problem, *same])
    np.testing.assert_allclose(found.multiplier, found.multiplier[0], rtol=1e-10)
    assert (found.outside == found.outside[0]).all()


def test_a_batch_of_every_kind_of_engagement_answers_as_each_alone():
    smooth, other = random_smooth_problem(3, 0.1), random_smooth_problem(8, 0.1)
    whole, part = ContactConfiguration({"all": 1.0}), ContactConfiguration({"all": 1.0}, TWO_ARCS)
    permanent = replace(smooth, engagement=None, segments=whole.segments)
    arcs = replace(smooth, engagement=None, arcs=part.arcs, segments=part.segments)
    problems = [smooth, permanent, arcs, other, smooth.with_ke(0.0)]
    together, ke_max = batch_multipliers(problems), 2 * smooth.ke
    for i, problem in enumerate(problems):
        alone = batch_multipliers([problem])
        assert together.multiplier[i] == pytest.approx(alone.multiplier[0], abs=1e-12)
        assert together.outside[i] == alone.outside[0]
    for one, crossings in zip(problems, boundaries_with_arcs(problems, ke_max), strict=True):
        np.testing.assert_allclose(crossings.ke, boundaries_with_arcs([one], ke_max)[0].ke, rtol=1e-12)


# Boundaries and verdicts ---------------------------------------------------------------------------


def test_boundary_separates_the_verdicts_of_collocation():
    crossed = 0
    for seed in range(5):
        problem = random_smooth_problem(seed, kappa=0.5)
        found = boundaries_with_arcs([problem], problem.ke)[0]
        assert found.proven
        for ke, direction in zip(found.ke, found.direction, strict=True):
            below, above = (
                np.abs(WITNESS.multipliers(problem.with_ke(ke * (1 + side)), 1))[0] > 1
                for side in (-1e-6, 1e-6)
            )
            assert (below, above) == ((False, True) if direction > 0 else (True, False))
            crossed += 1
    assert crossed >= 4


def test_front_door_answers_for_a_real_blade():
    engagement = FourierEngagement(0.5, [0.3], [0.0])
    contact = ContactConfiguration.at("LE", "TE", engagement=engagement)
    blade = example_blade("nasa_rotor_37")
    found = boundary(blade, contact, np.array([180.0, 286.5]), 2.5e4)
    assert (found.error_estimate < 1e-8).all() and np.isfinite(found.critical_ke).any()
    at = int(np.flatnonzero(np.isfinite(found.critical_ke))[0])
    speed, critical = found.speed_hz[at], found.critical_ke[at]
    verdicts = [
        stability(RubbingBlade.from_blade(blade, contact, speed, critical * side)).stable
        for side in (1 - 1e-6, 1 + 1e-6)
    ]
    assert verdicts == [True, False]


def test_too_many_vibrations_a_revolution_are_not_decided():
    found = batch_multipliers([two_mode_problem(speed_hz=0.02)])
    assert np.isnan(found.stable[0]) and np.isinf(found.error_estimate[0])


def test_without_contact_there_is_free_vibration():
    problem = two_mode_problem(ke=0.0)
    free = np.exp(-problem.damping_ratio[0] * problem.omega[0] * problem.tau)
    assert abs(batch_multipliers([problem]).multiplier[0]) == pytest.approx(free, rel=1e-12)
    unmoved = replace(problem, contact_shape=0 * problem.contact_shape).with_ke(100.0)
    assert abs(batch_multipliers([unmoved]).multiplier[0]) == pytest.approx(free, rel=1e-12)


# The engagement itself -----------------------------------------------------------------------------


def test_a_series_of_constant_one_is_permanent_contact_to_the_front_door():
    contact = ContactConfiguration({"LE": 1.0}, engagement=FourierEngagement(1.0, [0.0, 0.0]))
    assert contact.permanent and contact.engaged_fraction == 1.0
    assert RubbingBlade.from_blade(example_blade("nasa_rotor_37"), contact, 250.0, 1e3).permanent
    assert not ContactConfiguration({"LE": 1.0}, engagement=FourierEngagement(0.999)).permanent


@settings(max_examples=25)
@given(st.integers(1, MOST_HARMONICS), st.integers(0, 1000))
def test_extremes_hold_every_value(harmonics, seed):
    engagement = random_engagement(np.random.default_rng(seed), harmonics)
    low, high = engagement.extremes
    values = engagement.at(np.arange(5000) / 5000)
    assert low <= values.min() + 1e-12 and values.max() - 1e-12 <= high
    assert values.min() - low < 1e-3 and high - values.max() < 1e-3


@settings(max_examples=25)
@given(st.floats(-3, 3), st.integers(0, 1000))
def test_shifted_engagement_is_the_pattern_turned_forward(by, seed):
    engagement = random_engagement(np.random.default_rng(seed), 5)
    theta = np.arange(50) / 50
    np.testing.assert_allclose(engagement.shifted(by).at(theta), engagement.at(theta - by), atol=1e-12)


def test_contact_survives_the_wire():
    contact = ContactConfiguration({"LE": 1.0}, engagement=FourierEngagement(0.4, [0.1, -0.2], [0.0, 0.05]))
    data = json.loads(json.dumps(contact.to_dict()))
    assert data["engagement"] == {"mean": 0.4, "cosine": [0.1, -0.2], "sine": [0.0, 0.05]}
    assert ContactConfiguration.from_dict(data) == contact
    short = ContactConfiguration.from_dict({"weights": {"LE": 1}, "engagement": {"mean": 0.5, "sine": [0.1]}})
    assert short.engagement == FourierEngagement(0.5, [0.0], [0.1])


@pytest.mark.parametrize(
    ("engagement", "field", "remedy"),
    [
        (0.5, "contact.engagement", "object"),
        ({}, "contact.engagement.mean", "mean"),
        ({"mean": 0.5, "cos": [0.1]}, "contact.engagement.cos", "leave it out"),
        ({"mean": 0.0}, "contact.engagement.mean", "above 0"),
        ({"mean": 1.5}, "contact.engagement.mean", "up to 1"),
        ({"mean": float("nan")}, "contact.engagement.mean", "finite"),
        ({"mean": "half"}, "contact.engagement.mean", "finite number"),
        ({"mean": 0.5, "cosine": 0.1}, "contact.engagement.cosine", "list"),
        ({"mean": 0.5, "cosine": {"1": 0.1}}, "contact.engagement.cosine", "list"),
        ({"mean": 0.5, "cosine": [0.1, float("inf")]}, "contact.engagement.cosine[1]", "finite"),
        ({"mean": 0.5, "sine": [True]}, "contact.engagement.sine[0]", "finite"),
        ({"mean": 0.5, "cosine": [0.1, 0.1], "sine": [0.1]}, "contact.engagement.sine", "give 2"),
        ({"mean": 0.5, "cosine": [0.0] * 65}, "contact.engagement.cosine", "at most 64"),
        ({"mean": 0.3, "cosine": [0.4]}, "contact.engagement", "γ ≥ 0"),
        ({"mean": 0.7, "cosine": [0.3], "sine": [0.3]}, "contact.engagement", "multiply ke"),
    ],
)
def test_unusable_engagement_is_refused_with_a_remedy(engagement, field, remedy):
    with pytest.raises(InvalidInput) as refused:
        ContactConfiguration.from_dict({"weights": {"LE": 1.0}, "engagement": engagement})
    assert refused.value.field == field
    assert remedy in refused.value.remedy


def test_arcs_and_engagement_together_are_refused():
    with pytest.raises(InvalidInput, match=r"contact\.engagement.*not both"):
        ContactConfiguration.from_dict(
            {"weights": {"LE": 1.0}, "arcs": [[0.0, 0.5]], "engagement": {"mean": 0.5}}
        )

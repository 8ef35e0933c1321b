"""Derivatives of multipliers and of the critical K_e: against perturbed solutions and the physics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from named_problems import random_problem
from scipy.optimize import fsolve

from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.blade_sensitivity import critical_ke_sensitivities, growth_sensitivities
from sdm_core.boundary import boundary
from sdm_core.collocation import Collocation
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.floquet.arc_boundary import least_destabilising_ke
from sdm_core.floquet.arc_propagation import ArcPropagation
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.floquet.characteristic import CharacteristicEquation
from sdm_core.permanent_contact.permanent_boundary import permanent_crossings
from sdm_core.rubbing_blade import RubbingBlade, single_state_problem
from sdm_core.sensitivity import (
    Gradient,
    chatter_hz_gradient,
    critical_ke_sensitivity,
    multiplier_sensitivity,
)
from sdm_core.stability import stability

CASES = 100
TWO_ARCS = [[0.1, 0.3], [0.55, 0.8]]
STEPS = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
CENTRAL = np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60  # sixth order
NOISE = 1e-12  # of ln μ and ln K_e as solved


@dataclass(frozen=True)
class Parameters:
    """What a blade with one state is made of."""

    frequency: np.ndarray
    damping: np.ndarray
    shape: np.ndarray
    weights: np.ndarray
    speed: np.ndarray
    ke: np.ndarray
    arcs: np.ndarray  # empty in permanent contact

    @property
    def problem(self) -> RubbingBlade:
        return single_state_problem(
            self.frequency,
            self.damping,
            self.shape,
            self.weights,
            float(self.speed),
            float(self.ke),
            self.arcs.tolist() or None,
        )

    def scaled(self, name: str, entry: tuple[int, ...], factor: float) -> Parameters:
        """With one entry of one parameter multiplied."""
        table = np.array(getattr(self, name))
        table[entry] *= factor
        return replace(self, **{name: table})

    def logarithmic(self, gradient: Gradient) -> dict[str, np.ndarray]:
        """Derivatives d/d ln p by name, each of the parameter's shape."""
        by = {
            "frequency": 2 * np.pi * gradient.omega,
            "damping": gradient.damping_ratio,
            "shape": gradient.mode_shape(self.shape, self.weights),
            "weights": gradient.weights(self.shape),
            "speed": gradient.speed_hz,
            "ke": gradient.ke,
            "arcs": gradient.arcs,
        }
        return {name: derivative * getattr(self, name) for name, derivative in by.items()}


def random_parameters(seed: int) -> Parameters:
    """1 to 5 modes at 1 to 9 nodes, in permanent contact or, with an odd seed, 1 to 3 arcs."""
    rng = np.random.default_rng(seed)
    n, r = int(rng.integers(1, 6)), int(rng.integers(1, 10))
    frequency = 100.0 * np.cumprod(np.r_[1.0, rng.uniform(1.3, 2.5, n - 1)])
    shape, weights = rng.normal(size=(n, r)) * rng.uniform(1.0, 8.0, (n, 1)), rng.uniform(0.3, 1.0, r)
    arcs = int(rng.integers(1, 4))
    edges = rng.dirichlet(np.full(2 * arcs + 1, 2.0)).cumsum()[:-1].reshape(-1, 2)
    ke = 10 ** rng.uniform(-2, -0.5) / ((shape**2 @ weights) / (2 * np.pi * frequency) ** 2).max()
    return Parameters(
        frequency,
        10 ** rng.uniform(-3.3, -2.0, n),
        shape,
        weights,
        np.array(100.0 * rng.uniform(0.15, 0.8)),
        np.array(ke),
        edges if seed % 2 else np.zeros((0, 2)),
    )


def determinant(motion: ArcPropagation, ke: np.ndarray, x: np.ndarray) -> np.ndarray:
    """det(I − M(μ)/μ) of each problem at its own ln μ = x."""
    m = motion.fundamental(np.arange(len(x)), ke * np.expm1(-x))
    return np.linalg.det(np.eye(motion.size) - m * np.exp(-x)[:, None, None])


def followed_multipliers(problems: list[RubbingBlade], log_mu: complex) -> np.ndarray:
    """ln μ of each problem by Newton's method from one start."""
    motion, ke = ArcPropagation.of(problems), np.array([p.ke for p in problems])
    x, h = np.full(len(problems), log_mu), 1e-5
    for _ in range(8):
        slope = (determinant(motion, ke, x + h) - determinant(motion, ke, x - h)) / (2 * h)
        step = -determinant(motion, ke, x) / slope
        x = x + step
        if (np.abs(step) < 1e-8).all():  # its square is noise
            break
    assert (np.abs(step) < 1e-8).all()
    return x


def followed_crossings(problems: list[RubbingBlade], angle: float, ke: float) -> np.ndarray:
    """arg μ and ln K_e of each problem's multiplier on the circle, by Newton's method; shape (2, k)."""
    motion = ArcPropagation.of(problems)
    at, h = np.repeat([[angle], [np.log(ke)]], len(problems), axis=1), 1e-5

    def f(shift: tuple[float, float]) -> np.ndarray:
        z = at + np.array(shift)[:, None]
        return determinant(motion, np.exp(z[1]), 1j * z[0])

    for _ in range(12):
        by_angle, by_ke = (f((h, 0)) - f((-h, 0))) / (2 * h), (f((0, h)) - f((0, -h))) / (2 * h)
        cross = (np.conj(by_angle) * by_ke).imag
        value = f((0, 0))
        step = np.array([-(np.conj(by_ke) * value).imag, (np.conj(by_angle) * value).imag]) / -cross
        at = at + np.clip(step, -0.1, 0.1)
        if (np.abs(step) < 1e-8).all():
            break
    assert (np.abs(step) < 1e-8).all()
    return at


def errors(
    parameters: Parameters,
    gradient: dict[str, np.ndarray],
    solved: Callable[[list[RubbingBlade]], np.ndarray],
    rng: np.random.Generator,
    part: Callable[[np.ndarray], np.ndarray] = np.asarray,
) -> np.ndarray:
    """Relative errors of d/d ln p against central differences, at up to three entries a parameter.

    Left out are entries whose effect drowns in the noise of what they are compared with: those
    must only be as small as the differences say. `part` is what is compared of either.
    """
    turns = 2 * np.pi * parameters.frequency[-1] / float(parameters.speed)
    entries, sizes, problems = [], [], []
    for name, table in gradient.items():
        if np.isnan(table).all():
            continue
        for flat in rng.permutation(table.size)[:3]:
            entry = tuple(int(i) for i in np.unravel_index(flat, table.shape))
            largest = 2e-4 / turns if name in ("frequency", "speed", "arcs") else 5e-3
            size = min(largest, 2e-3 / (abs(table[entry]) + 1e-300))
            entries.append(table[entry])
            sizes.append(size)
            problems += [parameters.scaled(name, entry, 1 + size * step).problem for step in STEPS]
    exact, size = part(np.array(entries)), np.array(sizes)
    difference = part(solved(problems)).reshape(-1, len(STEPS)) @ CENTRAL / size
    error = np.abs(difference - exact)
    heard = np.abs(exact) * size > 1e5 * NOISE
    assert (error[~heard] * size[~heard] < 10 * NOISE).all()
    return error[heard] / np.abs(exact[heard])


def crossing_of(parameters: Parameters) -> tuple[float, complex]:
    """A K_e at which a multiplier crosses the circle, and that multiplier."""
    problem = parameters.problem
    if problem.permanent:
        found = permanent_crossings([problem], 100 * problem.ke)[0]
        return float(found.ke[0]), complex(np.exp(2j * np.pi * found.frequency_hz[0] / problem.speed_hz))
    low, high = least_destabilising_ke(problem), 100 * problem.ke
    for _ in range(3):
        grid = np.geomspace(low, high, 17)
        multiplier = batch_multipliers([problem.with_ke(k) for k in grid]).multiplier
        i = int(np.argmax(np.abs(multiplier) > 1))
        low, high = grid[i - 1], grid[i]
    angle, log_ke = followed_crossings([problem], float(np.angle(multiplier[i])), float(high))[:, 0]
    return float(np.exp(log_ke)), complex(np.exp(1j * angle))


def multiplier_errors(seed: int) -> np.ndarray:
    parameters = random_parameters(seed)
    problem = parameters.problem
    found = multiplier_sensitivity(problem, stability(problem).multiplier)
    assert found.simple
    start = complex(np.log(found.multiplier))
    return errors(
        parameters,
        parameters.logarithmic(found.log_multiplier),
        lambda problems: followed_multipliers(problems, start),
        np.random.default_rng(seed),
    )


def critical_ke_errors(seed: int, part: Callable[[np.ndarray], np.ndarray] = np.real) -> np.ndarray:
    """Of ln K_e, or as imaginary part of arg μ, along the boundary."""
    parameters = random_parameters(seed)
    ke, mu = crossing_of(parameters)
    parameters = replace(parameters, ke=np.array(ke))
    found = critical_ke_sensitivity(parameters.problem, mu)
    assert found.simple
    both = found.critical_ke.mapped(lambda k, a: k / ke + 1j * a, found.angle)
    return errors(
        parameters,
        parameters.logarithmic(both),
        lambda problems: followed_crossings(problems, float(np.angle(mu)), ke).T @ [1j, 1.0],
        np.random.default_rng(seed),
        part,
    )


def test_derivatives_of_the_dominant_multiplier_of_a_hundred_blades_agree_with_differences():
    found = np.concatenate([multiplier_errors(seed) for seed in range(CASES)])
    assert len(found) > 900
    assert found.max() < 1e-5


def test_derivatives_of_the_critical_stiffness_of_a_hundred_blades_agree_with_differences():
    found = np.concatenate([critical_ke_errors(seed) for seed in range(CASES)])
    assert len(found) > 900
    assert found.max() < 1e-5


def test_derivatives_of_the_chatter_angle_along_the_boundary_agree_with_differences():
    found = np.concatenate([critical_ke_errors(seed, np.imag) for seed in range(0, CASES, 5)])
    assert len(found) > 50
    assert found.max() < 1e-5


@pytest.mark.parametrize("seed", range(0, 12, 2))
def test_critical_stiffness_in_permanent_contact_moves_as_the_closed_form_does(seed):
    # The closed form knows nothing of the matrix exponentials that the derivatives come from.
    parameters = random_parameters(seed)
    ke, mu = crossing_of(parameters)
    parameters = replace(parameters, ke=np.array(ke))
    found = critical_ke_sensitivity(parameters.problem, mu)

    def solved(problems: list[RubbingBlade]) -> np.ndarray:
        crossings = permanent_crossings(problems, 1.1 * ke)
        return np.array([np.log(c.ke[np.argmin(np.abs(c.ke - ke))]) for c in crossings])

    logarithmic = parameters.logarithmic(found.critical_ke.mapped(lambda d: d / ke))
    assert errors(parameters, logarithmic, solved, np.random.default_rng(seed)).max() < 1e-5


@pytest.mark.parametrize("damping", [1e-3, 0.02, 0.3])
def test_at_the_worst_speed_one_mode_needs_two_xi_times_one_plus_xi_and_so_do_its_derivatives(damping):
    # K_e = 2ξ(1 + ξ)ω²/G is the smallest over all speeds: there dK_e/dΩ = 0, and the others follow.
    omega, gain = 2 * np.pi * 120.0, 4.0**2 * 0.7
    chatter = omega * np.sqrt(1 + 2 * damping)
    turns = 2 - np.arctan2(np.sqrt(1 + 2 * damping), damping) / (2 * np.pi)
    speed = chatter / (2 * np.pi * turns)
    ke = 2 * damping * (1 + damping) * omega**2 / gain
    problem = single_state_problem([120.0], [damping], [[4.0]], [0.7], speed, ke)
    found = critical_ke_sensitivity(problem, np.exp(1j * chatter / speed))
    by = found.critical_ke
    assert by.damping_ratio[0] == pytest.approx((2 + 4 * damping) * omega**2 / gain, rel=1e-8)
    assert by.omega[0] == pytest.approx(2 * ke / omega, rel=1e-8)
    assert by.contact_matrix[0, 0] == pytest.approx(-ke / gain, rel=1e-8)
    assert abs(by.speed_hz) < 1e-7 * ke / speed
    assert found.growth_per_log_ke > 0


@pytest.mark.parametrize("seed", [0, 4, 6, 1, 3, 5])
def test_scaling_the_blade_gives_sum_rules(seed):
    parameters = random_parameters(seed)
    ke, mu = crossing_of(parameters)
    parameters = replace(parameters, ke=np.array(ke))
    by = critical_ke_sensitivity(parameters.problem, mu).critical_ke
    log = parameters.logarithmic(by.mapped(lambda d: d / ke))
    assert log["shape"].sum() == pytest.approx(-2, rel=1e-9)
    assert log["weights"].sum() == pytest.approx(-1, rel=1e-9)
    assert log["frequency"].sum() + log["speed"] == pytest.approx(2, rel=1e-8)
    # Turning the casing changes nothing.
    assert abs(by.arcs.sum()) <= 1e-9 * np.abs(by.arcs).sum()
    # Time only comes in ratios, so that K_e ω⁻² G is what a multiplier knows.
    log = parameters.logarithmic(multiplier_sensitivity(parameters.problem, mu).log_multiplier)
    assert abs(log["frequency"].sum() + log["speed"] + 2 * log["ke"]) < 1e-9 * abs(log["speed"])
    assert log["shape"].sum() == pytest.approx(2 * log["ke"], rel=1e-9)


def test_first_order_effect_of_a_light_contact_on_one_mode():
    # λ ≈ λ₀ + K_e G (e^{−λ₀τ} − 1)/(2iω_d) for the root λ₀ = −ξω + iω_d without contact.
    problem = single_state_problem([100.0], [0.01], [[3.0]], [1.0], 37.0, 0.0)
    omega = 2 * np.pi * 100.0
    damped = omega * np.sqrt(1 - 1e-4)
    root = -0.01 * omega + 1j * damped
    found = multiplier_sensitivity(problem, np.exp(root / 37.0))
    expected = 9.0 * np.expm1(-root / 37.0) / (2j * damped) / 37.0
    assert complex(found.log_multiplier.ke) == pytest.approx(expected, rel=1e-10)
    assert found.growth.damping_ratio[0] == pytest.approx(-omega / 37.0, rel=1e-10)
    assert complex(found.multiplier_gradient.ke) == pytest.approx(expected * found.multiplier, rel=1e-10)


@pytest.mark.parametrize("arcs", [None, TWO_ARCS], ids=["permanent", "arcs"])
def test_chatter_frequency_moves_as_its_derivative_says(arcs):
    problem = random_problem(np.random.default_rng(5), arcs)
    solution = stability(problem)
    found = multiplier_sensitivity(problem, solution.multiplier)
    by = chatter_hz_gradient(found.angle, found.multiplier, solution.chatter_hz, problem.speed_hz)
    for name, derivative in (("speed_hz", by.speed_hz), ("ke", by.ke)):
        value = getattr(problem, name)
        high, low = (stability(replace(problem, **{name: value * (1 + h)})).chatter_hz for h in (1e-5, -1e-5))
        assert (high - low) / (2e-5 * value) == pytest.approx(float(derivative), rel=1e-4, abs=1e-9)


def damped(problem: RubbingBlade, damping: np.ndarray) -> RubbingBlade:
    """The same with other damping ratios, also those that no blade may have."""
    return replace(problem, damping_ratio=damping)


def test_a_double_multiplier_is_flagged_and_has_no_derivatives():
    twins = single_state_problem([100.0, 100.0], [0.01, 0.01], [[2.0], [0.0]], [1.0], 37.0, 0.0)
    root = 2 * np.pi * 100.0 * (-0.01 + 1j * np.sqrt(1 - 1e-4))
    found = multiplier_sensitivity(twins, np.exp(root / 37.0))
    assert not found.simple
    assert found.condition > 1e7
    assert np.isnan(found.growth.omega).all()
    # Critical damping: two equal roots with one eigenvector, the exponential's defective case.
    critical = damped(single_state_problem([100.0], [0.5], [[2.0]], [1.0], 370.0, 0.0), np.ones(1))
    assert not multiplier_sensitivity(critical, np.exp(-2 * np.pi * 100.0 / 370.0)).simple


def test_a_double_multiplier_is_flagged_also_when_approached_from_afar():
    critical = damped(single_state_problem([100.0], [0.5], [[2.0]], [1.0], 370.0, 0.0), np.ones(1))
    found = multiplier_sensitivity(critical, np.exp(-2 * np.pi * 100.0 / 370.0) * (1 + 5e-4))
    assert not found.simple


@pytest.mark.parametrize(("speed", "half_turns"), [(42.0, 5), (68.0, 3), (205.0, 1)])
def test_a_negative_multiplier_in_permanent_contact_is_two_that_pass_through_one_another(speed, half_turns):
    # Of λ = −ξω + iπk/τ and its conjugate μ is the same, and c real: the oscillator's frequency is kΩ/2.
    omega, damping = 2 * np.pi * 100.0, 0.01
    radius = np.exp(-damping * omega / speed)
    stiffening = (np.pi * half_turns * speed) ** 2 - (1 - damping**2) * omega**2
    problem = single_state_problem(
        [100.0], [damping], [[5.0]], [1.0], speed, stiffening / (25 * (1 + 1 / radius))
    )
    pencil = np.eye(2) + CharacteristicEquation(problem).fundamental(np.array([-radius]))[0] / radius
    assert np.linalg.svd(pencil)[1].max() < 1e-12  # both singular values
    assert Collocation(48).multipliers(problem, 2) == pytest.approx([-radius, -radius], rel=1e-9)
    found = multiplier_sensitivity(problem, -radius)
    assert not found.simple and np.isnan(found.growth.omega).all()
    before, after = (
        multiplier_sensitivity(
            replace(problem, speed_hz=speed * (1 + h)), -radius * np.exp(1j * np.pi * half_turns * h)
        )
        for h in (-1e-6, 1e-6)
    )
    assert before.simple and after.simple
    assert before.multiplier.imag * after.multiplier.imag < 0
    for name in ("omega", "damping_ratio", "contact_matrix", "speed_hz"):
        left, right = (getattr(f.growth, name) for f in (before, after))
        np.testing.assert_allclose(left, right, rtol=1e-3)


def test_where_the_boundary_only_touches_there_is_no_critical_stiffness_to_follow():
    # A flip whose |μ| first rises and then falls with K_e; so much damping that it just reaches −1.
    def problem(log_ke: float, damping: float) -> RubbingBlade:
        return single_state_problem(
            [100.0], [damping], [[1.78]], [1.0], 71.35, np.exp(log_ke), [[0.01, 0.13]]
        )

    def offsets(x: np.ndarray) -> list[float]:
        found = multiplier_sensitivity(problem(*x), stability(problem(*x)).multiplier)
        return [np.log(abs(found.multiplier)), np.exp(x[0]) * float(found.growth.ke)]

    touch = fsolve(offsets, [np.log(1.6e5), 0.07], xtol=1e-12)
    assert np.abs(offsets(touch)).max() < 1e-9
    found = critical_ke_sensitivity(problem(*touch), -1.0)
    assert abs(found.growth_per_log_ke) < 1e-9
    assert not found.simple
    assert np.isnan(found.critical_ke.omega).all()


@pytest.mark.parametrize("arcs", [None, TWO_ARCS], ids=["permanent", "arcs"])
def test_three_digits_of_a_multiplier_are_enough(arcs):
    problem = random_problem(np.random.default_rng(3), arcs)
    mu = stability(problem).multiplier
    rough = multiplier_sensitivity(problem, mu * np.exp(4e-4 - 3e-4j))
    exact = multiplier_sensitivity(problem, mu)
    assert rough.multiplier == pytest.approx(mu, rel=1e-12)
    np.testing.assert_allclose(rough.growth.omega, exact.growth.omega, rtol=1e-9, atol=1e-18)


def test_a_defective_coefficient_matrix_with_a_simple_multiplier_is_no_exception():
    # The first mode is critically damped: its free motion has one eigenvector; the second one chatters.
    frequency, damping = np.array([100.0, 260.0]), np.array([1.0, 2e-3])
    shape = np.array([[1.0], [3.0]])

    def problem(damping: np.ndarray) -> RubbingBlade:
        return damped(single_state_problem(frequency, np.full(2, 0.5), shape, np.ones(1), 70.0, 2e3), damping)

    found = multiplier_sensitivity(problem(damping), stability(problem(damping)).multiplier)
    moved = [problem(damping + np.array([h * 1e-3, 0.0])) for h in STEPS]
    difference = followed_multipliers(moved, complex(np.log(found.multiplier))) @ CENTRAL / 1e-3
    assert found.simple
    assert complex(found.log_multiplier.damping_ratio[0]) == pytest.approx(difference, rel=1e-5)


@pytest.mark.parametrize("seed", [4, 5])
def test_signs_of_modes_turn_the_signs_of_their_amplitudes_only(seed):
    parameters = random_parameters(seed)
    n = len(parameters.frequency)
    sign = np.where(np.arange(n) % 2, 1.0, -1.0)
    turned = replace(parameters, shape=parameters.shape * sign[:, None])
    mu = stability(parameters.problem).multiplier
    here, there = (multiplier_sensitivity(p.problem, mu).growth for p in (parameters, turned))
    np.testing.assert_allclose(here.omega, there.omega, rtol=1e-8, atol=1e-14)
    np.testing.assert_allclose(
        here.mode_shape(parameters.shape, parameters.weights) * sign[:, None],
        there.mode_shape(turned.shape, turned.weights),
        rtol=1e-7,
        atol=1e-12,
    )


def stiffening_blade() -> Blade:
    states = [
        ModalState(s, [100.0 + 2e-3 * s**2, 340.0 + 1e-3 * s**2], [[5.0, 3.0 + 5e-3 * s], [-2.0, 4.0]])
        for s in (0.0, 40.0, 80.0)
    ]
    return Blade("stiffening", ("LE", "TE"), 2e-3, states)


@pytest.mark.parametrize(
    ("blade", "contact", "speed", "ke_max"),
    [
        (stiffening_blade(), ContactConfiguration.at("LE", "TE"), 52.0, 1e5),
        (stiffening_blade(), ContactConfiguration.at("LE", arcs=TWO_ARCS), 61.0, 1e5),
        (example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), 250.0, 1e5),
    ],
    ids=["permanent", "arcs", "rotor 37"],
)
def test_speed_moves_the_boundary_also_through_the_blade_s_own_modes(blade, contact, speed, ke_max):
    found = critical_ke_sensitivities(blade, contact, speed, ke_max)
    h = 1e-6 * speed
    low, high = boundary(blade, contact, speed + h * np.array([-1.0, 1.0]), 1.1 * found.value).critical_ke
    by_speed = next(i for i in found.influences if i.parameter == "rotor speed")
    assert by_speed.derivative == pytest.approx((high - low) / (2 * h), rel=1e-5)
    frozen = next(i for i in found.influences if i.parameter == "rotor speed, modal data frozen")
    assert abs(frozen.derivative - by_speed.derivative) > 1e-3 * abs(by_speed.derivative)
    assert found.value == pytest.approx(0.5 * (low + high), rel=1e-5)


def test_influences_name_every_parameter_of_the_blade_once():
    blade, contact = stiffening_blade(), ContactConfiguration.at("LE", arcs=TWO_ARCS)
    found = growth_sensitivities(blade, contact, 60.0, 2e3)
    names = [influence.parameter for influence in found.influences]
    assert len(set(names)) == len(names) == 2 * (1 + 1 + 2) + 2 + 2 + 4 + 1
    assert {"damping of mode 2", "amplitude of mode 1 at TE", "weight of TE", "end of arc 2"} <= set(names)
    by = {influence.parameter: influence for influence in found.influences}
    assert by["weight of LE"].relative == pytest.approx(by["cutting stiffness"].relative, rel=1e-9)
    assert by["weight of TE"].derivative != 0  # what that node would do if it came into contact
    assert by["amplitude of mode 1 at TE"].derivative == 0
    assert found.value == stability(RubbingBlade.from_blade(blade, contact, 60.0, 2e3)).growth_per_revolution


@pytest.mark.parametrize(
    ("multiplier", "remedy"),
    [
        (1.5 + 0.2j, "stability"),
        (0.0, "other than 0"),
        (complex("nan"), "other than 0"),
        ("large", "other than 0"),
        (1e-9, "give a larger one"),
    ],
)
def test_what_is_no_multiplier_is_refused(multiplier, remedy):
    problem = random_problem(np.random.default_rng(0))
    with pytest.raises(InvalidInput, match=remedy) as refused:
        multiplier_sensitivity(problem, multiplier)
    assert refused.value.field == "multiplier"


def test_without_segments_of_constant_engagement_there_is_an_error_and_no_derivative():
    smooth = replace(random_problem(np.random.default_rng(0)), segments=())
    with pytest.raises(InvalidInput, match="give arcs") as refused:
        multiplier_sensitivity(smooth, 1.0)
    assert refused.value.field == "contact.engagement"


def test_a_stiffness_that_is_not_critical_is_refused():
    problem = random_problem(np.random.default_rng(0))
    with pytest.raises(InvalidInput, match=r"give a critical one: here \|μ\| = ") as refused:
        critical_ke_sensitivity(problem, stability(problem).multiplier)
    assert refused.value.field == "ke"
    with pytest.raises(InvalidInput, match="above 0") as refused:
        critical_ke_sensitivity(problem.with_ke(0.0), 1.0)
    assert (refused.value.field, refused.value.value) == ("ke", "0.0")


def test_without_a_crossing_the_remedy_is_a_larger_stiffness():
    with pytest.raises(InvalidInput, match="raise it: no crossing up to there at 52 Hz") as refused:
        critical_ke_sensitivities(stiffening_blade(), ContactConfiguration.at("LE"), 52.0, 1e-3)
    assert refused.value.field == "ke_max"

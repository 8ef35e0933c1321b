"""Boundaries with arcs of contact: every edge of every unstable interval, narrow ones too, and exactly."""

from __future__ import annotations

import numpy as np
import pytest

from sdm_core.blade import Blade, ModalState
from sdm_core.boundary import boundary, verdicts
from sdm_core.collocation import Collocation
from sdm_core.contact import ContactConfiguration
from sdm_core.crossings import Crossings
from sdm_core.errors import Cancelled
from sdm_core.floquet.arc_boundary import boundaries_with_arcs
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.floquet.characteristic import CharacteristicEquation
from sdm_core.interruption import interruptible
from sdm_core.rubbing_blade import RubbingBlade, single_state_problem

BLADES = 15
KE_MAX = 1.0  # of blades scaled so that this is κ = 1


def random_blade(rng: np.random.Generator) -> RubbingBlade:
    """One to five modes, one to four arcs; the softest mode has G_jj = ω_j²."""
    n, r = int(rng.integers(1, 6)), int(rng.integers(1, 4))
    frequency = 100.0 * np.cumprod(np.r_[1.0, rng.uniform(1.05, 4.5, n - 1)])
    shape = rng.normal(size=(n, r)) * 10 ** rng.uniform(0.0, 1.5, (n, 1))
    shape /= np.sqrt(((shape**2).sum(axis=1) / (2 * np.pi * frequency) ** 2).max())
    damping = np.exp(rng.uniform(np.log(2e-4), np.log(1e-2)) + rng.uniform(-0.3, 0.3, n))
    speed = 100.0 * np.exp(rng.uniform(np.log(0.05), np.log(0.8)))
    arcs, engaged = int(rng.integers(1, 5)), rng.uniform(0.05, 0.8)
    lengths, gaps = rng.dirichlet(np.ones(arcs)) * engaged, rng.dirichlet(np.ones(arcs)) * (1 - engaged)
    start = np.cumsum(np.r_[0.0, (lengths + gaps)[:-1]])
    return single_state_problem(
        frequency, damping, shape, np.ones(r), speed, 0.0, np.c_[start, start + lengths].tolist()
    )


def random_blades(seed: int) -> list[RubbingBlade]:
    rng = np.random.default_rng(seed)
    return [random_blade(rng) for _ in range(BLADES)]


def verdicts_of(problem: RubbingBlade, ke: np.ndarray) -> np.ndarray:
    return batch_multipliers([problem.with_ke(float(k)) for k in ke], dominant=False).stable


def inside(intervals: tuple[tuple[float, float], ...], ke: np.ndarray) -> np.ndarray:
    return np.any([(low < ke) & (ke <= high) for low, high in intervals] or [np.zeros(len(ke), bool)], axis=0)


def multipliers_at(problem: RubbingBlade, found: Crossings) -> np.ndarray:
    return np.exp(2j * np.pi * found.frequency_hz / problem.speed_hz)


def crossing_near(problem: RubbingBlade, ke: float, mu: complex) -> tuple[float, float]:
    """ln K_e and arg μ of the zero of det(I − M(μ)/μ) on the circle, by Newton's method."""
    at, h = np.array([np.log(ke), np.angle(mu)]), 1e-5

    def value(x: float, angle: float) -> complex:
        return complex(CharacteristicEquation(problem.with_ke(np.exp(x))).value(np.exp(1j * angle))[0])

    for _ in range(6):
        f = value(*at)
        slopes = [
            (value(*(at + step)) - value(*(at - step))) / (2 * h)
            for step in (np.array([h, 0]), np.array([0, h]))
        ]
        rows = np.array([[s.real for s in slopes], [s.imag for s in slopes]])
        at = at - np.linalg.solve(rows, [f.real, f.imag])
    return float(at[0]), float(at[1])


@pytest.fixture(scope="module")
def solved() -> list[tuple[RubbingBlade, Crossings]]:
    """Blades of every number of modes and of arcs, and one with a second unstable interval."""
    problems = random_blades(7)
    found = boundaries_with_arcs(problems, KE_MAX)
    assert {len(p.omega) for p in problems} == {1, 2, 3, 4, 5}
    assert {len(p.arcs or ()) for p in problems} == {1, 2, 3, 4}
    assert {len(f.ke) for f in found} == {1, 3}
    return list(zip(problems, found, strict=True))


def test_verdicts_of_random_blades_agree_with_their_unstable_intervals(solved):
    rng = np.random.default_rng(1)
    for problem, found in solved:
        assert found.proven
        intervals = found.unstable_intervals(KE_MAX)
        beside = np.concatenate([found.ke * (1 - 1e-6), found.ke * (1 + 1e-6)])
        ke = np.r_[KE_MAX * 10 ** rng.uniform(-3, 0, 12), beside]
        np.testing.assert_array_equal(verdicts_of(problem, ke), np.where(inside(intervals, ke), 0.0, 1.0))


def test_crossings_of_random_blades_lie_on_the_circle_and_as_near_as_they_say(solved):
    errors = []
    for problem, found in solved:
        for ke, mu, error in zip(found.ke, multipliers_at(problem, found), found.error_estimate, strict=True):
            equation = CharacteristicEquation(problem.with_ke(float(ke)))
            assert abs(equation.dominant()[0]) == pytest.approx(1.0, abs=1e-9)
            log_ke, angle = crossing_near(problem, ke, mu)
            assert abs(np.exp(1j * angle) - mu) < 1e-9
            errors.append((abs(log_ke - np.log(ke)), error))
    actual, estimate = np.array(errors).T
    assert np.median(estimate) < 1e-11
    assert (actual < 3 * estimate + 1e-12).all()  # the reference's own rounding


# One mode, and two of which the second hardly takes part.
ISLANDS = [
    pytest.param(
        single_state_problem([100.0], [2.8e-4], [[1.0]], [1.0], 22.91, 0.0, [[0.0, 0.168], [0.273, 0.886]]),
        3e4,
        [(15853.86, 16067.42), (16308.21, 3e4)],
        id="islands of 1.3 % in K_e, a gap of 1.5 %",
    ),
    pytest.param(
        single_state_problem(
            [100.0, 290.3],
            [5.2e-4, 5.2e-4],
            [[6.283, 0.0], [0.128, 1.11]],
            [1.0, 1.0],
            12.31,
            0.0,
            [[0.0, 0.5607]],
        ),
        2e3,
        [(853.044, 868.144), (869.334, 2e3)],
        id="an island of 1.8 %, a gap of 0.14 %",
    ),
]


@pytest.mark.parametrize(("problem", "ke_max", "expected"), ISLANDS)
def test_narrow_islands_of_instability_are_found_with_all_their_edges(problem, ke_max, expected):
    found = boundaries_with_arcs([problem], ke_max)[0]
    assert found.proven
    intervals = found.unstable_intervals(ke_max)
    np.testing.assert_allclose(intervals, expected, rtol=1e-6)
    # The island is there: verdicts every 0.02 % of K_e, and every 2 % elsewhere.
    low, high = intervals[0]
    gap = intervals[1][0]
    ke = np.r_[
        np.geomspace(0.05 * low, 0.95 * low, 150),
        np.geomspace(0.95 * low, 1.05 * gap, 700),
        np.geomspace(1.05 * gap, ke_max, 30),
    ]
    np.testing.assert_array_equal(verdicts_of(problem, ke), np.where(inside(intervals, ke), 0.0, 1.0))
    for middle, unstable in ((np.sqrt(low * high), True), (np.sqrt(high * gap), False)):
        reference = Collocation().multipliers(problem.with_ke(float(middle)), 1)[0]
        assert (abs(reference) > 1) == unstable
        assert reference.real < 0 and (reference.imag == 0 or not unstable)


@pytest.mark.parametrize(("problem", "ke_max", "expected"), ISLANDS)
def test_at_a_flip_the_blade_chatters_at_an_odd_multiple_of_half_the_rotor_speed(problem, ke_max, expected):
    found = boundaries_with_arcs([problem], ke_max)[0]
    halves = 2 * found.frequency_hz / problem.speed_hz
    flip = np.abs(multipliers_at(problem, found) + 1) < 1e-9
    assert flip.tolist() == [True, True, False]
    assert halves[flip] == pytest.approx(np.round(halves[flip]), abs=1e-9)
    assert (np.round(halves[flip]) % 2 == 1).all()
    for ke in found.ke[flip]:
        assert CharacteristicEquation(problem.with_ke(float(ke))).value(-1.0)[0] == pytest.approx(0, abs=1e-9)


def test_a_batch_gives_what_each_blade_gives_alone():
    problems = random_blades(3)[:8]
    for problem, found in zip(problems, boundaries_with_arcs(problems, KE_MAX), strict=True):
        alone = boundaries_with_arcs([problem], KE_MAX)[0]
        np.testing.assert_allclose(found.ke, alone.ke, rtol=1e-11)
        np.testing.assert_allclose(found.frequency_hz, alone.frequency_hz, rtol=1e-11)
        np.testing.assert_array_equal(found.direction, alone.direction)
        assert found.proven and alone.proven


def test_progress_is_reported_and_a_batch_can_be_stopped():
    problems = random_blades(0)[:6]
    seen: list[tuple[int, int]] = []
    boundaries_with_arcs(problems, 0.01, progress=lambda done, of: seen.append((done, of)))
    assert len(seen) > 1 and seen == sorted(seen) and seen[-1] == (6, 6)
    passed = 0

    def stop() -> None:
        nonlocal passed
        passed += 1
        if passed == 10:
            raise Cancelled("enough")

    with interruptible(stop), pytest.raises(Cancelled):
        boundaries_with_arcs(problems, 0.01, workers=1)
    assert passed == 10


def test_a_second_multiplier_that_leaves_just_above_does_not_cost_the_proof():
    # Two multipliers leave at −1, 12 % apart in K_e, between the same two samples.
    problem = single_state_problem(
        [100.0, 229.573, 736.886],
        [5.17e-4, 5.45e-4, 5.5e-4],
        [[-378.3], [1442.45], [95.8]],
        [1.0],
        24.6232,
        0.0,
        [[0.0, 0.11067], [0.12552, 0.30769], [0.46358, 0.46806], [0.51442, 0.51667]],
    )
    count = [CharacteristicEquation(problem.with_ke(k)).count_outside() for k in (0.0609, 0.0610, 0.0684)]
    assert count == [0, 1, 2]
    found = boundaries_with_arcs([problem], KE_MAX)[0]
    assert found.ke[0] == pytest.approx(0.06097563, rel=1e-6)
    assert found.proven and len(found.ke) == 1


def test_islands_beside_crowded_multipliers_are_found_whatever_the_largest_stiffness():
    # Several multipliers lie near the rim of the series' disc, where their number is hardest to count.
    blade = Blade(
        "crowded",
        ["N0", "N1"],
        [0.0045503, 0.00046485, 0.00370329, 0.00059029],
        [
            ModalState(
                0.0,
                np.array([100.0, 142.65872076, 417.27175192, 894.04561883]),
                np.array(
                    [
                        [2.099806007904384, -1.6537306421246492],
                        [-1.677898378191172, -0.648195385839754],
                        [-0.2038333882217563, 1.5960966368439526],
                        [-0.687276112952291, -1.6532805992018036],
                    ]
                ),
            )
        ],
    )
    weights = {"N0": 0.8382358221152599, "N1": 0.3084322224005896}
    contact = ContactConfiguration(weights, [[0.21400095697175342, 1.156310459974056]])
    speed = np.array([44.78055486167642])
    for ke_max in (12_900.0, 13_428.5, 16_000.0, 40_000.0):
        found = boundary(blade, contact, speed, ke_max, truncation=False)
        assert found.critical_ke[0] == pytest.approx(12_694.2537743, rel=1e-9)
        assert found.crossing == ("flip",)
    assert found.unstable_ke[0][0] == pytest.approx((12_694.2537743, 13_312.2738097), rel=1e-9)
    assert found.unstable_ke[0][1] == pytest.approx((13_804.8125888, 40_000.0), rel=1e-9)
    inside = verdicts(blade, contact, np.repeat(speed, 3), np.array([12_600.0, 12_936.0, 13_400.0]))
    assert list(inside) == [1.0, 0.0, 1.0]


def test_a_window_of_stability_between_two_samples_is_found():
    blade = Blade(
        "window",
        ["A", "B"],
        [0.0010077314717082432, 0.01667757371503399, 0.0023276812060809473, 0.003414801185095067],
        [
            ModalState(
                0.0,
                np.array([100.0, 227.00946810977146, 343.28683539545966, 853.5668384916416]),
                np.array(
                    [
                        [-0.917108982354061, 0.7941273471687995],
                        [0.9337842950342559, 0.28700946280477196],
                        [0.7207511552122003, 0.31505126653893445],
                        [2.488645331126818, 0.44139710421845],
                    ]
                ),
            )
        ],
    )
    contact = ContactConfiguration({"A": 1.0, "B": 1.0}, [[0.6418346742499946, 1.2014776416885526]])
    speed = np.array([41.59347073907887])
    found = boundary(blade, contact, speed, 30_000.0, truncation=False)
    assert len(found.unstable_ke[0]) == 2
    assert found.unstable_ke[0][0] == pytest.approx((19_356.06911174, 20_613.13065139), rel=1e-8)
    assert found.unstable_ke[0][1][0] == pytest.approx(21_849.20997097, rel=1e-8)
    assert list(verdicts(blade, contact, np.repeat(speed, 2), np.array([20_500.0, 21_000.0]))) == [0.0, 1.0]

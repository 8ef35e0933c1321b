"""Batches of boundaries in permanent contact: right, the same one by one, stoppable and bounded."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from named_problems import AT_TIP, benchmark_blade, random_problem, receptance

from sdm_core.blade import example_blade
from sdm_core.boundary import verdicts
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import Cancelled, TooMuchWork
from sdm_core.interruption import interruptible
from sdm_core.permanent_contact.closed_form import crossings
from sdm_core.permanent_contact.permanent_boundary import permanent_crossings
from sdm_core.permanent_contact.receptance import _inverse_beside
from sdm_core.permanent_contact.root_count import unstable_root_count
from sdm_core.rubbing_blade import RubbingBlade, single_state_problem

ON_THE_AXIS = -1


def random_blade(rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Frequencies, damping, mode shapes and weights from the reference design space (DESIGN, 7)."""
    n, r = int(rng.integers(1, 6)), int(rng.integers(1, 10))
    ratios = np.r_[1.0, rng.uniform(1.8, 4.5, min(n - 1, 1)), rng.uniform(1.05, 2.2, max(n - 2, 0))]
    chord = np.linspace(-1.0, 1.0, r)
    shape = np.array([np.polyval(rng.normal(size=3), chord) for _ in range(n)])
    shape *= 1 + 0.1 * rng.normal(size=(n, r))
    shape *= (10 ** rng.uniform(0.0, 1.5, n) / np.abs(shape).max(axis=1))[:, None]
    damping = np.exp(rng.uniform(np.log(2e-4), np.log(1e-2)) + rng.uniform(-0.3, 0.3, n))
    return 100 * np.cumprod(ratios), damping, shape, rng.uniform(0.3, 1.0, r)


def problems_of(rng: np.random.Generator, speeds: int) -> tuple[list[RubbingBlade], float]:
    """One random blade at random speeds, and the K_e at which its softest mode has κ = 4."""
    frequency, damping, shape, weights = random_blade(rng)
    speed = frequency[0] * np.exp(rng.uniform(np.log(0.03), np.log(0.8), speeds))
    problems = [single_state_problem(frequency, damping, shape, weights, s, 0.0) for s in speed]
    compliance = problems[0].contact_matrix.diagonal() / problems[0].omega ** 2
    return problems, 4.0 / compliance.max()


def slow_count(problem: RubbingBlade, ke: float) -> int:
    """Unstable roots from the phase of det(Λ² − ω² + 2iξΛω + K_e(1 − e^{−iωτ})G)/Π(...) itself.

    Nothing is taken out of the determinant and no eigenvalue is looked at: eight frequencies an
    oscillation of the delay, others at Λ(1 + ξ sinh v), middles wherever the phase steps by more
    than half a radian, and all middles once at the end. `ON_THE_AXIS` where it never ends.
    """
    omega, xi, g, tau = problem.omega, problem.damping_ratio, problem.contact_matrix, problem.tau

    def determinant(w: np.ndarray) -> np.ndarray:
        free = omega**2 - w[:, None] ** 2 + 2j * xi * omega * w[:, None]
        contact = ke * (1 - np.exp(-1j * w * tau))[:, None, None] * (g / free[:, None, :])
        return np.linalg.det(np.eye(len(omega)) + contact)

    high = np.sqrt(omega.max() ** 2 + 8 * ke * np.trace(g))
    v = [
        np.arange(-np.arcsinh(1 / x), np.arcsinh((high / o - 1) / x), 0.2)
        for o, x in zip(omega, xi, strict=True)
    ]
    near = [o * (1 + x * np.sinh(u)) for o, x, u in zip(omega, xi, v, strict=True)]
    w = np.unique(np.concatenate([np.linspace(0.0, high, int(64 + 8 * high * tau / 6.28)), *near]))
    d = determinant(w)
    whole = False
    while True:
        steep = np.abs(np.angle(d[1:] / d[:-1])) > 0.5
        if not steep.any():
            if whole:
                break
            steep[:], whole = True, True
        at = np.flatnonzero(steep)
        if (np.diff(w)[at] < 1e-14 * w[at + 1]).any():
            return ON_THE_AXIS
        middle = 0.5 * (w[at] + w[at + 1])
        w, d = np.insert(w, at + 1, middle), np.insert(d, at + 1, determinant(middle))
    phase = np.angle(d[1:] / d[:-1]).sum() - np.angle(d[-1])
    assert abs(-phase / np.pi - round(-phase / np.pi)) < 1e-6
    return round(-phase / np.pi)


def slow_first_crossing(problem: RubbingBlade, ke_max: float, ratio: float) -> float:
    """Bisection of K_e on `slow_count`, from the first unstable K_e of a scan; NaN where there is none."""
    # Small gain: 2K_e‖H‖ < 1 is stable, and ‖H‖ ≤ Σ_j G_jj/(2ξΛ²√(1 − ξ²)).
    xi, omega = problem.damping_ratio, problem.omega
    low = 1 / (problem.contact_matrix.diagonal() / (xi * omega**2 * np.sqrt(1 - xi**2))).sum()
    while slow_count(problem, min(ratio * low, ke_max)) == 0:
        low *= ratio
        if low >= ke_max:
            return np.nan
    high = min(ratio * low, ke_max)
    while high / low - 1 > 2e-8:
        middle = np.sqrt(low * high)
        low, high = (low, middle) if slow_count(problem, middle) else (middle, high)
    return np.sqrt(low * high)


@pytest.mark.parametrize("seed", range(8))
def test_every_first_crossing_is_where_a_root_count_written_apart_finds_it(seed):
    problems, ke_max = problems_of(np.random.default_rng(seed), 3)
    for problem, found in zip(problems, permanent_crossings(problems, ke_max), strict=True):
        assert found.proven
        first = found.ke[0] if len(found.ke) else np.nan
        assert first == pytest.approx(slow_first_crossing(problem, ke_max, 1.3), rel=1e-6, nan_ok=True)


@pytest.mark.parametrize("seed", range(20))
def test_both_root_counts_agree_between_all_crossings(seed):
    # κ up to 40: a hundred unstable roots and more.
    problems, ke_max = problems_of(np.random.default_rng(100 + seed), 2)
    for problem in problems:
        found = permanent_crossings([problem], 10 * ke_max)[0]
        ke = np.sqrt(found.ke[1:] * found.ke[:-1])[:: 1 + len(found.ke) // 4]
        count = unstable_root_count(receptance(problem), problem.speed_hz, ke)
        expected = [2 * found.direction[found.ke <= k].sum() for k in ke]
        np.testing.assert_array_equal(count, expected)
        np.testing.assert_array_equal(count, [slow_count(problem, k) for k in ke])


def test_a_batch_of_different_blades_gives_what_each_gives_alone():
    rng = np.random.default_rng(5)
    problems, ke_max = [], []
    for _ in range(12):
        some, limit = problems_of(rng, 3)
        problems += some
        ke_max += [limit] * len(some)
    order = rng.permutation(len(problems))
    problems, limits = [problems[i] for i in order], np.array(ke_max)[order]
    assert len({p.contact_factor.shape for p in problems}) > 5
    for problem, limit, found in zip(problems, limits, permanent_crossings(problems, limits), strict=True):
        alone = permanent_crossings([problem], limit)[0]
        single = crossings(receptance(problem), problem.speed_hz, limit)
        for other in (alone, single):
            np.testing.assert_allclose(found.ke, other.ke, rtol=1e-9)
            np.testing.assert_allclose(found.frequency_hz, other.frequency_hz, rtol=1e-9)
            np.testing.assert_array_equal(found.direction, other.direction)
        assert found.proven and alone.proven


def test_counts_of_many_cases_are_those_of_each():
    problems, ke_max = problems_of(np.random.default_rng(9), 4)
    ke = ke_max * np.geomspace(1e-3, 1.0, 7)
    speed = np.array([p.speed_hz for p in problems])
    stack = receptance(problems[0])
    together = unstable_root_count(stack, speed, np.tile(ke, (4, 1)), np.zeros(4, dtype=int))
    np.testing.assert_array_equal(together, [unstable_root_count(stack, s, ke) for s in speed])
    assert together.max() > 0


def test_crossings_that_the_root_count_contradicts_are_not_proven():
    problems, ke_max = problems_of(np.random.default_rng(3), 3)
    found = permanent_crossings(problems, ke_max, root_count=lambda *case: unstable_root_count(*case) + 2)
    assert not any(crossings.proven for crossings in found)
    assert all(np.isinf(crossings.error_estimate).all() for crossings in found)


def test_an_undamped_blade_is_the_limit_of_vanishing_damping():
    shape = np.array([[1.0, 0.5], [0.3, 2.0]])

    def highest(damping: float) -> list[float]:
        # At 30 Hz both frequencies are engine orders.
        speeds = (30.0, 77.0)
        blade = np.array([100.0, 300.0]), np.full(2, damping), shape, np.ones(2)
        problems = [single_state_problem(*blade, speed, 0.0) for speed in speeds]
        found = permanent_crossings(problems, 3e5)
        assert all(crossings.proven for crossings in found)
        return [crossings.ke[-1] for crossings in found]

    assert highest(0.0) == highest(1e-8)
    assert highest(0.0) == pytest.approx(highest(1e-6), rel=1e-4)


def test_a_node_that_no_mode_moves_is_never_unstable():
    shape = np.array([[0.0, 0.0], [0.0, 0.0]])
    still = single_state_problem(np.array([1.0, 3.0]), np.full(2, 1e-3), shape, np.ones(2), 0.2, 0.0)
    found = permanent_crossings([still, random_problem(np.random.default_rng(0))], 1e6)
    assert found[0].proven and len(found[0].ke) == 0
    assert found[1].proven and len(found[1].ke) > 0


@pytest.mark.parametrize("modes", [2, 3])
def test_equal_modes_at_nodes_of_their_own_lose_stability_together(modes):
    def problem(n: int) -> RubbingBlade:
        return single_state_problem(np.full(n, 100.0), np.full(n, 1e-3), np.eye(n), np.ones(n), 30.0, 0.0)

    one, many = permanent_crossings([problem(1), problem(modes)], 3e5)
    assert one.proven and many.proven and len(one.ke) > 1
    np.testing.assert_allclose(many.ke, np.repeat(one.ke, modes), rtol=1e-12)
    np.testing.assert_array_equal(many.direction, np.repeat(one.direction, modes))


@pytest.mark.parametrize("speed_ratio", [0.005, 5.0])
@pytest.mark.parametrize("nodes", [1, 2, 3])
def test_speeds_far_outside_the_design_space_are_proven_too(speed_ratio, nodes):
    shape = np.array([[1.0, 0.5, 0.2], [0.3, 2.0, 1.0], [1.0, 1.0, -1.0]])[:, :nodes]
    blade = np.array([100.0, 300.0, 420.0]), np.full(3, 1e-3), shape, np.ones(nodes)
    problem = single_state_problem(*blade, 100 * speed_ratio, 0.0)
    found = permanent_crossings([problem], 3e5)[0]
    assert found.proven and len(found.ke) > 1
    near = found.ke[0] * np.array([1 - 1e-6, 1 + 1e-6])
    assert [slow_count(problem, ke) for ke in near] == [0, 2]


def test_a_speed_too_low_to_solve_is_refused_by_name():
    problem = replace(random_problem(np.random.default_rng(0)), speed_hz=1e-5)
    with pytest.raises(TooMuchWork, match="speed_hz"):
        permanent_crossings([problem], 1e6)


def test_an_island_of_instability_is_followed_until_it_vanishes():
    # Two crossings meet where the phase of the delay only touches a whole turn: at about 227 Hz.
    blade = np.array([100.0, 130.0]), np.full(2, 1e-3), np.array([[1.0], [0.8]]), np.ones(1)

    def island(speed: float) -> np.ndarray:
        found = permanent_crossings([single_state_problem(*blade, speed, 0.0)], 1e6)[0]
        assert found.proven
        return found.ke[1:3] if len(found.ke) > 2 else np.zeros(0)

    there, gone = 226.5, 227.5
    assert np.diff(island(there)) > 1e4 and len(island(gone)) == 0
    while gone / there - 1 > 1e-12:
        middle = 0.5 * (there + gone)
        there, gone = (middle, gone) if len(island(middle)) else (there, middle)
    low, high = island(there * (1 - 1e-12))
    assert high / low - 1 < 1e-4
    problem = single_state_problem(*blade, 226.5, 0.0)
    low, high = island(226.5)
    assert [slow_count(problem, ke) for ke in (0.999 * low, np.sqrt(low * high), 1.001 * high)] == [2, 4, 2]


def test_no_stiffness_is_stable_whatever_the_others_asked_for():
    speed, ke = np.array([0.1, 0.1, 0.2]), np.array([0.0, 3.0, 0.0])
    assert verdicts(benchmark_blade(), AT_TIP, speed, ke).tolist() == [1.0, 0.0, 1.0]


def test_a_batch_can_be_stopped_from_outside():
    contact = ContactConfiguration.at("LE", "TE")
    problems = RubbingBlade.at_speeds(example_blade("nasa_rotor_37"), contact, np.linspace(60.0, 300.0, 400))
    passed = 0

    def stop() -> None:
        nonlocal passed
        passed += 1
        if passed == 20:
            raise Cancelled("enough")

    with interruptible(stop), pytest.raises(Cancelled):
        permanent_crossings(problems, 2.5e4)
    assert passed == 20


def test_memory_does_not_grow_with_the_number_of_cases():
    contact = ContactConfiguration.at("LE", "TE")
    speed = np.linspace(60.0, 300.0, 5000)
    problems = RubbingBlade.at_speeds(example_blade("nasa_rotor_37"), contact, speed)

    def peak(count: int) -> float:
        tracemalloc.start()
        found = permanent_crossings(problems[:: len(problems) // count], 2.5e4)
        size = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert all(crossings.proven for crossings in found)
        return size / 2**20

    few, many = peak(500), peak(5000)
    assert many < few + 20


def test_an_eigenvalue_that_elimination_meets_exactly_is_stepped_around():
    met = 1.0 * (1 + 1e-11j) + 1j * 1e-14 * 3.0  # where H is inverted first
    value, inverse = _inverse_beside(np.diag([met, 3.0])[None], np.array([1.0]))
    trace = np.trace(inverse[0])
    assert value[0] + trace / (inverse[0] ** 2).sum() == pytest.approx(met, rel=1e-13)

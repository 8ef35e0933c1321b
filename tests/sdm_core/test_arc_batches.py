"""Multipliers of many points at once, with arcs of contact, against independent methods."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from loky import get_reusable_executor
from named_problems import benchmark_blade, random_problem
from scipy.linalg import expm

from sdm_core.boundary import verdicts
from sdm_core.collocation import Collocation
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import Cancelled
from sdm_core.floquet.arc_propagation import ArcPropagation, exponentials
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.floquet.arc_steps import ArcSteps
from sdm_core.floquet.characteristic import CharacteristicEquation, count_outside, determinant
from sdm_core.floquet.contact_expansion import ContactExpansion
from sdm_core.floquet.power_series import half_circle, real_series
from sdm_core.interruption import interruptible
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.stability import stability


def random_arcs(rng: np.random.Generator) -> list[list[float]]:
    count, engaged = int(rng.integers(1, 5)), rng.uniform(0.05, 0.8)
    lengths, gaps = rng.dirichlet(np.ones(count)) * engaged, rng.dirichlet(np.ones(count)) * (1 - engaged)
    start = np.cumsum(np.r_[0.0, (lengths + gaps)[:-1]])
    return [[float(a), float(a + length)] for a, length in zip(start, lengths, strict=True)]


def random_problems(seed: int, count: int):
    rng = np.random.default_rng(seed)
    return [random_problem(rng, random_arcs(rng), kappa=10 ** rng.uniform(-4, -0.5)) for _ in range(count)]


def test_exponentials_are_those_of_a_library():
    rng = np.random.default_rng(0)
    for size in (1.0, 30.0, 1000.0):
        a = rng.normal(size=(20, 6, 6))
        a = size * (a - a.swapaxes(1, 2)) / 6 + 1e-3j * rng.normal(size=(20, 6, 6))
        np.testing.assert_allclose(exponentials(a), expm(a), atol=1e-14 * (10 + size))


def test_multipliers_and_their_number_are_those_of_collocation():
    problems = random_problems(1, 40)
    found = batch_multipliers(problems)
    assert (found.outside >= 0).all() and (found.error_estimate < 1e-9).all()
    assert 5 < (found.outside > 0).sum() < 35  # both kinds are there
    for problem, mu, outside in zip(problems, found.multiplier, found.outside, strict=True):
        reference = Collocation(48).multipliers(problem, count=24)
        assert abs(mu) == pytest.approx(np.abs(reference[0]), rel=1e-9)
        assert outside == (np.abs(reference) > 1).sum()


def test_a_batch_gives_what_each_point_gives_alone():
    problems = random_problems(2, 30)
    together = batch_multipliers(problems)
    for i, problem in enumerate(problems):
        alone = CharacteristicEquation(problem)
        count = alone.count_outside()
        mu, error = alone.dominant(count)
        assert together.outside[i] == count
        assert np.isinf(error) or abs(together.multiplier[i]) == pytest.approx(abs(mu), rel=1e-9)


def test_the_series_gives_the_fundamental_matrix_of_the_exponentials():
    for problem in random_problems(3, 12):
        motion = ArcPropagation.of([problem])
        c = problem.ke * (np.exp(-1j * np.linspace(0, np.pi, 9)) - 1)
        exact = motion.fundamental(np.zeros(9, dtype=int), c)
        series = ContactExpansion.of(motion, np.array([problem.ke]), np.array([1.2]))
        assert series.resolved.all()
        np.testing.assert_allclose(series.fundamental(c[None])[0], exact, atol=1e-12 * series.size[0])


@pytest.mark.parametrize("strength", [1e-3, 1.0, 30.0])
def test_short_steps_give_the_fundamental_matrix_of_the_exponentials(strength):
    rng = np.random.default_rng(15)
    arcs = [[[0.1, 0.3]], [[0.0, 0.2], [0.5, 0.9]], [[0.2, 0.25], [0.4, 0.6], [0.7, 0.95]], [[0.0, 1.0]]]
    problems = [random_problem(np.random.default_rng(15), part, 0.05 * strength) for part in arcs]
    motion, ke = ArcPropagation.of(problems), np.array([p.ke for p in problems])
    case = rng.integers(0, 4, 60)
    c = ke[case] * (rng.uniform(0, 1, 60) * np.exp(2j * np.pi * rng.uniform(0, 1, 60)) - 1)
    exact = motion.fundamental(case, c)
    size = np.abs(exact).max(axis=(1, 2))
    steps = ArcSteps.of(motion, 2 * ke)
    error = np.abs(steps.fundamental(case, c) - exact).max(axis=(1, 2))
    assert (error < 30 * motion.rounding[case] * size).all()
    kept = np.array([3, 1])  # a selection answers for itself
    own = steps[kept].fundamental(np.array([0, 1]), -0.5 * ke[kept] + 0j)
    np.testing.assert_array_equal(own, steps.fundamental(kept, -0.5 * ke[kept] + 0j))


@pytest.mark.parametrize("terms", [2, 6, 16])
def test_a_real_power_series_is_found_from_half_a_circle(terms):
    coefficients = np.random.default_rng(terms).normal(size=(3, terms, 4))
    powers = half_circle(terms)[:, None] ** np.arange(terms)
    np.testing.assert_allclose(real_series(powers @ coefficients), coefficients, atol=1e-13)


def test_without_contact_the_least_damped_mode_dominates():
    problem = random_problems(4, 1)[0].with_ke(0.0)
    found = batch_multipliers([problem])
    rate = (problem.damping_ratio * problem.omega).min() * problem.tau
    assert abs(found.multiplier[0]) == pytest.approx(np.exp(-rate), rel=1e-10)
    assert found.stable[0] == 1.0


def test_much_contact_is_proven_unstable_even_where_its_multipliers_are_not_counted():
    problem = random_problem(np.random.default_rng(5), [[0.0, 0.7]], kappa=0.3)
    slow = replace(problem, speed_hz=problem.speed_hz / 30).with_ke(3 * problem.ke)
    assert CharacteristicEquation(slow).count_outside() is None
    found = batch_multipliers([slow])
    assert found.stable[0] == 0.0 and abs(found.multiplier[0]) > 1
    assert batch_multipliers([slow], dominant=False).stable[0] == 0.0
    alone = stability(slow)
    assert alone.stable is False and alone.unstable_multipliers is None
    assert alone.spectral_radius == pytest.approx(abs(found.multiplier[0]), rel=1e-9)


@pytest.mark.parametrize("engaged", [0.3, 0.7])
def test_verdicts_on_a_map_with_arcs_are_those_of_the_argument_principle(engaged):
    blade, contact = benchmark_blade(), ContactConfiguration({"tip": 1.0}, [(0.1, 0.1 + engaged)])
    speed, ke = (axis.ravel() for axis in np.meshgrid(np.linspace(0.05, 0.4, 12), np.geomspace(0.01, 4, 12)))
    found = verdicts(blade, contact, speed, ke)
    for s, k, stable in zip(speed, ke, found, strict=True):
        count = CharacteristicEquation(RubbingBlade.from_blade(blade, contact, s, k)).count_outside()
        assert stable == (count == 0)
    assert 0.1 < found.mean() < 0.95


def test_a_batch_with_arcs_can_be_cancelled():
    def stop() -> None:
        raise Cancelled("enough")

    with interruptible(stop), pytest.raises(Cancelled):
        batch_multipliers(random_problems(6, 3))


def test_points_without_contact_among_others_are_answered():
    # At K_e = 0 modes do not couple and the matrix of Newton's method can be singular to the last bit.
    blade, contact = benchmark_blade(), ContactConfiguration({"tip": 1.0}, [(0.0, 0.25), (0.5, 0.75)])
    speed = np.linspace(0.02, 0.45, 200)
    assert (verdicts(blade, contact, speed, np.zeros(200)) == 1.0).all()


def test_strong_contact_is_counted_in_batches_as_one_by_one_with_a_finer_start():
    found = 0
    for problem in random_problems(11, 12):
        motion = ArcPropagation.of([problem])
        growth = float(motion.phase_shift[0] * problem.ke)
        strong = problem.with_ke(problem.ke * 12.0 / growth)  # much contact, still within reach of a count
        motion = ArcPropagation.of([strong])

        def value(_, angle, motion=motion, ke=strong.ke):
            mu = np.exp(1j * angle)
            return determinant(motion.fundamental(np.zeros(len(mu), dtype=int), ke * (1 / mu - 1)), mu)

        fine = value(None, np.linspace(0, np.pi, 4_001))
        count = -round(np.angle(fine[1:] / fine[:-1]).sum() / np.pi)
        assert count_outside(motion, np.array([strong.ke]))[0] == count
        found = max(found, count)
    assert found > 6


def test_processes_share_a_batch_and_give_the_same_answers():
    problems = random_problems(12, 120)
    alone, shared = batch_multipliers(problems, workers=1), batch_multipliers(problems, workers=3)
    np.testing.assert_array_equal(alone.outside, shared.outside)
    np.testing.assert_allclose(np.abs(alone.multiplier), np.abs(shared.multiplier), rtol=1e-12)


def test_a_shared_batch_stops_when_asked_and_tells_how_far_it_is():
    problems = random_problems(13, 200)
    seen = []
    batch_multipliers(problems, workers=2, progress=lambda done, of: seen.append((done, of)))
    assert seen[-1] == (200, 200) and [d for d, _ in seen] == sorted(d for d, _ in seen)

    def stop():
        raise Cancelled("enough")

    for workers in (1, 2):
        with pytest.raises(Cancelled), interruptible(stop):
            batch_multipliers(problems, workers=workers)


def test_a_worker_that_dies_costs_time_and_no_answer(caplog):
    problems = random_problems(14, 160)
    expected = batch_multipliers(problems, workers=1)
    seen = []

    def kill_one(done, of):
        seen.append(done)
        if len(seen) == 1:
            for process in get_reusable_executor(max_workers=2, reuse=True)._processes.values():
                os.kill(process.pid, signal.SIGKILL)

    found = batch_multipliers(problems, workers=2, progress=kill_one)
    assert seen[-1] == 160
    assert "a worker ended" in caplog.text
    np.testing.assert_array_equal(found.outside, expected.outside)
    np.testing.assert_allclose(np.abs(found.multiplier), np.abs(expected.multiplier), rtol=1e-12)


SHARES = """
import os, signal, sys
sys.path.insert(0, "tests")
from loky import get_reusable_executor
from benchmarks.random_blades import random_rubbing_blade
import numpy as np
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.floquet.arc_steps import ArcSteps

rng = np.random.default_rng(0)
batch_multipliers([random_rubbing_blade(rng, 2) for _ in range(120)], workers=2)
print(*get_reusable_executor(max_workers=2, reuse=True)._processes, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_workers_leave_when_their_parent_is_killed():
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", SHARES], cwd=root, stdout=subprocess.PIPE, text=True, timeout=60
    )
    workers = [int(pid) for pid in done.stdout.split()]
    assert len(workers) == 2
    until = time.monotonic() + 10.0
    while any(_alive(pid) for pid in workers) and time.monotonic() < until:
        time.sleep(0.1)
    assert not any(_alive(pid) for pid in workers)


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z"
    except FileNotFoundError:
        return False

"""The argument principle counts what lies outside a circle, or says that it cannot."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from named_problems import random_problem

from sdm_core.floquet.winding import half_turns
from sdm_core.semi_discretization import StructuredAveraged, reduced_equation

Function = Callable[[np.ndarray], np.ndarray]


def with_zeros(*zeros: complex) -> Function:
    """Π (1 − μ_k/μ), and with each zero off the real axis its conjugate: 1 at infinity."""
    every = np.array([z for zero in zeros for z in ({zero, np.conj(zero)} if np.imag(zero) else {zero})])
    return lambda mu: np.prod(1 - every / mu[:, None], axis=1)


def outside(*functions: Function, first: int = 17) -> list[float]:
    """Zeros outside the unit circle: each turns the phase by −π on the way from 0 to π."""

    def value(case: np.ndarray, angle: np.ndarray) -> np.ndarray:
        mu = np.exp(1j * angle)
        return np.array([functions[k](mu[i : i + 1])[0] for i, k in enumerate(case)], dtype=complex)

    turns, _ = half_turns(value, np.full(len(functions), first))
    return (-turns).tolist()


@pytest.mark.parametrize(
    ("zeros", "expected"),
    [
        ((0.5, -0.3, 0.2 + 0.7j), 0),
        ((1.5,), 1),
        ((-1.5, 0.9), 1),
        ((1.2 + 0.3j, -0.4 + 2.0j, 0.1j), 4),
        ((3.0, 1.5, -1.1, 0.5 + 0.1j, 1.0 + 1.0j), 5),
        ((1.5, 1.5), 2),
        ((1.1j, 1.1j, 0.9), 4),
        ((-1.3, -1.3, -1.3), 3),
    ],
)
def test_zeros_outside_the_circle_are_counted_with_their_multiplicity(zeros, expected):
    functions = [with_zeros(*zeros), with_zeros(*(z * 1e-3 for z in zeros))]
    assert outside(*functions) == pytest.approx([expected, 0], abs=1e-9)


def test_a_phase_that_turns_steadily_is_followed():
    assert outside(lambda mu: 1 - (3.0 / mu) ** 20) == pytest.approx([20], abs=1e-9)


@pytest.mark.parametrize("distance", [1e-3, 1e-4, 1e-5, 1e-6])
@pytest.mark.parametrize("angle", [0.0, 1.0, 0.6435, np.pi])
def test_two_zeros_that_hide_each_other_s_turn_are_both_seen(distance, angle):
    # One just outside, one just inside at the same angle: from afar the phase does not turn at all.
    place = np.exp(1j * angle) if 0 < angle < 3 else np.cos(angle)
    found = outside(
        with_zeros(place * (1 + distance), place * (1 - distance)),
        with_zeros(place * (1 + distance), place * (1 + 2 * distance)),
        with_zeros(place * (1 - distance), place * (1 - 2 * distance)),
        with_zeros(place * (1 + distance)),
    )
    pair = 2 if 0 < angle < 3 else 1
    assert found == pytest.approx([pair, 2 * pair, 0, pair], abs=1e-9)


@pytest.mark.parametrize("zero", [1.0, -1.0, 1j, np.exp(0.7j)])
def test_a_zero_on_the_circle_is_not_counted_to_either_side(zero):
    found = outside(with_zeros(zero, 2.0), with_zeros(2.0))
    assert np.isnan(found[0]) and found[1] == pytest.approx(1)


def test_a_value_that_is_lost_gives_up_its_own_function_only():
    def lost(mu: np.ndarray) -> np.ndarray:
        return np.where(np.angle(mu) > 3.0, np.nan, with_zeros(2.0)(mu))

    found = outside(lost, with_zeros(2.0), lambda mu: np.full(len(mu), np.inf + 0j))
    assert np.isnan(found[0]) and np.isnan(found[2])
    assert found[1] == pytest.approx(1)


def test_functions_not_to_be_followed_are_not_evaluated():
    seen: set[int] = set()

    def value(case: np.ndarray, angle: np.ndarray) -> np.ndarray:
        seen.update(case.tolist())
        return with_zeros(2.0)(np.exp(1j * angle))

    turns, _ = half_turns(value, np.array([0, 5, 0]))
    assert np.isnan(turns[[0, 2]]).all() and turns[1] == pytest.approx(-1)
    assert seen == {1}
    assert np.isnan(half_turns(value, np.array([0]))[0]).all()


def test_the_nearest_point_lies_at_the_angle_of_the_zero_nearest_to_the_circle():
    def value(_, angle: np.ndarray) -> np.ndarray:
        return with_zeros(1.001 * np.exp(0.7j), 0.9)(np.exp(1j * angle))

    _, nearest = half_turns(value, np.array([17]))
    assert nearest[0] == pytest.approx(0.7, abs=1e-2)


def test_a_wrong_set_of_roots_does_not_pass_the_count_of_the_reduced_equation(monkeypatch):
    # One root thrown in and one left out: what remains looks as smooth, only the winding number tells.
    problem = random_problem(np.random.default_rng(2), [[0.1, 0.3]], most_modes=2)
    monodromy = StructuredAveraged(40).contact_map(problem.delay_equation())
    exact = np.linalg.eigvals(monodromy.matrix())
    largest = np.abs(exact).max()
    assert np.abs(reduced_equation.leading(monodromy, 2)).max() == pytest.approx(largest, rel=1e-9)
    roots = np.roots

    def one_missing(series: np.ndarray) -> np.ndarray:
        found = roots(series)
        return found[np.abs(found) < np.abs(found).max() * (1 - 1e-9)]

    monkeypatch.setattr(reduced_equation.np, "roots", one_missing)
    assert reduced_equation.leading(monodromy, 2) is None

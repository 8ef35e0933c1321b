"""Semi-discretization on the contact history: equal to its dense twin, of the order theory gives, O(N)."""

import time
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from named_problems import MILLING_RADIUS, benchmark_blade, mathieu, milling, random_problem
from scipy.linalg import expm

from sdm_core.collocation import Collocation
from sdm_core.contact import ContactConfiguration
from sdm_core.delay_equation import DelayEquation, Fourier, PeriodicMatrix, Sampled
from sdm_core.errors import InvalidInput, TooMuchWork
from sdm_core.floquet.characteristic import CharacteristicEquation
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.semi_discretization import Averaged, Converged, Gauss, Linear, StructuredAveraged
from sdm_core.semi_discretization import contact_map as contact_map_file
from sdm_core.semi_discretization import structured as structured_file
from sdm_core.semi_discretization.reduced_equation import leading

ARCS = (None, [[0.1, 0.4]], [[0.0, 0.25], [0.5, 0.75]], [[0.2, 0.3], [0.9, 1.15]], [[0.1234, 0.3734]])
SCHEMES = (
    StructuredAveraged(),
    StructuredAveraged(aligned=True),
    Linear(),
    Linear(aligned=True),
    Gauss(nodes=1),
    Gauss(nodes=2),
    Gauss(nodes=3),
    Gauss(nodes=4),
)


def name(value) -> str:
    return (
        str(value).replace("steps=60, ", "") if isinstance(value, StructuredAveraged | Linear | Gauss) else ""
    )


def blade(speed_hz: float = 0.1, arcs: list[list[float]] | None = None) -> RubbingBlade:
    contact = ContactConfiguration.at("tip", arcs=arcs)
    return RubbingBlade.from_blade(benchmark_blade(), contact, speed_hz, 0.05 * (2 * np.pi) ** 2)


def smooth_engagement(speed_hz: float = 0.3) -> DelayEquation:
    """γ a Fourier series, so that every step differs."""
    problem = blade(speed_hz)
    return DelayEquation.of_second_order(
        np.eye(2),
        np.diag(2 * problem.damping_ratio * problem.omega),
        np.diag(problem.omega**2),
        problem.ke * problem.contact_matrix,
        problem.tau,
        Fourier(0.4, (0.4, 0.1), (0.2, 0.0), problem.tau),
    )


def missed(found: np.ndarray, expected: np.ndarray) -> float:
    """How far the worst of the expected multipliers is from the nearest found, relative to the largest."""
    return max(np.abs(found - mu).min() for mu in expected) / abs(expected[0])


TWINS = [
    *(random_problem(np.random.default_rng(seed), ARCS[seed % 5]).delay_equation() for seed in range(10)),
    mathieu(),
    milling(0.5e-3),
    smooth_engagement(),
]


@pytest.mark.parametrize("steps", [21, 60, 100])
@pytest.mark.parametrize("equation", TWINS)
def test_structured_scheme_has_the_multipliers_of_its_dense_twin(equation, steps, monkeypatch):
    expected = Averaged(steps).multipliers(equation)[:6]
    method = StructuredAveraged(steps)
    assert missed(method.multipliers(equation), expected) < 1e-10
    assert missed(expected, method.multipliers(equation)) < 1e-10  # and none besides
    monkeypatch.setattr(contact_map_file, "_SMALL", 0)
    by_krylov = method.contact_map(equation).eigenvalues(6)
    assert missed(by_krylov, expected) < 1e-10


def test_reduced_equation_finds_what_the_krylov_iteration_finds():
    answered = 0
    for equation in TWINS:
        for scheme in SCHEMES:
            monodromy = replace(scheme, steps=40).contact_map(equation)
            found = leading(monodromy, 2)
            if found is not None:  # it may give up, but not be wrong
                expected = monodromy.eigenvalues(len(found))
                assert missed(expected, found[np.argsort(-np.abs(found))]) < 1e-10
                answered += 1
    assert answered > 0.95 * len(TWINS) * len(SCHEMES)


@pytest.mark.parametrize("scheme", SCHEMES, ids=name)
@pytest.mark.parametrize(
    "equation", [TWINS[1], TWINS[4], mathieu()], ids=["arc", "arc off the grid", "mathieu"]
)
def test_reduced_determinant_is_that_of_the_whole_operator(scheme, equation):
    monodromy = replace(scheme, steps=24).contact_map(equation)
    u = np.array([0.3, -0.9, 1.1 + 0.4j, 2.0j])
    whole = [np.linalg.det(np.eye(monodromy.size) - x * monodromy.matrix()) for x in u]
    np.testing.assert_allclose(monodromy.determinant(u), whole, rtol=1e-9)


def test_linear_scheme_is_the_one_written_with_the_whole_history():
    # z_{i+1} = P z_i + Φ_0' u_{i−N} + Φ_1 u_{i−N+1}, the weights by quadrature of exp(A(h − s)) s/h B.
    steps, equation = 20, mathieu()
    h = equation.tau / steps
    a, b = equation.means(h * np.arange(steps), h * np.arange(1, steps + 1))
    x, w = np.polynomial.legendre.leggauss(12)
    s, w = (x + 1) / 2, w / 2
    size = 2 + steps  # z_i, then displacements of a revolution, newest first
    monodromy = np.eye(size)
    for i in range(steps):
        weight = [w[k] * h * expm(a[i] * h * (1 - s[k])) @ b[i][:, :1] for k in range(12)]
        step = np.zeros((size, size))
        step[:2, :2] = expm(a[i] * h)
        step[:2, -2:-1] = sum(s[k] * weight[k] for k in range(12))
        step[:2, -1:] = sum((1 - s[k]) * weight[k] for k in range(12))
        step[2, 0] = 1.0
        step[3:, 2:-1] = np.eye(steps - 1)
        monodromy = step @ monodromy
    expected = np.linalg.eigvals(monodromy)
    expected = expected[np.argsort(-np.abs(expected))][:4]
    assert missed(Linear(steps).multipliers(equation), expected) < 1e-11


def fitted_order(scheme, equation: DelayEquation, radius: float, steps: list[int]) -> float:
    found = [abs(replace(scheme, steps=n).multipliers(equation, 1)[0]) for n in steps]
    error = np.abs(np.array(found) / radius - 1)
    assert error.min() > 3e-13  # above rounding, or the slope means nothing
    return -float(np.polyfit(np.log(steps), np.log(error), 1)[0])


STEPS_OF_ORDER = {2: [160, 320, 640, 1280], 4: [80, 160, 320, 640], 6: [80, 160, 320], 8: [40, 80, 160]}


@pytest.mark.parametrize("arcs", [None, [[0.1234, 0.3734], [0.5731, 0.8231]]], ids=["permanent", "arcs"])
@pytest.mark.parametrize("scheme", SCHEMES, ids=name)
def test_error_of_a_rubbing_blade_falls_with_the_order_of_theory(scheme, arcs):
    problem = blade(0.1, arcs)
    radius = abs(CharacteristicEquation(problem).dominant()[0])
    order = fitted_order(scheme, problem.delay_equation(), radius, STEPS_OF_ORDER[scheme.order])
    assert order == pytest.approx(scheme.order, abs=0.15)


@pytest.mark.parametrize("scheme", SCHEMES, ids=name)
def test_error_with_smooth_coefficients_falls_with_the_order_of_theory(scheme):
    steps = {2: [40, 80, 160, 320], 4: [40, 80, 160], 6: [20, 40, 80], 8: [20, 30, 40]}[scheme.order]
    for equation in (smooth_engagement(), mathieu()) if scheme.order < 6 else (smooth_engagement(),):
        radius = abs(Collocation(64).multipliers(equation, 1)[0])
        assert fitted_order(scheme, equation, radius, steps) == pytest.approx(scheme.order, abs=0.15)


@pytest.mark.parametrize("scheme", [StructuredAveraged(), Linear()], ids=name)
def test_arcs_off_the_grid_keep_order_two_with_a_constant_that_wobbles(scheme):
    problem = blade(0.45, [[0.1234, 0.2034]])
    radius = abs(CharacteristicEquation(problem).dominant()[0])
    steps = np.arange(30, 400, 7)
    found = [abs(replace(scheme, steps=int(n)).multipliers(problem.delay_equation(), 1)[0]) for n in steps]
    error = np.array(found) / radius - 1
    assert -np.polyfit(np.log(steps), np.log(np.abs(error)), 1)[0] == pytest.approx(2.0, abs=0.15)
    constant = error * steps**2
    assert 1.02 < constant.max() / constant.min() < 1.3


def test_order_is_lost_where_a_jump_is_not_declared():
    arcs = [[0.1234, 0.3734]]
    problem = blade(0.3, arcs)
    radius = abs(CharacteristicEquation(problem).dominant()[0])

    def engaged(t):
        return ((t / problem.tau > arcs[0][0]) & (t / problem.tau < arcs[0][1])).astype(float)

    def error(breaks):
        equation = DelayEquation.of_second_order(
            np.eye(2),
            np.diag(2 * problem.damping_ratio * problem.omega),
            np.diag(problem.omega**2),
            problem.ke * problem.contact_matrix,
            problem.tau,
            Sampled(engaged, breaks=breaks),
        )
        return abs(abs(Gauss(160).multipliers(equation, 1)[0]) / radius - 1)

    declared = error(tuple(edge * problem.tau for edge in arcs[0]))
    assert declared < 1e-10
    assert error(()) > 1000 * declared


@pytest.mark.parametrize("seed", range(10))
def test_gauss_points_reach_the_exact_multiplier_of_random_blades(seed):
    problem = random_problem(np.random.default_rng(seed), ARCS[seed % 5])
    exact, _ = CharacteristicEquation(problem).dominant()
    found = Gauss(200, 4).multipliers(problem.delay_equation(), 2)
    assert np.abs(found - exact).min() < 1e-10 * abs(exact)


@pytest.mark.parametrize(("depth", "radius"), MILLING_RADIUS.items())
def test_forty_steps_of_gauss_points_have_the_published_multiplier_of_milling(depth, radius):
    assert abs(Gauss(40).multipliers(milling(depth), 1)[0]) == pytest.approx(radius, rel=1e-5)


@pytest.mark.parametrize("scheme", SCHEMES[::2], ids=name)
@pytest.mark.parametrize(
    ("equation", "seconds"),
    [
        (blade().delay_equation(), 1.0),
        (blade(0.1, ARCS[4]).delay_equation(), 1.0),
        (smooth_engagement(), 4.0),
    ],
    ids=["permanent", "arc", "smooth"],
)
def test_ten_thousand_steps_fit_in_little_memory_and_time(scheme, equation, seconds):
    method = replace(scheme, steps=10_000)
    start = time.perf_counter()
    method.multipliers(equation, 2)
    assert time.perf_counter() - start < seconds
    tracemalloc.start()
    method.multipliers(equation, 2)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100e6  # the dense matrix would take 800 MB and more
    if equation.is_constant:
        assert peak < 1e6  # equal steps are held once


def test_only_engaged_steps_and_contact_combinations_are_kept():
    problem = random_problem(np.random.default_rng(1), [[0.0, 0.25]], most_modes=5)
    rank = problem.contact_factor.shape[1]
    equation = problem.delay_equation()
    assert StructuredAveraged(80).contact_map(equation).size == equation.size + 20 * rank
    assert Gauss(80, 3).contact_map(equation).size == equation.size + 20 * 3 * rank
    assert len(Gauss(80, 3).contact_map(equation).steps) == 2  # engaged and free


def test_twice_the_steps_are_twice_as_many_on_every_arc():
    equation = blade(0.1, [[0.1234, 0.2], [0.3, 0.35]]).delay_equation()
    counts = [Gauss(n).contact_map(equation).repeat for n in (20, 40, 80, 160)]
    for k, repeat in enumerate(counts):
        np.testing.assert_array_equal(repeat[1::2], counts[0][1::2] * 2**k)  # arcs
        np.testing.assert_array_equal(repeat[::2], 1)  # free flights, exact


@pytest.mark.parametrize("scheme", SCHEMES, ids=name)
def test_without_delayed_effect_the_multipliers_are_those_of_the_ordinary_equation(scheme):
    problem = blade().with_ke(0.0)
    rate = problem.omega * (-problem.damping_ratio + 1j * np.sqrt(1 - problem.damping_ratio**2))
    found = scheme.multipliers(problem.delay_equation())
    expected = np.sort(np.repeat(np.abs(np.exp(rate * problem.tau)), 2))[::-1]
    np.testing.assert_allclose(np.abs(found), expected, rtol=1e-11)


def test_low_speed_converges_where_a_dense_matrix_would_not_fit():
    problem = blade(0.01, [[0.1, 0.4]])
    exact = abs(CharacteristicEquation(problem).dominant()[0])
    for scheme in (StructuredAveraged(aligned=True), Gauss()):
        found = Converged(1e-5, scheme=scheme).dominant(problem.delay_equation())
        assert found.converged and found.steps > 1000
        assert abs(found.multiplier) == pytest.approx(exact, rel=1e-5)


def test_refinement_that_runs_out_of_room_says_so():
    equation = blade(0.02).delay_equation()
    found = Converged(1e-9, largest_state=2000).dominant(equation)
    assert not found.converged and found.error_estimate > 1e-9 and found.steps < 2000
    assert Converged(1e-9, scheme=Gauss()).dominant(equation).converged


@pytest.mark.parametrize(
    ("make", "field"),
    [
        *(
            (lambda steps=steps, m=m: m(steps), "steps")
            for steps in (0, 1, 2.5, True, 10**9)
            for m in (Linear, Gauss)
        ),
        (lambda: StructuredAveraged("60"), "steps"),
        (lambda: Gauss(20, 0), "nodes"),
        (lambda: Gauss(20, 7), "nodes"),
        (lambda: Gauss(20, 2.0), "nodes"),
        (lambda: Gauss(20).multipliers(mathieu(), 0), "count"),
        (lambda: Linear(20).multipliers(mathieu(), 1.5), "count"),
    ],
)
def test_unusable_settings_are_refused_by_name(make, field):
    with pytest.raises(InvalidInput, match="give a whole number") as refused:
        make()
    assert refused.value.field == field


def test_motion_that_overflows_and_maps_that_do_not_fit_are_refused(monkeypatch):
    growing = DelayEquation(PeriodicMatrix(np.array([[900.0]])), PeriodicMatrix(np.array([[1.0]])), 1.0)
    with pytest.raises(TooMuchWork, match="overflows"):
        Gauss(400).multipliers(growing)
    monkeypatch.setattr(structured_file, "LARGEST_MAPS", 10_000)
    with pytest.raises(TooMuchWork, match=r"steps = 5000: take fewer"):
        Linear(5000).multipliers(mathieu())
    assert not Converged(1e-12, scheme=Linear()).dominant(mathieu()).converged
    Linear(5000).multipliers(blade().delay_equation())  # equal steps are held once

"""What must not change the answer, and what the physics forbids."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from named_problems import random_problem, receptance

from sdm_core.blade import Blade, ModalState
from sdm_core.boundary import BoundarySolution, boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.delay_equation import Engagement
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.floquet.characteristic import CharacteristicEquation
from sdm_core.permanent_contact.closed_form import crossings
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.semi_discretization import Averaged
from sdm_core.stability import StabilitySolution, stability

EXAMPLES = 6  # of each change
TWO_ARCS = [[0.1, 0.3], [0.55, 0.8]]


@dataclass(frozen=True)
class Rub:
    """A blade with one state, its contact, a rotor speed and a cutting stiffness."""

    frequency: np.ndarray
    damping: np.ndarray
    shape: np.ndarray
    weights: np.ndarray
    arcs: np.ndarray  # none in permanent contact
    speed: float
    ke: float

    @property
    def nodes(self) -> tuple[str, ...]:
        return tuple(f"node {k}" for k in range(len(self.weights)))

    @property
    def blade(self) -> Blade:
        return Blade("any", self.nodes, self.damping, [ModalState(0.0, self.frequency, self.shape)])

    @property
    def contact(self) -> ContactConfiguration:
        weights = dict(zip(self.nodes, self.weights.tolist(), strict=True))
        return ContactConfiguration(weights, self.arcs.tolist() or None)

    @property
    def problem(self) -> RubbingBlade:
        return RubbingBlade.from_blade(self.blade, self.contact, self.speed, self.ke)


@st.composite
def rubs(draw: st.DrawFn) -> Rub:
    """One to four modes at one to four nodes, κ = 1e-3 to 0.3, up to three arcs or permanent contact."""
    n, r = draw(st.integers(1, 4)), draw(st.integers(1, 4))

    def several(low: float, high: float, count: int) -> np.ndarray:
        return np.array(draw(st.lists(st.floats(low, high), min_size=count, max_size=count)))

    frequency = 100.0 * np.cumprod(np.r_[1.0, several(1.1, 3.0, n - 1)])
    shape = several(-8.0, 8.0, n * r).reshape(n, r)
    shape[np.abs(shape) < 0.1] = 0.1  # every mode moves the tip, or its chatter has no frequency there
    weights = several(0.3, 1.0, r)
    cuts = 2 * draw(st.integers(0, 3))
    edges = draw(st.lists(st.integers(0, 63), min_size=cuts, max_size=cuts, unique=True))
    kappa = 10 ** draw(st.floats(-3.0, -0.5))
    return Rub(
        frequency,
        10 ** several(-3.0, -2.0, n),
        shape,
        weights,
        np.sort(edges).reshape(-1, 2) / 64,
        100.0 * draw(st.floats(0.15, 0.8)),
        kappa / ((shape**2 @ weights) / (2 * np.pi * frequency) ** 2).max(),
    )


def signs_of_modes(rub: Rub, rng: np.random.Generator) -> Rub:
    return replace(rub, shape=rub.shape * rng.choice([-1.0, 1.0], (len(rub.shape), 1)))


def order_of_nodes(rub: Rub, rng: np.random.Generator) -> Rub:
    order = rng.permutation(len(rub.weights))
    return replace(rub, shape=rub.shape[:, order], weights=rub.weights[order])


def order_of_modes(rub: Rub, rng: np.random.Generator) -> Rub:
    order = rng.permutation(len(rub.frequency))
    return replace(rub, frequency=rub.frequency[order], damping=rub.damping[order], shape=rub.shape[order])


def one_node_in_two_of_half_its_weight(rub: Rub, rng: np.random.Generator) -> Rub:
    k = int(rng.integers(len(rub.weights)))
    weights = rub.weights.copy()
    weights[k] /= 2
    return replace(rub, shape=np.c_[rub.shape, rub.shape[:, k]], weights=np.r_[weights, weights[k]])


def start_of_the_revolution(rub: Rub, rng: np.random.Generator) -> Rub:
    start = (rub.arcs[:, 0] + rng.uniform()) % 1.0
    arcs = np.c_[start, start + np.diff(rub.arcs)[:, 0]]
    return replace(rub, arcs=arcs[np.argsort(start)])


def unit_of_time(rub: Rub, rng: np.random.Generator) -> Rub:
    s = 10 ** rng.uniform(-2, 2)
    return replace(rub, frequency=s * rub.frequency, speed=s * rub.speed, ke=s**2 * rub.ke)


def unit_of_mass(rub: Rub, rng: np.random.Generator) -> Rub:
    s = 10 ** rng.uniform(-2, 2)
    return replace(rub, shape=s * rub.shape, ke=rub.ke / s**2)


CHANGES = [
    signs_of_modes,
    order_of_nodes,
    order_of_modes,
    one_node_in_two_of_half_its_weight,
    start_of_the_revolution,
    unit_of_time,
    unit_of_mass,
]


def check_same_point(here: StabilitySolution, there: StabilitySolution, time: float) -> None:
    assert here.stable == there.stable
    assert here.unstable_multipliers == there.unstable_multipliers
    assert np.isfinite(here.error_estimate) and np.isfinite(there.error_estimate)
    assert here.spectral_radius == pytest.approx(there.spectral_radius, rel=1e-8)
    assert time * here.chatter_hz == pytest.approx(there.chatter_hz, rel=1e-7)


def check_same_boundary(here: BoundarySolution, there: BoundarySolution, time: float, force: float) -> None:
    assert np.isfinite(here.error_estimate[0]) and np.isfinite(there.error_estimate[0])
    np.testing.assert_allclose(force * here.critical_ke, there.critical_ke, rtol=1e-7)
    np.testing.assert_allclose(time * here.chatter_hz, there.chatter_hz, rtol=1e-7)
    assert len(here.unstable_ke[0]) == len(there.unstable_ke[0])
    np.testing.assert_allclose(
        force * np.ravel(here.unstable_ke[0]), np.ravel(there.unstable_ke[0]), rtol=1e-7
    )


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
def test_what_describes_the_same_blade_gets_the_same_answers(change):
    # Shrinking a case of a few modes and arcs takes longer than it helps.
    @settings(
        max_examples=EXAMPLES,
        deadline=None,
        phases=set(Phase) - {Phase.shrink},
        suppress_health_check=[HealthCheck.too_slow],
    )
    @given(rub=rubs(), seed=st.integers(0, 99))
    def same(rub: Rub, seed: int) -> None:
        other = change(rub, np.random.default_rng(seed))
        time, force = other.speed / rub.speed, other.ke / rub.ke
        check_same_point(stability(rub.problem), stability(other.problem), time)
        batch = batch_multipliers([rub.problem, other.problem])
        assert batch.stable[0] == batch.stable[1] and batch.outside[0] == batch.outside[1]
        assert abs(batch.multiplier[0]) == pytest.approx(abs(batch.multiplier[1]), rel=1e-8)
        edges = [boundary(r.blade, r.contact, np.array([r.speed]), 5 * r.ke) for r in (rub, other)]
        check_same_boundary(*edges, time, force)

    same()


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

"""At the edge of what may be asked: the right answer, or an error that says what to ask instead."""

import time

import numpy as np
import pytest

from sdm_core.blade import Blade, ModalState
from sdm_core.boundary import BoundarySolution, boundary, verdicts
from sdm_core.collocation import Collocation
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import Cancelled, InvalidInput
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.floquet.characteristic import CharacteristicEquation
from sdm_core.interruption import interruptible
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.stability import StabilitySolution, stability

TWO_ARCS = [[0.1, 0.3], [0.55, 0.8]]
NODES = ("LE", "MID", "TE")
SPEED = 61.0  # both modes of `two_modes` chatter at some K_e
both_contacts = pytest.mark.parametrize("arcs", [None, TWO_ARCS], ids=["permanent", "arcs"])


def blade_of(frequency: list[float], damping: float | list[float], shape: list[list[float]]) -> Blade:
    return Blade("edge", NODES[: len(shape[0])], damping, [ModalState(0.0, frequency, shape)])


def two_modes(damping: float | list[float] = 2e-3) -> Blade:
    return blade_of([100.0, 262.0], damping, [[2.0, 1.0], [1.0, -2.0]])


def one_mode(amplitude: float = 2.0) -> Blade:
    return blade_of([100.0], 2e-3, [[amplitude]])


def contact_of(blade: Blade, arcs: list[list[float]] | None) -> ContactConfiguration:
    return ContactConfiguration.at(*blade.tip_nodes, arcs=arcs)


def problem_of(blade: Blade, arcs: list[list[float]] | None, speed: float, ke: float) -> RubbingBlade:
    return RubbingBlade.from_blade(blade, contact_of(blade, arcs), speed, ke)


def at(blade: Blade, arcs: list[list[float]] | None, speed: float, ke: float) -> StabilitySolution:
    """The front door's answer, which a batch and a verdict must share."""
    problem = problem_of(blade, arcs, speed, ke)
    found, batch = stability(problem), batch_multipliers([problem])
    assert np.isfinite(found.error_estimate)
    assert abs(batch.multiplier[0]) == pytest.approx(found.spectral_radius, rel=1e-9)
    verdict = verdicts(blade, contact_of(blade, arcs), np.array([speed]), np.array([ke]))[0]
    assert found.stable == bool(batch.stable[0]) == bool(verdict)
    return found


def edge_of(blade: Blade, arcs: list[list[float]] | None, speed: float, ke_max: float) -> BoundarySolution:
    """The boundary at one speed, proven."""
    found = boundary(blade, contact_of(blade, arcs), np.array([speed]), ke_max)
    assert np.isfinite(found.error_estimate[0])
    return found


def collocated(problem: RubbingBlade, count: int = 2) -> np.ndarray:
    return np.abs(Collocation().multipliers(problem, count))


def check_same_edges(here: BoundarySolution, there: BoundarySolution, rtol: float = 1e-9) -> None:
    np.testing.assert_allclose(here.unstable_ke[0], there.unstable_ke[0], rtol=rtol)
    np.testing.assert_allclose(here.critical_ke, there.critical_ke, rtol=rtol)
    np.testing.assert_allclose(here.chatter_hz, there.chatter_hz, rtol=rtol)


@both_contacts
@pytest.mark.parametrize("speed", [SPEED, 70.0], ids=["excited", "not excited"])
def test_a_mode_without_damping_is_the_limit_of_little_damping(arcs, speed):
    # Where the first mode is excited K_e vanishes with its damping, elsewhere it has a limit.
    damped = [edge_of(two_modes([xi, 2e-3]), arcs, speed, 1e5).critical_ke[0] for xi in (1e-6, 1e-7)]
    undamped = edge_of(two_modes([0.0, 2e-3]), arcs, speed, 1e5).critical_ke[0]
    if speed == SPEED:
        assert damped[0] == pytest.approx(10 * damped[1], rel=1e-3)
        assert undamped < 0.2 * damped[1]
    else:
        assert undamped == pytest.approx(damped[1], rel=1e-6)
    for ke in (1.0, 1e4):
        radius = [at(two_modes([xi, 2e-3]), arcs, speed, ke).spectral_radius for xi in (1e-6, 1e-7, 0.0)]
        assert abs(radius[2] - radius[1]) < 0.2 * abs(radius[1] - radius[0])
        assert collocated(problem_of(two_modes([0.0, 2e-3]), arcs, speed, ke))[0] == pytest.approx(radius[2])


@both_contacts
def test_a_node_that_does_not_move_cannot_destabilise_and_does_not_matter_beside_another(arcs):
    still = blade_of([100.0, 262.0], 2e-3, [[0.0], [0.0]])
    alone = at(still, arcs, SPEED, 1e3)
    assert alone.stable and alone.unstable_multipliers == 0 and np.isnan(alone.chatter_hz)
    assert alone.spectral_radius == pytest.approx(np.exp(-2e-3 * 2 * np.pi * 100.0 / SPEED), rel=1e-12)
    none = edge_of(still, arcs, SPEED, 1e9)
    assert np.isnan(none.critical_ke[0]) and np.isnan(none.chatter_hz[0])
    assert none.unstable_ke == ((),) and none.error_estimate[0] == 0
    beside = blade_of([100.0, 262.0], 2e-3, [[2.0, 0.0], [1.0, 0.0]])
    without = blade_of([100.0, 262.0], 2e-3, [[2.0], [1.0]])
    check_same_edges(edge_of(beside, arcs, SPEED, 1e5), edge_of(without, arcs, SPEED, 1e5))
    here, there = at(beside, arcs, SPEED, 1e4), at(without, arcs, SPEED, 1e4)
    assert here.multiplier == pytest.approx(there.multiplier, rel=1e-10)
    assert here.chatter_hz == pytest.approx(there.chatter_hz, rel=1e-10)


@both_contacts
@pytest.mark.parametrize(
    "shape",
    [
        [[2.0, 1.0], [2.0, 1.0]],  # equal
        [[2.0, 1.0], [-4.0, -2.0]],  # proportional
        [[2.0, 1.0], [1.0, -1.0]],
        [[2.0, 0.0], [0.0, 2.0]],  # two blades in one: every multiplier is double
    ],
)
def test_modes_of_one_frequency_are_the_modes_of_their_contact_matrix(arcs, shape):
    # With equal Λ and ξ any rotation of the modes is as good: that to the axes of G uncouples them.
    blade = blade_of([100.0, 100.0], 2e-3, shape)
    gain = np.linalg.eigvalsh(np.array(shape) @ np.array(shape).T)
    apart = [one_mode(np.sqrt(max(g, 0.0))) for g in gain]
    first = edge_of(apart[1], arcs, SPEED, 1e4)
    found = edge_of(blade, arcs, SPEED, 1e4)
    check_same_edges(found, first, rtol=max(1e-9, found.error_estimate[0]))
    for ke in (0.0, 0.7 * first.critical_ke[0], 1e4):
        whole, parts = at(blade, arcs, SPEED, ke), [at(part, arcs, SPEED, ke) for part in apart]
        assert whole.spectral_radius == pytest.approx(max(p.spectral_radius for p in parts), rel=1e-9)
        assert whole.unstable_multipliers == sum(p.unstable_multipliers for p in parts)


@both_contacts
@pytest.mark.parametrize("speed", [0.5, 500.0], ids=["0.005 of the first frequency", "5 times"])
def test_very_slow_and_very_fast_rotors(arcs, speed):
    found = edge_of(two_modes(), arcs, speed, 1e5)
    ke = found.critical_ke[0]
    for factor, count in ((1 - 1e-6, 0), (1 + 1e-6, 2)):
        problem = problem_of(two_modes(), arcs, speed, ke * factor)
        assert CharacteristicEquation(problem).count_outside() == count
        assert np.count_nonzero(collocated(problem) > 1) == count
        assert at(two_modes(), arcs, speed, ke * factor).stable is (count == 0)


@both_contacts
@pytest.mark.parametrize("blade", [two_modes(), blade_of([100.0, 100.0], 2e-3, [[2.0, 1.0], [1.0, -1.0]])])
def test_without_cutting_stiffness_modes_only_decay(arcs, blade):
    free = at(blade, arcs, SPEED, 0.0)
    assert free.stable and free.unstable_multipliers == 0
    assert free.spectral_radius == pytest.approx(np.exp(-2e-3 * 2 * np.pi * 100.0 / SPEED), rel=1e-10)
    assert free.chatter_hz == pytest.approx(100.0 * np.sqrt(1 - 4e-6), rel=1e-9)


@pytest.mark.parametrize(
    "arcs", [[[0.0, 1.0]], [[0.3, 1.3]], [[0.0, 0.5], [0.5, 1.0]], [[0.2, 0.5], [0.5, 1.2]]]
)
def test_arcs_that_fill_the_circle_are_permanent_contact(arcs):
    assert contact_of(two_modes(), arcs).permanent
    full, permanent = (edge_of(two_modes(), a, SPEED, 1e5) for a in (arcs, None))
    check_same_edges(full, permanent)
    assert full.method == permanent.method
    here, there = at(two_modes(), arcs, SPEED, 1e3), at(two_modes(), None, SPEED, 1e3)
    assert here.multiplier == there.multiplier and here.chatter_hz == there.chatter_hz


@pytest.mark.parametrize(
    ("arcs", "same"),
    [
        ([[0.3, 0.45], [0.45, 0.6]], [[0.3, 0.6]]),
        ([[0.0, 0.1], [0.7, 1.0]], [[0.7, 1.1]]),
        ([[0.0, 0.2], [0.2, 0.3], [0.3, 0.4]], [[0.0, 0.4]]),
    ],
)
def test_arcs_that_meet_are_one(arcs, same):
    check_same_edges(edge_of(two_modes(), arcs, SPEED, 1e5), edge_of(two_modes(), same, SPEED, 1e5))
    here, there = at(two_modes(), arcs, SPEED, 1e3), at(two_modes(), same, SPEED, 1e3)
    assert here.multiplier == pytest.approx(there.multiplier, rel=1e-11)


@pytest.mark.parametrize(
    ("arcs", "field", "remedy"),
    [
        ([[0.1, 0.2], [0.15, 0.3]], "contact.arcs[1]", "start it at or after 0.2"),
        ([[0.5, 1.5], [0.6, 0.7]], "contact.arcs[1]", "start it at or after 1.5"),
        ([[0.0, 0.1], [0.7, 1.05]], "contact.arcs[1]", "end it by 1: past 1 it overlaps the first arc"),
        ([[0.7, 1.0], [0.0, 0.1]], "contact.arcs[1]", "sort the arcs by their start"),
        ([[0.0, 1.0001]], "contact.arcs[0][1]", "up to 1 revolutions"),
    ],
)
def test_arcs_that_overlap_are_refused(arcs, field, remedy):
    with pytest.raises(InvalidInput) as refused:
        boundary(two_modes(), contact_of(two_modes(), arcs), np.array([SPEED]), 1e5)
    assert refused.value.field == field and refused.value.value and remedy in refused.value.remedy


@pytest.mark.parametrize("width", [1e-6, 1e-9, 1e-11])
def test_an_arc_of_hardly_any_width_acts_by_its_width_times_stiffness(width):
    # λτ = λ₀τ + w K_e G (e^{−λ₀τ} − 1)τ/(2iω_d) to first order. From 0 on, so that w is not rounded.
    omega = 2 * np.pi * 100.0
    damped = omega * np.sqrt(1 - 4e-6)
    root = -2e-3 * omega + 1j * damped
    blade, arcs = one_mode(), [[0.0, width]]
    push = 4.0 * np.expm1(-root / SPEED) / (2j * damped) / SPEED
    free = root / SPEED
    for load in (0.0, 0.1, 10.0):
        found, change = at(blade, arcs, SPEED, load / width), load * push
        assert abs(np.log(found.spectral_radius) - (free + change).real) < 1e-13 + 5 * abs(change) ** 2
    # A kick once a revolution, however it is spread: K_e w has a limit.
    kick, wide = (edge_of(blade, [[0.0, w]], SPEED, 1e3 / w) for w in (width, 1e-4))
    assert width * kick.critical_ke[0] == pytest.approx(1e-4 * wide.critical_ke[0], rel=1e-3)
    for factor, count in ((1 - 1e-6, 0), (1 + 1e-6, 2)):
        problem = problem_of(blade, arcs, SPEED, kick.critical_ke[0] * factor)
        assert np.count_nonzero(collocated(problem) > 1) == count


@both_contacts
def test_a_thousand_times_the_critical_stiffness(arcs):
    near = edge_of(two_modes(), arcs, SPEED, 2e3)
    ke = 1e3 * near.critical_ke[0]
    far = edge_of(two_modes(), arcs, SPEED, ke)
    assert far.critical_ke[0] == pytest.approx(near.critical_ke[0], rel=1e-10)
    assert far.unstable_ke[0][-1][1] == pytest.approx(ke)
    found = at(two_modes(), arcs, SPEED, ke)
    reference = collocated(problem_of(two_modes(), arcs, SPEED, ke), 40)
    assert found.stable is False
    assert found.spectral_radius == pytest.approx(reference[0], rel=1e-8)
    assert found.unstable_multipliers == np.count_nonzero(reference > 1)
    assert at(two_modes(), arcs, SPEED, 10 * ke).stable is False


def test_a_boundary_is_proven_and_soon_there_whatever_the_largest_stiffness():
    started = time.monotonic()

    def stop() -> None:
        if time.monotonic() - started > 2.0:
            raise Cancelled("too slow")

    near = edge_of(two_modes(), TWO_ARCS, SPEED, 2e3)
    with interruptible(stop):
        far = edge_of(two_modes(), TWO_ARCS, SPEED, 1e9)
    assert far.critical_ke[0] == pytest.approx(near.critical_ke[0], rel=1e-10)


def test_a_first_crossing_far_below_the_largest_stiffness_is_not_passed_over():
    blade, arcs = one_mode(1e5), [[0.25, 0.25 + 1e-7]]
    near = edge_of(blade, arcs, 500.0, 1e6)
    far = edge_of(blade, arcs, 500.0, 1e12)
    assert far.critical_ke[0] == pytest.approx(near.critical_ke[0], rel=1e-6)


@both_contacts
def test_a_dominant_mode_that_does_not_move_the_contact_has_no_chatter_frequency(arcs):
    blade = blade_of([100.0, 150.0], [5e-3, 1e-3], [[2.0], [0.0]])
    found = at(blade, arcs, 32.0, 100.0)
    assert found.spectral_radius == pytest.approx(np.exp(-1e-3 * 2 * np.pi * 150.0 / 32.0), rel=1e-10)
    assert np.isnan(found.chatter_hz)

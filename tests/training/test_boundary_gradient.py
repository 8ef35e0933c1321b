"""Design gradients of the surrogate: its differences, the exact core's where it is exact, and who answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from sdm_core.blade import Blade, ModalState
from sdm_core.blade_sensitivity import critical_ke_sensitivities, influences_of
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.fourier_engagement import FourierEngagement
from sdm_core.rubbing_blade import RubbingBlade
from training.answers import (
    CONFIDENT,
    EXACT,
    NEAR_BOUNDARY,
    OUT_OF_DOMAIN,
    REQUESTED,
    SURROGATE,
    UNSURE_SLOPE,
)
from training.boundary_gradient import boundary_gradients
from training.cases import CaseBatch
from training.certificate import Certificate, CertifiedBand
from training.contact_class import ARCS, PERMANENT
from training.design_space import DesignSpace
from training.reference_space import reference_points
from training.registry import Model
from training.screening import Screener
from training.surrogate import Architecture, BoundaryNetwork, Surrogate

TWO_ARCS = [[0.1, 0.35], [0.6, 0.75]]
PERMANENT_LE = ContactConfiguration({"LE": 1.0, "TE": 0.4})
ARCS_LE = ContactConfiguration({"LE": 1.0, "TE": 0.4}, TWO_ARCS)


def surrogate(size: float, seed: int = 3) -> Surrogate:
    """A network with random corrections, in log10 K_e of about this size, that is sure of itself."""
    torch.manual_seed(seed)
    architecture = Architecture(width=32, blocks=1)
    network = BoundaryNetwork(architecture)
    with torch.no_grad():
        network.last.weight *= size
        network.last.weight[1] = 0.0
        network.last.bias[:] = torch.tensor([0.0, -6.0])
    return Surrogate(network, architecture)


def screener(size: float) -> Screener:
    lines = (CertifiedBand(5e-4, 10.0, 0, 1000, 0.01, 0.0),)
    certificates = tuple(Certificate("test", c, 0.95, 0, 1000, lines, (10.0,)) for c in (PERMANENT, ARCS))
    return Screener(Model("test", surrogate(size), DesignSpace(), certificates, {}))


def crossing_modes() -> Blade:
    """Three modes, of which the second overtakes the third as the blade spins up."""
    shapes = [[2.0, 1.0], [-1.5, 2.5], [0.6, -1.1]]
    at_rest, spinning = ModalState(0.0, [200.0, 500.0, 640.0], shapes), [230.0, 700.0, 650.0]
    return Blade(
        "crossing", ("LE", "TE"), [1e-3, 2e-3, 1.5e-3], [at_rest, ModalState(90.0, spinning, shapes)]
    )


def changed(
    blade: Blade, contact: ContactConfiguration, speed_hz: float, parameter: str = "", by: float = 0.0
) -> tuple[Blade, ContactConfiguration, float]:
    """The same with its modal data frozen and one parameter of `influences_of` moved."""
    omega, shapes = blade.at_speeds(np.array([speed_hz]))
    frequency, shape = omega[0] / (2 * np.pi), shapes[0].copy()
    damping, weights, arcs = blade.damping_ratio.copy(), dict(contact.weights), contact.arcs
    match parameter.split():
        case ["frequency", "of", "mode", j]:
            frequency[int(j) - 1] += by
        case ["damping", "of", "mode", j]:
            damping[int(j) - 1] += by
        case ["amplitude", "of", "mode", j, "at", node]:
            shape[int(j) - 1, blade.tip_nodes.index(node)] += by
        case ["weight", "of", node]:
            weights[node] += by
        case ["rotor", "speed,", *_]:
            speed_hz += by
        case [edge, "of", "arc", i]:
            moved = [list(arc) for arc in arcs]
            moved[int(i) - 1][edge == "end"] += by
            arcs = moved
    state = ModalState(0.0, frequency, shape)
    return Blade("moved", blade.tip_nodes, damping, [state]), ContactConfiguration(weights, arcs), speed_hz


def predicted_ke(network: Surrogate, blade: Blade, contact: ContactConfiguration, speed_hz: float) -> float:
    return float(10 ** network.boundary(CaseBatch.from_blade(blade, contact, np.array([speed_hz]))).log_ke[0])


@pytest.mark.parametrize("contact", [PERMANENT_LE, ARCS_LE], ids=["permanent", "arcs"])
@pytest.mark.parametrize("speed_hz", [43.0, 83.0])
def test_gradient_is_that_of_the_predicted_boundary_parameter_by_parameter(contact, speed_hz):
    network, blade = surrogate(0.3), crossing_modes()
    found = boundary_gradients(network, blade, contact, np.array([speed_hz]))
    here = predicted_ke(network, *changed(blade, contact, speed_hz))
    assert found.critical_ke[0] == pytest.approx(here, rel=1e-5)
    assert found.learned_share[0] > 0.02  # or this would be a test of the lobes alone
    problem = RubbingBlade.from_blade(blade, contact, speed_hz, 0.0)
    rows = influences_of(problem, blade, contact, found.gradients[0], found.critical_ke[0])
    for row in rows:
        if row.parameter == "rotor speed":  # moves the modal data too
            continue
        reference = 1.0 if row.unit == "revolutions" else row.value
        step = 3e-4 * reference  # no smaller: the network is of single precision
        above, below = (
            predicted_ke(network, *changed(blade, contact, speed_hz, row.parameter, s * step))
            for s in (1, -1)
        )
        numeric = np.log(above / below) / (2 * step) * reference
        assert row.relative == pytest.approx(numeric, rel=0.01, abs=5e-3), row.parameter


@pytest.mark.parametrize("contact", [PERMANENT, ARCS])
def test_of_one_mode_without_correction_the_gradient_is_the_exact_core_s(contact):
    points = [p for p in reference_points(200, 11, contact) if len(p.frequency_hz) == 1][:25]
    assert len(points) == 25
    for point in points:
        blade, touching = point.blade(), point.contact()
        ke_max = 2.0 * float(point.case().stiffness_scale[0])
        exact = critical_ke_sensitivities(blade, touching, point.speed_hz, ke_max)
        found = boundary_gradients(surrogate(0.0), blade, touching, np.array([point.speed_hz]))
        problem = RubbingBlade.from_blade(blade, touching, point.speed_hz, 0.0)
        rows = influences_of(problem, blade, touching, found.gradients[0], found.critical_ke[0])
        assert [r.parameter for r in rows] == [r.parameter for r in exact.influences]
        ours, theirs = (np.array([r.relative for r in each]) for each in (rows, exact.influences))
        assert np.linalg.norm(ours - theirs) < 1e-4 * np.linalg.norm(theirs)
        assert found.learned_share[0] == 0.0


def test_each_edge_of_arcs_that_touch_has_its_own_derivative():
    blade = Blade("one", ("LE",), 2e-3, [ModalState(0.0, [100.0], [[1.5]])])
    touching = ContactConfiguration.at("LE", arcs=[[0.1, 0.3], [0.3, 0.6]])
    exact = critical_ke_sensitivities(blade, touching, 31.0, 1e6).gradient.arcs
    found = boundary_gradients(surrogate(0.0), blade, touching, np.array([31.0])).gradients[0].arcs
    np.testing.assert_allclose(found, exact, rtol=1e-4)
    assert abs(exact[0, 1]) > 0 and exact[0, 1] == pytest.approx(-exact[1, 0])


ONE_MODE = Blade("one", ("LE", "TE"), 2e-3, [ModalState(0.0, [100.0], [[1.5, 0.7]])])


@pytest.mark.parametrize("contact", [PERMANENT_LE, ARCS_LE], ids=["permanent", "arcs"])
def test_surrogate_and_exact_core_answer_in_one_form(contact):
    speed = np.array([31.0, 22.0])
    found = screener(0.0).sensitivities(ONE_MODE, contact, speed, 1e6)
    exact = screener(0.0).sensitivities(ONE_MODE, contact, speed, 1e6, "exact")
    assert list(found.source) == [SURROGATE] * 2 and list(found.reason) == [CONFIDENT] * 2
    assert list(exact.source) == [EXACT] * 2 and list(exact.reason) == [REQUESTED] * 2
    assert found.parameter == exact.parameter and found.unit == exact.unit
    np.testing.assert_array_equal(found.value, exact.value)
    for a, b in zip(found.relative, exact.relative, strict=True):
        assert np.linalg.norm(a - b) < 1e-4 * np.linalg.norm(b)
    np.testing.assert_allclose(found.critical_ke, exact.critical_ke, rtol=1e-6)
    assert found.certificate.alpha == 5e-4 and exact.certificate is None
    core = critical_ke_sensitivities(ONE_MODE, contact, 22.0, 1e6)
    assert exact.influences(1) == core.influences
    assert exact.chatter_hz[1] == core.chatter_hz


def test_without_a_crossing_there_is_no_gradient_and_no_error():
    for policy in ("auto", "surrogate", "exact"):
        found = screener(0.0).sensitivities(ONE_MODE, PERMANENT_LE, np.array([31.0, 22.0]), 1.0, policy)
        assert np.isnan(found.critical_ke).all() and np.isnan(found.relative).all()
        assert found.influences(0) is None
        assert np.isfinite(found.value).all() and "damping of mode 1" in found.parameter


def test_a_gradient_that_is_mostly_learned_is_asked_of_the_exact_core():
    speed = np.array([41.0, 60.0, 83.0])
    wild = screener(3.0)
    found = wild.sensitivities(crossing_modes(), ARCS_LE, speed, 1e6)
    assert (found.reason == UNSURE_SLOPE).any()
    assert (found.source[found.reason == UNSURE_SLOPE] == EXACT).all()
    exact = wild.sensitivities(crossing_modes(), ARCS_LE, speed, 1e6, "exact")
    i = int(np.argmax(found.reason == UNSURE_SLOPE))
    np.testing.assert_array_equal(found.relative[i], exact.relative[i])
    alone = wild.sensitivities(crossing_modes(), ARCS_LE, speed, 1e6, "surrogate")
    assert (alone.source == SURROGATE).all() and not np.allclose(
        alone.relative[i], exact.relative[i], rtol=0.05
    )


def test_a_gradient_where_two_lobes_are_equally_low_is_asked_of_the_exact_core():
    speed = np.linspace(24.9, 25.2, 600)  # two lobes of the one mode change places on the way
    found = screener(0.0).sensitivities(ONE_MODE, PERMANENT_LE, speed, 1e6)
    unsure = found.reason == UNSURE_SLOPE
    assert 0 < unsure.mean() < 0.2
    slope = found.relative[:, found.parameter.index("frequency of mode 1")]
    kink = int(np.argmax(np.abs(np.diff(slope))))
    assert slope[kink] < 0 < 100.0 < slope[kink + 1] and unsure[[kink, kink + 1]].any()
    np.testing.assert_array_equal(found.source == EXACT, unsure)


def test_where_a_boundary_is_asked_of_the_exact_core_so_is_its_gradient():
    unsure = screener(0.0)
    with torch.no_grad():
        unsure.model.surrogate.network.last.bias[1] = -1.0  # a spread of 2 %
    speed = np.array([31.0, 22.0, 2.0])
    for one in (unsure, screener(0.0)):
        boundary = one.boundary(ONE_MODE, PERMANENT_LE, speed, 1e6)
        found = one.sensitivities(ONE_MODE, PERMANENT_LE, speed, 1e6)
        np.testing.assert_array_equal(found.source, boundary.source)
        np.testing.assert_array_equal(found.reason, boundary.reason)
        assert found.reason[2] == OUT_OF_DOMAIN
        exact = found.source == EXACT
        np.testing.assert_allclose(found.critical_ke[exact], boundary.critical_ke[exact], rtol=1e-12)
    assert list(unsure.sensitivities(ONE_MODE, PERMANENT_LE, speed, 1e6).reason[:2]) == [NEAR_BOUNDARY] * 2


def test_what_has_no_gradient_or_lies_outside_the_domain_is_refused():
    one, speed = screener(0.0), np.array([31.0])
    smooth = ContactConfiguration.at("LE", engagement=FourierEngagement(0.5, [0.4]))
    for policy in ("auto", "exact", "surrogate"):
        with pytest.raises(InvalidInput, match=r"contact\.engagement"):
            one.sensitivities(ONE_MODE, smooth, speed, 1e6, policy)
    with pytest.raises(InvalidInput, match="speed/f1 outside"):
        one.sensitivities(ONE_MODE, PERMANENT_LE, np.array([31.0, 2.0]), 1e6, "surrogate")
    six = ModalState(0.0, 100.0 * 1.5 ** np.arange(6), np.ones((6, 2)))
    many = replace(ONE_MODE, damping_ratio=np.full(6, 2e-3), states=(six,))
    assert list(one.sensitivities(many, PERMANENT_LE, speed, 1e6).reason) == [OUT_OF_DOMAIN]
    with pytest.raises(InvalidInput, match="more than 5 modes"):
        one.sensitivities(many, PERMANENT_LE, speed, 1e6, "surrogate")
    with pytest.raises(InvalidInput, match="no model is loaded"):
        Screener(None).sensitivities(ONE_MODE, PERMANENT_LE, speed, 1e6)
    assert Screener(None).sensitivities(ONE_MODE, PERMANENT_LE, speed, 1e6, "exact").critical_ke[0] > 0

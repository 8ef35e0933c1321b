"""Derivatives of the critical K_e to the shape of a blade, against builders whose answer is known."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from named_problems import AT_TIP

from sdm_core.assessment.shape_gradient import shape_sensitivities
from sdm_core.blade import Blade, ModalState
from sdm_core.contact import ContactConfiguration
from sdm_core.contact_weights import chord_weights
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import least_critical_ke

RANGE = (15.0, 50.0)
NOMINAL = {"thickness": 0.004, "chord": 0.05, "lean": 0.1}
STEPS = {"thickness": 2e-5, "chord": 5e-4, "lean": 1e-2}
XI = 4e-3


def plate(p: Mapping[str, float]) -> Blade:
    """One mode of a cantilever plate: ω ∝ thickness, mass ∝ thickness·chord, contact amplitude ∝ cos lean."""
    frequency = 100.0 * p["thickness"] / 0.004
    amplitude = 2.0 * np.sqrt(0.004 * 0.05 / (p["thickness"] * p["chord"])) * np.cos(p["lean"])
    return Blade("plate", ("tip",), XI, [ModalState(0.0, [frequency], [[amplitude]])])


def exact(p: Mapping[str, float]) -> float:
    """Least K_e over all speeds, 2ξ(1 + ξ)ω²/G."""
    blade = plate(p)
    omega, shape = blade.at_speeds(np.array([20.0]))
    return float(2 * XI * (1 + XI) * omega[0, 0] ** 2 / shape[0, 0, 0] ** 2)


def test_derivatives_of_one_mode_are_those_of_its_closed_form():
    """K ∝ thickness³·chord/cos² lean: d ln K/d ln p is 3, 1 and 2·lean·tan lean."""
    found = shape_sensitivities(plate, NOMINAL, STEPS, AT_TIP, RANGE, 4 * exact(NOMINAL))
    lean = NOMINAL["lean"]
    for row, power in zip(found.parameters, (3.0, 1.0, 2 * lean * np.tan(lean)), strict=True):
        assert row.relative == pytest.approx(power, rel=1e-6)
        assert row.derivative == pytest.approx(power * found.ke / row.value, rel=1e-6)
        assert abs(row.derivative - power * found.ke / row.value) <= row.error_estimate + 1e-6 * abs(
            row.derivative
        )
    assert found.builds == 13


def test_parts_by_frequency_and_amplitude_add_up():
    found = shape_sensitivities(plate, NOMINAL, STEPS, AT_TIP, RANGE, 4 * exact(NOMINAL))
    thickness = found.parameters[0]
    scale = found.ke / thickness.value
    assert thickness.by_frequency == pytest.approx(2 * scale, rel=1e-6)
    assert thickness.by_mode_shape == pytest.approx(scale, rel=1e-6)
    assert thickness.by_damping == 0.0
    assert sum(
        (thickness.by_frequency, thickness.by_mode_shape, thickness.by_damping, thickness.by_weight)
    ) == pytest.approx(thickness.derivative)


def two_modes(p: Mapping[str, float]) -> Blade:
    """Modes that couple, stiffen, change damping, and swap signs and order with the parameters."""
    a, b = p["a"], p["b"]
    states = []
    for speed in (0.0, 40.0, 80.0):
        frequency = np.array([100.0 * (1 + 0.3 * a), 131.0 * (1 - 0.2 * a + 0.1 * b)])
        frequency = np.sqrt(frequency**2 + (1.5 + a) * speed**2)
        shape = np.array([[3.0 + a, 2.0 - b], [-1.5 + b, 3.5 + 0.5 * a]])
        states.append(ModalState(speed, frequency, shape * (-1) ** int(a > 0)))
    return Blade("two", ("LE", "TE"), [3e-3 * (1 + a), 5e-3], states)


@pytest.mark.parametrize("nodes", [("LE",), ("LE", "TE")])
def test_derivatives_follow_the_lobe_as_a_search_at_every_step_would(nodes):
    contact, parameters = ContactConfiguration.at(*nodes), {"a": 0.02, "b": -0.1}
    found = shape_sensitivities(two_modes, parameters, {"a": 1e-3, "b": 1e-3}, contact, (20.0, 60.0), 1e4)
    for row in found.parameters:
        step = 2e-3
        least = [
            least_critical_ke(
                two_modes({**parameters, row.parameter: row.value + s * step}),
                contact,
                20.0,
                60.0,
                1e4,
                tolerance=1e-10,
            )[0].ke
            for s in (1, -1)
        ]
        assert row.derivative == pytest.approx((least[0] - least[1]) / (2 * step), rel=2e-3)


def test_at_a_fixed_speed_derivatives_are_the_differences_of_the_crossing():
    from sdm_core.boundary import boundary

    parameters, speed = {"a": 0.02, "b": -0.1}, 33.0
    found = shape_sensitivities(
        two_modes, parameters, {"a": 1e-3, "b": 1e-3}, ContactConfiguration.at("LE"), speed, 1e6
    )
    assert found.tip is None
    for row in found.parameters:
        moved = [
            boundary(
                two_modes({**parameters, row.parameter: row.value + s}),
                ContactConfiguration.at("LE"),
                np.array([speed]),
                1e6,
            ).critical_ke[0]
            for s in (1e-5, -1e-5)
        ]
        assert row.derivative == pytest.approx((moved[0] - moved[1]) / 2e-5, rel=1e-5)


def test_modes_that_change_places_between_builds_are_told_by_their_shapes():
    """Mode 1 overtakes mode 2 within the step; only it touches, and K_e ∝ ω_1²."""

    def build(p: Mapping[str, float]) -> Blade:
        state = ModalState(0.0, [100.0 * (1 + p["x"]), 101.0], [[3.0, 0.1], [0.0, 3.0]])
        return Blade("b", ("LE", "TE"), [XI, 2 * XI], [state])

    found = shape_sensitivities(build, {"x": 0.0}, {"x": 0.02}, ContactConfiguration.at("LE"), RANGE, 1e4)
    assert found.parameters[0].derivative == pytest.approx(2 * found.ke, rel=1e-6)


def test_weights_that_follow_the_shape_count():
    """A tip twice as uneven: with weights from the chord, moving a node moves K_e though no mode does."""

    def build(p: Mapping[str, float]) -> Blade:
        return Blade(
            "b",
            ("LE", "MC", "TE"),
            XI,
            [ModalState(0.0, [100.0], [[1.0, 2.0, 4.0]])],
            tip_radius_m=[0.3] * 3,
            tip_z_m=[0.0, p["middle"], 0.04],
            tip_theta_rad=[0.0] * 3,
        )

    def weighted(blade: Blade) -> ContactConfiguration:
        return chord_weights(blade).contact()

    found = shape_sensitivities(build, {"middle": 0.02}, {"middle": 1e-4}, weighted, RANGE, 1e4)
    # w = 3/2·(m, L, L − m)/L, so G = 3/2·(m + 4L + 16(L − m))/L and dG/dm = −45/2L.
    strength = 1.5 * (0.02 + 4 * 0.04 + 16 * 0.02) / 0.04
    slope = -22.5 / 0.04
    assert found.parameters[0].relative == pytest.approx(-0.02 * slope / strength, rel=1e-6)
    assert found.parameters[0].by_weight == pytest.approx(found.parameters[0].derivative, rel=1e-9)
    still = shape_sensitivities(
        build, {"middle": 0.02}, {"middle": 1e-4}, ContactConfiguration.at("LE"), RANGE, 1e4
    )
    assert still.parameters[0].derivative == 0.0


def test_the_error_estimate_grows_with_the_step_and_covers_the_error():
    def cubic(p: Mapping[str, float]) -> Blade:
        return Blade("b", ("tip",), XI, [ModalState(0.0, [100.0 * np.exp(p["x"]) ** 3], [[2.0]])])

    errors = []
    for step in (0.02, 0.04):
        (row,) = shape_sensitivities(cubic, {"x": 0.0}, {"x": step}, AT_TIP, RANGE, 1e4).parameters
        found = shape_sensitivities(cubic, {"x": 0.0}, {"x": step}, AT_TIP, RANGE, 1e4)
        assert abs(row.derivative - 6 * found.ke) <= row.error_estimate
        errors.append(row.error_estimate)
    assert errors[1] / errors[0] == pytest.approx(4.0, rel=0.1)


def test_builds_that_do_not_match_and_steps_that_are_none_are_refused():
    def changing(p: Mapping[str, float]) -> Blade:
        modes = 2 if p["x"] > 0 else 1
        return Blade("b", ("tip",), XI, [ModalState(0.0, [100.0, 300.0][:modes], [[2.0], [1.0]][:modes])])

    with pytest.raises(InvalidInput, match=r"steps\.x"):
        shape_sensitivities(changing, {"x": 0.0}, {"x": 1.0}, AT_TIP, RANGE, 1e4)
    with pytest.raises(InvalidInput, match=r"steps\.thickness"):
        shape_sensitivities(plate, NOMINAL, {}, AT_TIP, RANGE, 1e4)
    with pytest.raises(InvalidInput, match=r"steps\.thickness"):
        shape_sensitivities(plate, NOMINAL, {**STEPS, "thickness": 0.0}, AT_TIP, RANGE, 1e4)
    with pytest.raises(InvalidInput, match="ke_max"):
        shape_sensitivities(plate, NOMINAL, STEPS, AT_TIP, RANGE, 1.0)

"""Clearance left from leading to trailing edge, and the vibration that uses it up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sdm_core.assessment.clearance import clearance_use
from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.errors import InvalidInput

NODES = ("LE", "MC", "TE")
# Grows with Ω², most at the trailing edge.
GROWTH = np.array([1.0, 1.5, 2.0]) * 1e-4 / 200.0**2
SPEEDS = (0.0, 150.0, 300.0)


def growing(amplitude: float = 2.0) -> Blade:
    """One mode: the tip moves 0.3, −0.4, 0 in contact direction, of a vector up to 1 long."""
    radial = np.array([[0.3, -0.4, 0.0]])
    tangential, axial = np.array([[0.4, 0.3, 0.6]]), np.array([[0.0, 0.5, 0.8]])
    states = [
        ModalState(
            speed,
            [100.0],
            amplitude * radial,
            mode_shape_radial=amplitude * radial,
            mode_shape_tangential=amplitude * tangential,
            mode_shape_axial=amplitude * axial,
            tip_growth_m=GROWTH * speed**2,
            untwist_rad=1e-7 * speed**2,
        )
        for speed in SPEEDS
    ]
    return Blade("growing", NODES, 1e-3, states, direction="radial")


def test_growth_in_the_square_of_speed_is_followed_between_the_states():
    found = clearance_use(growing(), (100.0, 290.0), 1e-3)
    for i, speed in enumerate(found.speed_hz):
        np.testing.assert_allclose(found.growth_m[i], GROWTH * speed**2, rtol=1e-12)
        assert found.untwist_rad[i] == pytest.approx(1e-7 * speed**2, rel=1e-12)
    np.testing.assert_allclose(found.running_clearance_m, 1e-3 - found.growth_m, rtol=1e-12)
    assert set(found.tightest) == {"TE"}
    assert found.missing == ()


def test_vibration_that_touches_is_clearance_over_displacement_per_millimetre():
    found = clearance_use(growing(), (100.0, 290.0), [1.0e-3, 1.2e-3, 0.9e-3])
    np.testing.assert_allclose(
        found.contact_per_tip[:, 0], np.tile([0.3, -0.4, 0.0], (len(found.speed_hz), 1))
    )
    gap = found.running_clearance_m
    np.testing.assert_allclose(found.touching_tip_m[:, 0, 0], gap[:, 0] / 0.3, rtol=1e-12)
    np.testing.assert_allclose(found.touching_tip_m[:, 0, 1], gap[:, 1] / 0.4, rtol=1e-12)
    assert np.isinf(found.touching_tip_m[:, 0, 2]).all()
    np.testing.assert_allclose(found.touching_coordinate[:, 0, 0], gap[:, 0] / 0.6, rtol=1e-12)


def test_displacement_per_millimetre_does_not_depend_on_how_modes_are_scaled():
    one, other = (clearance_use(growing(a), (100.0, 290.0), 1e-3) for a in (2.0, -7.0))
    np.testing.assert_allclose(np.abs(one.contact_per_tip), np.abs(other.contact_per_tip), rtol=1e-12)
    np.testing.assert_allclose(one.touching_tip_m, other.touching_tip_m, rtol=1e-12)


def test_a_tip_that_grows_through_the_gap_rubs_without_vibration_deepest_first():
    found = clearance_use(growing(), (250.0, 290.0), 1.6e-4)
    assert (found.running_clearance_m[-1] < 0).all()
    np.testing.assert_array_equal(found.touching_tip_m[-1], 0.0)
    assert found.first_to_touch[-1] == ("TE",)


def test_what_is_not_known_is_said_and_the_rest_is_answered():
    found = clearance_use(example_blade("generic_compressor_blade"), (60.0, 200.0), 4e-4)
    assert found.growth_m is None
    assert any("unsafe" in said for said in found.missing)
    assert any("upper bound" in said for said in found.missing)
    np.testing.assert_array_equal(found.running_clearance_m, 4e-4)
    nothing = clearance_use(example_blade("nasa_rotor_37"), (60.0, 200.0))
    assert nothing.running_clearance_m is None and nothing.touching_tip_m is None
    assert nothing.first_to_touch is None
    assert any(said.startswith("cold_clearance_m") for said in nothing.missing)


def test_less_known_of_the_motion_never_makes_a_blade_look_safer():
    full = growing()
    less = replace(full, states=[replace(s, mode_shape_axial=None) for s in full.states])
    known, unknown = (clearance_use(b, (100.0, 290.0), 1e-3) for b in (full, less))
    assert (unknown.touching_tip_m <= known.touching_tip_m * (1 + 1e-12)).all()


@pytest.mark.parametrize("bad", [-1e-4, [1e-4, 1e-4], "wide"])
def test_clearances_that_are_none_are_refused(bad):
    with pytest.raises(InvalidInput, match="cold_clearance_m"):
        clearance_use(growing(), (100.0, 290.0), bad)

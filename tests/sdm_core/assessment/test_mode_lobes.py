"""Each mode alone, and which mode a lobe of the whole blade belongs to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from named_problems import AT_TIP, benchmark_blade, one_mode

from sdm_core.assessment.mode_lobes import lobe_owners, mode_boundaries, mode_lobes
from sdm_core.assessment.mode_selection import mode_alone, with_modes
from sdm_core.assessment.single_mode import floor_ke, tip_phase
from sdm_core.blade import Blade, example_blade
from sdm_core.boundary import boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import least_critical_ke

LE = ContactConfiguration.at("LE")
RANGE = (60.0, 300.0)


@pytest.mark.parametrize("damping", [1e-3, 2e-2, 0.2])
def test_critical_stiffness_of_one_mode_is_two_xi_times_one_plus_xi(damping):
    blade = one_mode(damping, frequency_hz=100.0, amplitude=3.0)
    (found,) = mode_lobes(blade, AT_TIP, (15.0, 60.0), 1e9)
    exact = 2 * damping * (1 + damping) * (2 * np.pi * 100.0) ** 2 / 9.0
    assert found.floor_ke == pytest.approx(exact, rel=1e-12)
    assert found.critical_ke == pytest.approx(exact, rel=2e-4)


@pytest.mark.parametrize("damping", [1e-3, 2e-2, 0.2])
def test_tips_of_one_mode_lie_at_the_speeds_of_the_closed_form(damping):
    blade = one_mode(damping, frequency_hz=100.0, amplitude=3.0)
    (found,) = mode_lobes(blade, AT_TIP, (15.0, 60.0), 1e9)
    chatter = 100.0 * np.sqrt(1 + 2 * damping)
    for tip in found.tips[:3]:
        assert tip.chatter_hz == pytest.approx(chatter, rel=2e-3)
        assert tip.lobes_per_revolution % 1 == pytest.approx(float(tip_phase(damping)), abs=0.02)


def test_no_lobe_of_a_real_mode_reaches_below_its_floor():
    blade = example_blade("nasa_rotor_37")
    for found in mode_lobes(blade, LE, RANGE, 2.5e4):
        assert found.floor_ke is not None
        assert all(tip.ke >= found.floor_ke * (1 - 1e-9) for tip in found.tips)
        if found.tips:
            # A tip falls near the end of the range where the floor is least, to within one lobe.
            assert found.critical_ke == pytest.approx(found.floor_ke, rel=0.02)


def test_every_lobe_of_rotor_37_belongs_to_the_mode_without_which_it_is_gone():
    blade = example_blade("nasa_rotor_37")
    tips = least_critical_ke(blade, LE, *RANGE, 2.5e4, count=200)
    for owner in lobe_owners(blade, LE, tips, 5e4):
        assert sum(owner.participation) == pytest.approx(1.0, abs=1e-9)
        assert int(np.argmax(owner.participation)) + 1 == owner.mode
        assert owner.ke_without is None or owner.ke_without > 1.02 * owner.tip.ke


def test_participation_of_two_modes_is_that_of_the_scalar_receptance():
    """With one node λ = Σ φ_j²/D_j, and the share of a mode is its term's real part."""
    blade = benchmark_blade()
    tips = least_critical_ke(blade, AT_TIP, 0.1, 0.45, 5.0)
    for owner in lobe_owners(blade, AT_TIP, tips, 50.0):
        w = 2 * np.pi * owner.tip.chatter_hz
        natural = 2 * np.pi * np.array([1.0, 4.0])
        terms = (np.array([1.0, 0.64]) / (natural**2 - w**2 + 2j * 2e-3 * natural * w)).real
        assert owner.participation == pytest.approx(terms / terms.sum(), rel=1e-9)
        assert -0.5 / terms.sum() == pytest.approx(owner.tip.ke, rel=1e-6)


def test_a_mode_that_does_not_touch_has_neither_floor_nor_lobes():
    nothing = example_blade("nasa_rotor_37")
    shapes = [s.mode_shape.copy() for s in nothing.states]
    for shape in shapes:
        shape[1, 0] = 0.0
    states = [replace(s, mode_shape=shape) for s, shape in zip(nothing.states, shapes, strict=True)]
    still: Blade = replace(nothing, states=states)
    found = mode_lobes(still, LE, (200.0, 300.0), 2.5e4)
    assert found[1].floor_ke is None
    assert found[1].tips == ()
    assert 2 not in mode_boundaries(still, LE, np.linspace(200.0, 300.0, 50), 2.5e4)


def test_all_modes_kept_is_the_same_blade_and_one_dropped_is_not():
    blade = example_blade("nasa_rotor_37")
    speed = np.linspace(150.0, 300.0, 40)
    whole = boundary(blade, LE, speed, 2.5e4, truncation=False).critical_ke
    same = boundary(with_modes(blade, [1, 2, 3, 4, 5]), LE, speed, 2.5e4, truncation=False).critical_ke
    other = boundary(with_modes(blade, [1, 3, 4, 5]), LE, speed, 2.5e4, truncation=False).critical_ke
    np.testing.assert_array_equal(whole, same)
    # Near 242 Hz the second mode's lobe is by far the deepest.
    at = int(np.argmin(np.abs(speed - 242.0)))
    assert whole[at] < 1e4
    assert other[at] > 1.5 * whole[at]
    assert mode_alone(blade, 2).damping_ratio.shape == (1,)


def test_with_arcs_no_floor_is_claimed():
    found = mode_lobes(
        example_blade("generic_compressor_blade"),
        ContactConfiguration.at("LE", arcs=[(0.0, 0.5)]),
        (150.0, 200.0),
        1e5,
        count=1,
    )
    assert {mode.floor_ke for mode in found} == {None}


def test_floor_of_no_contact_is_infinite():
    assert np.isinf(floor_ke(1.0, 1e-3, 0.0))


@pytest.mark.parametrize("modes", [[], [0], [6], [1, 1], [1.5]])
def test_modes_a_blade_has_not_got_are_refused(modes):
    with pytest.raises(InvalidInput, match="modes"):
        with_modes(example_blade("nasa_rotor_37"), modes)

"""The damping with which a blade just stays stable."""

from __future__ import annotations

import numpy as np
import pytest

from sdm_core.assessment.needed_damping import LARGEST_DAMPING, needed_damping
from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput

LE = ContactConfiguration.at("LE")
ONE_MODE = Blade("one", ("LE",), 1e-3, [ModalState(0.0, [100.0], [[2.0]])])


@pytest.mark.parametrize("wanted", [0.02, 0.7, 1.0, 5.0, 60.0])
def test_of_one_mode_it_solves_two_xi_times_one_plus_xi(wanted):
    """K_e φ²/ω² = 2ξ(1 + ξ) is the least over all speeds (DESIGN, section 6)."""
    xi = 1e-3 * wanted
    ke = 2 * xi * (1 + xi) * (2 * np.pi * 100.0) ** 2 / 2.0**2
    found = needed_damping(ONE_MODE, LE, (8.0, 40.0), ke, tolerance=1e-4)
    assert found.factor == pytest.approx(wanted, rel=3e-4)
    assert ke <= found.worst.ke <= ke * (1 + 1e-4)


def test_the_blade_with_it_is_never_below_and_hardly_above():
    found = needed_damping(
        example_blade("nasa_rotor_37"), ContactConfiguration.at("LE", "TE"), (86.0, 300.0), 1.5e4
    )
    assert 1.5e4 <= found.worst.ke <= 1.5e4 * 1.001
    assert found.factor > 1 and found.worst_now.ke < 1.5e4
    assert np.allclose(found.damping_ratio, found.factor * 1e-3)


def test_a_stiffness_that_no_damping_reaches_is_refused():
    with pytest.raises(InvalidInput, match=f"damping ratios up to {LARGEST_DAMPING:g}"):
        needed_damping(ONE_MODE, LE, (8.0, 40.0), 5e6)


def test_a_blade_without_damping_is_refused():
    with pytest.raises(InvalidInput, match=r"blade\.damping_ratio"):
        needed_damping(Blade("b", ("LE",), 0.0, ONE_MODE.states), LE, (8.0, 40.0), 100.0)

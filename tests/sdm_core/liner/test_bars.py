"""The plastic bar: force against chip, unloading, and what the restart of hardening is for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdm_core.blade import Blade, ModalState
from sdm_core.time_domain.liner.abradable_liner import AbradableLiner
from sdm_core.time_domain.liner.casing import Casing
from sdm_core.time_domain.liner.central_differences import CentralDifferences
from sdm_core.time_domain.liner.liner_kernel import bar_force
from sdm_core.time_domain.liner.liner_rub import LinerRub
from sdm_core.time_domain.liner.simulation import simulate_rub

LINER = AbradableLiner(4e8, 2e5, 2e7, 5e-3, axial_width_m=3e-3, contact_length_m=1e-3)
SPRING, HARDENING, YIELD, _ = (float(part[0]) for part in LINER.bars(1))
KE = float(LINER.cutting_stiffness(LINER.bars(1))[0])
size = st.floats(0.0, 1e-3)


def test_cutting_stiffness_is_section_times_tangent_modulus_over_thickness():
    section, tangent = 3e-3 * 1e-3, 4e8 * 2e7 / (4e8 + 2e7)
    assert pytest.approx(section * tangent / 5e-3, rel=1e-14) == KE
    assert LINER.elastic_recovery == pytest.approx(tangent / 4e8)


def test_force_grows_with_the_chip_by_the_cutting_stiffness_once_the_bar_yields():
    elastic_limit = YIELD / SPRING
    for worn in (0.0, 3e-4):
        for beyond in (1e-6, 1e-5, 1e-4):
            force, yields = bar_force(
                worn + elastic_limit + beyond, 0.0, worn, worn, SPRING, HARDENING, YIELD
            )
            assert yields
            assert force == pytest.approx(YIELD + KE * beyond, rel=1e-12)


def test_unloading_is_elastic_and_ends_without_tension():
    deepest = 1e-4
    loaded, _ = bar_force(deepest, 0.0, 0.0, 0.0, SPRING, HARDENING, YIELD)
    worn = deepest - loaded / SPRING
    for back in (1e-7, 3e-7):
        force, yields = bar_force(deepest - back, 0.0, worn, 0.0, SPRING, HARDENING, YIELD)
        assert not yields
        assert force == pytest.approx(loaded - SPRING * back, rel=1e-9)
    assert bar_force(worn - 1e-9, 0.0, worn, 0.0, SPRING, HARDENING, YIELD) == (0.0, False)


@given(size, st.floats(0.0, 1e-4), size, size, st.floats(0.0, 1e6), st.floats(0.0, 50.0))
def test_the_corrected_force_lies_on_the_bars_own_curve(reach, give, worn, before, hardening, strength):
    fresh = min(worn, before)
    force, yields = bar_force(reach, give, worn, fresh, SPRING, hardening, strength)
    shortening = reach - give * force
    assert force >= 0.0
    scale = 1e-9 * (SPRING * 1e-3 + strength)
    if not yields:
        assert force == pytest.approx(max(SPRING * (shortening - worn), 0.0), abs=scale)
        assert force <= strength + hardening * (worn - fresh) + scale
    else:
        left = shortening - force / SPRING
        assert left >= worn - 1e-12
        assert force == pytest.approx(strength + hardening * (left - fresh), abs=scale)


def rigid_blade_under_feed(restarts: bool) -> np.ndarray:
    """Mean force of each revolution on a blade too stiff to give way, 2 µm of feed a revolution."""
    blade = Blade("rigid", ("tip",), 0.2, [ModalState(0.0, [200.0], [[1e-3]])])
    casing = Casing(0.25, 0.0, feed_per_revolution_m=2e-6)
    rub = LinerRub(blade, ("tip",), replace(LINER, hardening_restarts=restarts), casing)
    found = simulate_rub(rub, 50.0, 12, CentralDifferences(400, 4, 100))
    return np.array([found.force_n[found.of_revolution(q)].mean() for q in range(12)])


def test_with_hardening_restarted_a_steady_feed_takes_a_steady_force():
    # Each pass cuts what the feed brings: (1 − ε) of a chip of feed/(1 − ε), so F = Aσ_Y + (AK/L) feed.
    assert rigid_blade_under_feed(True)[6:] == pytest.approx(YIELD + HARDENING * 2e-6, rel=1e-6)


def test_with_hardening_accumulated_the_force_follows_the_total_depth_and_not_the_chip():
    force = rigid_blade_under_feed(False)
    assert np.diff(force)[6:] == pytest.approx(KE * 2e-6, rel=1e-6)

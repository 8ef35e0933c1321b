"""The proven floor of an uncertain family: exact for one mode, never above any blade's K_e."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from named_problems import AT_TIP, one_mode

from sdm_core.assessment.guaranteed_floor import _largest_flexibility, guaranteed_ke
from sdm_core.assessment.uncertain_blade import Factors, Uncertainty, first_crossings, problems_at
from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.lobe_tips import least_critical_ke

EXACT = Uncertainty((1.0, 1.0), (1.0, 1.0))


@pytest.mark.parametrize("damping", [1e-3, 3e-2, 0.4])
def test_of_one_mode_it_is_two_xi_times_one_plus_xi_at_the_worst_of_its_data(damping):
    blade = one_mode(damping, frequency_hz=100.0, amplitude=3.0)
    family = Uncertainty((0.5, 2.0), (0.9, 1.1), (0.8, 1.25))
    xi = 0.5 * damping
    worst = 2 * xi * (1 + xi) * (2 * np.pi * 90.0) ** 2 / (3.0 * 1.25) ** 2
    found = guaranteed_ke(blade, AT_TIP, (10.0, 60.0), family)
    assert found <= worst
    assert found == pytest.approx(worst, rel=1e-3)


def test_the_bound_holds_over_frequencies_and_intervals_of_chatter_frequency():
    """Against −Re 1/D by brute force, over what lies between two edges and inside the range of ω_j."""
    rng = np.random.default_rng(4)
    for _ in range(40):
        damping = 10 ** rng.uniform(-3.5, -0.4)
        low = rng.uniform(0.5, 2.0)
        high = low * (1 + rng.choice([0.0, 0.01, 0.3]))
        edges = np.geomspace(0.4, 5.0, 60)
        bound = _largest_flexibility(edges, low, high, damping)
        w = edges[:-1, None, None] + np.diff(edges)[:, None, None] * np.linspace(0, 1, 41)[:, None]
        t = np.linspace(low, high, 41)
        real = -(1.0 / (t**2 - w**2 + 2j * damping * t * w)).real
        assert (real.max(axis=(1, 2)) <= bound * (1 + 1e-12) + 1e-300).all()


@pytest.mark.parametrize("seed", range(6))
def test_no_blade_of_a_random_family_is_unstable_below_it(seed):
    rng = np.random.default_rng(seed)
    n, r = int(rng.integers(1, 5)), 3
    frequency = np.cumprod(np.r_[100.0, rng.uniform(1.05, 2.5, n - 1)])
    states = [
        ModalState(s, np.sqrt(frequency**2 + 2.0 * s**2), rng_shape * (1 + s / 500))
        for s, rng_shape in (
            (s, np.random.default_rng(seed + 50).normal(size=(n, r)) * 4) for s in (0.0, 60.0)
        )
    ]
    blade = Blade("random", ("a", "b", "c"), rng.uniform(5e-4, 2e-2, n), states)
    contact = ContactConfiguration({"a": 1.0, "b": 0.4, "c": 0.7})
    family = Uncertainty(amplitude=(0.9, 1.1))
    floor = guaranteed_ke(blade, contact, (15.0, 55.0), family)
    speed = 1 / np.linspace(1 / 55.0, 1 / 15.0, 80)
    for _ in range(12):
        factors = Factors(
            rng.choice([0.5, 1.0, 2.0], n), rng.uniform(0.97, 1.03, n), rng.uniform(0.9, 1.1, n)
        )
        first = first_crossings(problems_at(blade, contact, speed, factors), 2 * floor)
        assert not (first.critical_ke < floor).any()
        assert np.isfinite(first.error_estimate).all()


@pytest.mark.parametrize("node", ["LE", "TE"])
def test_of_real_blades_it_lies_close_below_the_least_stiffness_found(node):
    for name in ("nasa_rotor_37", "generic_compressor_blade"):
        blade, contact = example_blade(name), ContactConfiguration.at(node)
        high = blade.states[-1].speed_hz
        floor = guaranteed_ke(blade, contact, (60.0, high), EXACT)
        least = least_critical_ke(blade, contact, 60.0, high, 4 * floor, count=1)[0].ke
        assert 0.98 * least < floor <= least


def test_a_wider_family_is_guaranteed_less():
    blade, contact = example_blade("nasa_rotor_37"), ContactConfiguration.at("LE")
    families = [EXACT, Uncertainty((0.8, 1.2), (1.0, 1.0)), Uncertainty(), Uncertainty((0.3, 3.0))]
    floors = [guaranteed_ke(blade, contact, (60.0, 300.0), family) for family in families]
    assert floors == sorted(floors, reverse=True)


def test_nothing_is_guaranteed_where_contact_varies_round_the_casing():
    blade = example_blade("nasa_rotor_37")
    assert guaranteed_ke(blade, ContactConfiguration.at("LE", arcs=[(0, 0.5)]), (60.0, 300.0), EXACT) is None


def test_a_tip_that_does_not_move_is_safe_at_any_stiffness():
    still = one_mode(1e-3, amplitude=0.0)
    assert guaranteed_ke(still, AT_TIP, (0.1, 0.4), EXACT) == np.inf
    assert guaranteed_ke(replace(still, damping_ratio=0.1), AT_TIP, (0.1, 0.4), EXACT) == np.inf

"""Weights by quadrature along the chord: the same liner, however many nodes see it."""

from __future__ import annotations

import numpy as np
import pytest

from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.boundary import boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.contact_weights import arc_length, chord_weights
from sdm_core.errors import InvalidInput

CHORD, STAGGER, RADIUS = 0.06, np.radians(40.0), 0.35


def smooth_blade(r: int, power: float = 1.0) -> Blade:
    """Two modes that are smooth along a straight, staggered tip of r nodes; `power` packs them to one end."""
    t = np.linspace(0.0, 1.0, r) ** power
    shape = np.array([3.0 + 1.5 * t - 2.0 * t**2, 6.0 * np.cos(2.5 * t)])
    return Blade(
        "smooth",
        tuple(f"N{i}" for i in range(r)),
        2e-3,
        [ModalState(0.0, [100.0, 320.0], shape)],
        tip_radius_m=[RADIUS] * r,
        tip_z_m=(CHORD * np.cos(STAGGER) * t).tolist(),
        tip_theta_rad=(CHORD * np.sin(STAGGER) / RADIUS * t).tolist(),
    )


def least_per_length(r: int, rule: str | None, power: float = 1.0) -> float:
    """Least k′ over some speeds that destabilises, N/m per m; unit weights and K_e per node with no rule."""
    blade, speed = smooth_blade(r, power), np.linspace(22.0, 24.0, 9)
    if rule is None:
        return float(
            np.nanmin(boundary(blade, ContactConfiguration.at(*blade.tip_nodes), speed, 1e5).critical_ke)
        )
    weights = chord_weights(blade, rule)
    found = boundary(blade, weights.contact(), speed, 1e5)
    return weights.ke_per_length(float(np.nanmin(found.critical_ke)))


def test_weights_have_mean_one_and_shares_add_up_to_the_length():
    for rule, r in (("trapezoid", 7), ("simpson", 7), ("simpson", 8), ("trapezoid", 2)):
        weights = chord_weights(smooth_blade(r), rule)
        assert sum(weights.weights.values()) == pytest.approx(r, rel=1e-12)
        assert weights.share_m.sum() == pytest.approx(weights.length_m, rel=1e-12)


def test_stiffness_in_all_is_per_length_times_length_and_the_way_back_is_exact():
    weights = chord_weights(smooth_blade(9), "simpson")
    ke = weights.ke_per_node(4e5)
    assert ke * sum(weights.weights.values()) == pytest.approx(4e5 * weights.length_m, rel=1e-12)
    assert weights.ke_per_length(ke) == pytest.approx(4e5, rel=1e-14)
    assert f"{9 * ke:,.6g} N/m in all" in weights.described(ke)


def test_the_boundary_converges_as_nodes_are_added_and_with_unit_weights_it_runs_away():
    exact = least_per_length(129, "simpson")
    trapezoid = [abs(least_per_length(r, "trapezoid") / exact - 1) for r in (5, 9, 17)]
    assert trapezoid[0] / trapezoid[1] == pytest.approx(4.0, rel=0.15)
    assert trapezoid[1] / trapezoid[2] == pytest.approx(4.0, rel=0.1)
    simpson = [abs(least_per_length(r, "simpson") / exact - 1) for r in (5, 9, 17)]
    assert simpson[0] / simpson[1] > 12.0
    assert simpson[2] < 1e-5
    unit = [least_per_length(r, None) for r in (17, 33)]
    assert unit[0] / unit[1] == pytest.approx(33 / 17, rel=0.02)


def test_nodes_packed_to_one_end_see_the_same_liner():
    even, packed = least_per_length(33, "trapezoid"), least_per_length(33, "trapezoid", power=1.6)
    assert packed == pytest.approx(even, rel=1e-3)
    unit_even, unit_packed = least_per_length(33, None), least_per_length(33, None, power=1.6)
    assert abs(unit_packed / unit_even - 1) > 5e-3


def test_length_along_a_circle_converges_to_the_arc_and_not_to_its_chord():
    for r, tolerance in ((9, 1e-4), (33, 1e-6)):
        angle = np.linspace(0.0, 1.2, r)
        points = np.stack((np.cos(angle), np.sin(angle), np.zeros(r)), axis=1)
        assert arc_length(points)[-1] == pytest.approx(1.2, rel=tolerance)


def test_part_of_the_tip_can_be_in_contact():
    blade = smooth_blade(9)
    weights = chord_weights(blade, nodes=["N0", "N1", "N2", "N3", "N4"])
    assert weights.length_m == pytest.approx(CHORD / 2, rel=1e-4)
    assert set(weights.contact().weights) == {"N0", "N1", "N2", "N3", "N4"}


def test_what_has_no_length_is_refused_with_the_reason():
    with pytest.raises(InvalidInput, match=r"tip_theta_rad.*missing"):
        chord_weights(example_blade("nasa_rotor_37"))
    with pytest.raises(InvalidInput, match="needs a length"):
        chord_weights(smooth_blade(5), nodes=["N0"])
    with pytest.raises(InvalidInput, match="at least 3"):
        chord_weights(smooth_blade(2), "simpson")
    with pytest.raises(InvalidInput, match="rule"):
        chord_weights(smooth_blade(5), "midpoint")
    with pytest.raises(InvalidInput, match="leading to trailing"):
        chord_weights(smooth_blade(5), nodes=["N2", "N1"])

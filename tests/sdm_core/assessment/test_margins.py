"""Margins against a liner: edges in speed are exact, and time is shared as told."""

from __future__ import annotations

import numpy as np
import pytest
from named_problems import AT_TIP, one_mode

from sdm_core.assessment.margins import OperatingPoint, margins
from sdm_core.blade import example_blade
from sdm_core.boundary import verdicts
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput

LE = ContactConfiguration.at("LE")
RANGE = (150.0, 300.0)


def one_mode_edges(blade_hz: float, damping: float, kappa: float, lobe: int) -> tuple[float, float]:
    """Speeds between which one mode is unstable: K_e = −1/(2 Re H) has two frequencies."""
    # With s = ω²/ω_0² and k = K_e G/ω_0²: (1 − s)² + 4ξ²s = −2k(1 − s).
    roots = np.sort(np.roots([1.0, 4 * damping**2 - 2 - 2 * kappa, 1 + 2 * kappa]).real)
    speeds = []
    for s in roots:
        phase = -np.angle(1 + (1 - s + 2j * damping * np.sqrt(s)) / kappa) / (2 * np.pi) % 1
        speeds.append(blade_hz * np.sqrt(s) / (lobe + phase))
    return min(speeds), max(speeds)


def test_edges_of_one_mode_are_those_of_the_closed_form():
    damping, frequency, kappa = 5e-3, 100.0, 0.02
    blade = one_mode(damping, frequency, amplitude=2.0)
    liner = kappa * (2 * np.pi * frequency) ** 2 / 4.0
    found = margins(blade, AT_TIP, (15.0, 60.0), liner)
    expected = [one_mode_edges(frequency, damping, kappa, k) for k in range(6, 0, -1)]
    inside = [(low, high) for low, high in expected if low > 15.0 and high < 60.0]
    assert len(inside) >= 4
    mine = [(i.low_hz, i.high_hz) for i in found.unstable if not i.open_low and not i.open_high]
    np.testing.assert_allclose(mine, inside, rtol=3e-6)
    least = 2 * damping * (1 + damping) / kappa
    assert found.margin_ke == pytest.approx(least - 1, abs=1e-4)


def test_just_inside_an_edge_rotor_37_is_unstable_and_just_outside_stable():
    blade, liner = example_blade("nasa_rotor_37"), 9500.0
    found = margins(blade, LE, RANGE, liner)
    assert len(found.unstable) > 5
    edges = [(i.low_hz, -1) for i in found.unstable if not i.open_low]
    edges += [(i.high_hz, +1) for i in found.unstable if not i.open_high]
    speed = np.array([s for s, _ in edges])
    outward = np.array([o for _, o in edges])
    ke = np.full(len(edges), liner)
    assert (verdicts(blade, LE, speed * (1 + 3e-6 * outward), ke) == 1.0).all()
    assert (verdicts(blade, LE, speed * (1 - 3e-6 * outward), ke) == 0.0).all()


def test_no_speed_of_a_fine_grid_contradicts_the_intervals():
    blade, liner = example_blade("nasa_rotor_37"), 9500.0
    found = margins(blade, LE, RANGE, liner)
    speed = np.linspace(*RANGE, 3001)
    inside = np.zeros(len(speed), dtype=bool)
    for interval in found.unstable:
        inside |= (speed >= interval.low_hz) & (speed <= interval.high_hz)
    np.testing.assert_array_equal(inside, verdicts(blade, LE, speed, np.full(len(speed), liner)) == 0.0)
    assert found.unstable_speed_share == pytest.approx(inside.mean(), abs=2e-3)


def test_a_lobe_that_only_just_reaches_the_liner_is_not_passed_by():
    blade = example_blade("nasa_rotor_37")
    tip = margins(blade, LE, (230.0, 255.0), 9000.0, ke_max=1e4).worst
    just_above = margins(blade, LE, (230.0, 255.0), tip.ke * (1 + 1e-7))
    assert len(just_above.unstable) == 1
    assert just_above.unstable[0].high_hz - just_above.unstable[0].low_hz < 0.02
    assert margins(blade, LE, (230.0, 255.0), tip.ke * (1 - 1e-3)).unstable == ()


def test_stable_gaps_between_lobes_are_found_whatever_the_range_looked_at():
    """The same speeds, seen from two ranges with other grids: the same intervals."""
    blade, liner = example_blade("nasa_rotor_37"), 9000.0
    one = margins(blade, LE, (60.0, 300.0), liner).unstable
    other = margins(blade, LE, (60.0, 300.8), liner).unstable
    edges = [[(i.low_hz, i.high_hz) for i in found] for found in (one, other)]
    assert len(edges[0]) > 20
    np.testing.assert_allclose(edges[0], edges[1], rtol=3e-6)


def test_the_ends_of_the_range_know_their_nearest_unstable_speed():
    found = margins(example_blade("nasa_rotor_37"), LE, (245.0, 290.0), 9500.0)
    assert found.low_end_hz == pytest.approx(found.unstable[0].low_hz - 245.0)
    assert found.high_end_hz == pytest.approx(290.0 - found.unstable[-1].high_hz)
    assert len(found.unstable) == 1 and found.low_end_hz > 0 and found.high_end_hz > 0
    cut = margins(example_blade("nasa_rotor_37"), LE, (241.6, 267.1), 9500.0)
    assert cut.low_end_hz == 0.0 and cut.high_end_hz == 0.0
    assert cut.unstable[0].open_low and cut.unstable[-1].open_high


def test_operating_points_tell_stability_distance_and_share_of_time():
    blade, liner = example_blade("nasa_rotor_37"), 9500.0
    points = [OperatingPoint("idle", 160.0, 1.0), OperatingPoint("cruise", 241.6, 3.0)]
    found = margins(blade, LE, RANGE, liner, points=points)
    idle, cruise = found.points
    assert cruise.stable is False and idle.stable is True
    assert found.unstable_time_share == pytest.approx(0.75)
    assert cruise.margin_hz < 0 < idle.margin_hz
    for point in found.points:
        edges = np.array([[i.low_hz, i.high_hz] for i in found.unstable]).ravel()
        assert abs(point.margin_hz) == pytest.approx(np.abs(edges - point.point.speed_hz).min(), rel=1e-9)
    assert cruise.margin_ke == pytest.approx(cruise.critical_ke / liner - 1)


def test_a_stiffer_liner_leaves_no_more_margin_anywhere():
    blade = example_blade("nasa_rotor_37")
    soft, hard = (margins(blade, LE, RANGE, liner, ke_max=2.5e4) for liner in (9200.0, 1.2e4))
    assert hard.margin_ke < soft.margin_ke
    assert hard.unstable_speed_share > soft.unstable_speed_share
    for interval in soft.unstable:
        assert any(
            wide.low_hz <= interval.low_hz * (1 + 1e-6) and interval.high_hz <= wide.high_hz * (1 + 1e-6)
            for wide in hard.unstable
        )


def test_a_blade_with_no_lobe_in_reach_has_a_lower_bound_for_its_margin():
    found = margins(example_blade("generic_compressor_blade"), LE, (60.0, 200.0), 1e4)
    assert found.unstable == () and found.worst is None
    assert found.margin_ke == 1.0
    assert found.low_end_hz is None and found.unstable_time_share is None


def test_points_outside_the_range_and_liners_of_nothing_are_refused():
    blade = example_blade("nasa_rotor_37")
    with pytest.raises(InvalidInput, match=r"operating_points\[0\]"):
        margins(blade, LE, RANGE, 9e3, points=[OperatingPoint("idle", 100.0)])
    with pytest.raises(InvalidInput, match="ke_liner"):
        margins(blade, LE, RANGE, 0.0)
    with pytest.raises(InvalidInput, match="share"):
        OperatingPoint("idle", 100.0, -1.0)

"""The Campbell diagram: every resonance of an engine order is found, and to rounding."""

from __future__ import annotations

import numpy as np
import pytest

from sdm_core.assessment.campbell import campbell_diagram
from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import least_critical_ke

RANGE = (60.0, 300.0)


def test_a_stiffening_mode_meets_an_order_where_the_closed_form_says():
    """ω² = ω0² + B Ω² meets k Ω at Ω = f0/√(k² − B)."""
    stiffening, at_rest = 1.7, 500.0
    states = [
        ModalState(s, [np.sqrt(at_rest**2 + stiffening * s**2), 5000.0], [[1.0], [2.0]])
        for s in (0.0, 150.0, 320.0)
    ]
    blade = Blade("b", ("tip",), 1e-3, states)
    found = campbell_diagram(blade, RANGE, engine_orders=[2, 3, 4])
    assert [(c.order, c.mode) for c in found.crossings] == [(4, 1), (3, 1)]
    for crossing in found.crossings:
        exact = at_rest / np.sqrt(crossing.order**2 - stiffening)
        assert crossing.speed_hz == pytest.approx(exact, rel=1e-12)
        assert crossing.frequency_hz == pytest.approx(crossing.order * exact, rel=1e-12)


def test_a_mode_that_bends_back_meets_one_order_twice():
    """A softening mode crosses its order from below and comes back: both speeds are resonances."""
    x = np.array([0.0, 100.0, 200.0, 300.0]) ** 2
    middle, half = 200.0**2, 150.0**2
    # ω²/4π² = k²x − c (x − middle)² + c·half²/4 at k = 4: roots where |x − middle| = half/2.
    c = 1e-5
    square = 16 * x + c * ((half / 2) ** 2 - (x - middle) ** 2) + 0.0
    square = np.maximum(square, 1.0)
    states = [
        ModalState(float(np.sqrt(s)), [float(np.sqrt(f))], [[1.0]]) for s, f in zip(x, square, strict=True)
    ]
    assert (16 * x[1:] + c * ((half / 2) ** 2 - (x[1:] - middle) ** 2) > 1.0).all()
    found = campbell_diagram(Blade("b", ("tip",), 1e-3, states[1:]), (100.0, 300.0), engine_orders=[4])
    speeds = [crossing.speed_hz for crossing in found.crossings]
    assert speeds == pytest.approx([np.sqrt(middle - half / 2), np.sqrt(middle + half / 2)], rel=1e-9)


@pytest.mark.parametrize("name", ["nasa_rotor_37", "generic_compressor_blade"])
def test_resonances_of_real_blades_are_all_found_and_exact(name):
    blade = example_blade(name)
    high = blade.states[-1].speed_hz
    found = campbell_diagram(blade, (60.0, high), engine_orders=range(1, 61))
    speed = np.linspace(60.0, high, 20_001)
    frequency = blade.at_speeds(speed)[0] / (2 * np.pi)
    for order in range(1, 61):
        for mode in range(1, blade.mode_count + 1):
            side = np.sign(frequency[:, mode - 1] - order * speed)
            seen = np.count_nonzero(side[1:] != side[:-1])
            mine = [c for c in found.crossings if (c.order, c.mode) == (order, mode)]
            assert len(mine) == seen
            for crossing in mine:
                there = blade.at_speed(crossing.speed_hz).frequency_hz[mode - 1]
                assert there == pytest.approx(order * crossing.speed_hz, rel=1e-12)


def test_lobes_lie_three_quarters_of_an_order_above_whole_ones_and_on_a_mode():
    """At a lobe's tip chatter runs a quarter wave ahead: resonance and instability do not coincide."""
    blade = example_blade("nasa_rotor_37")
    tips = least_critical_ke(blade, ContactConfiguration.at("LE"), *RANGE, 2.5e4, count=200)
    found = campbell_diagram(blade, RANGE, tips=tips)
    assert len(found.lobe_points) == len(tips) > 20
    assert {point.mode for point in found.lobe_points} == {1, 2, 4}
    for point in found.lobe_points:
        natural = blade.at_speed(point.tip.speed_hz).frequency_hz[point.mode - 1]
        assert point.tip.chatter_hz == pytest.approx(natural, rel=2.5e-3)
        assert point.tip.lobes_per_revolution % 1 == pytest.approx(0.75, abs=0.01)


def test_orders_that_are_no_orders_are_refused():
    blade = example_blade("nasa_rotor_37")
    for bad in ([0], [2.5], [True], [4, -1]):
        with pytest.raises(InvalidInput, match="engine_orders"):
            campbell_diagram(blade, RANGE, engine_orders=bad)
    with pytest.raises(InvalidInput, match="low_hz"):
        campbell_diagram(blade, (300.0, 60.0))

"""Leading against trailing edge."""

from __future__ import annotations

import pytest
from named_problems import one_mode

from sdm_core.assessment.edges import edge_comparison
from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import least_critical_ke

LE = ContactConfiguration.at("LE")


def test_of_one_mode_the_edges_differ_by_the_square_of_their_amplitudes():
    blade = Blade("b", ("LE", "TE"), 1e-3, [ModalState(0.0, [100.0], [[3.0, -1.5]])])
    found = edge_comparison(blade, LE, (15.0, 40.0), 1e4)
    assert found.trailing_over_leading == pytest.approx(4.0, rel=1e-6)
    assert found.mode_ratios == pytest.approx((4.0,), rel=1e-12)
    assert found.safer == "TE"


def test_equal_edges_are_called_equal():
    blade = Blade("b", ("LE", "TE"), 1e-3, [ModalState(0.0, [100.0], [[2.0, -2.0]])])
    assert edge_comparison(blade, LE, (15.0, 40.0), 1e4).safer == "equal"


def test_rotor_37_is_safer_at_its_trailing_edge_and_every_node_is_searched_as_by_itself():
    blade = example_blade("nasa_rotor_37")
    found = edge_comparison(blade, LE, (150.0, 300.0), 2.5e4)
    assert found.safer == "TE"
    assert [alone.node for alone in found.nodes] == list(blade.tip_nodes)
    for alone in (found.leading, found.trailing):
        there = ContactConfiguration.at(alone.node)
        own = least_critical_ke(blade, there, 150.0, 300.0, alone.searched_ke, count=100)[0]
        assert alone.tip.ke == pytest.approx(own.ke, rel=1e-9)
        # Modes far apart do each other little, and no lobe's tip falls just where a floor is least.
        assert 0.99 < alone.tip.ke / min(alone.mode_floor_ke) < 1.1


def test_an_edge_that_does_not_move_is_safer_and_no_ratio_is_made_up():
    blade = Blade("b", ("LE", "TE"), 1e-3, [ModalState(0.0, [100.0], [[2.0, 0.0]])])
    found = edge_comparison(blade, LE, (15.0, 40.0), 1e4)
    assert found.trailing.tip is None
    assert found.trailing_over_leading is None
    assert found.safer == "TE"


def test_one_tip_node_has_no_edges_to_compare():
    with pytest.raises(InvalidInput, match="tip_nodes"):
        edge_comparison(one_mode(1e-3), ContactConfiguration.at("tip"), (0.1, 0.4), 1.0)

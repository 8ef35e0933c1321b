"""Orders of simulations: what they assume, how finely they step, what the exact core is asked beside them."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from sdm_core.blade import example_blade
from sdm_core.errors import InvalidInput
from sdm_core.time_domain.liner.abradable_liner import Friction
from service.simulation.charts import chart_files
from service.simulation.constants import CasingConstants, LinerConstants
from service.simulation.order import SimulationOrder
from service.simulation.outcome import SimulationOutcome, simulated

ROTOR = example_blade("nasa_rotor_37")
ORDER = SimulationOrder(ROTOR, (96.0, 241.0), ("LE",), revolutions=6, cells=2000)


def test_an_order_comes_back_from_its_json_as_it_was():
    order = replace(
        ORDER,
        nodes=("LE", "TE"),
        liner=LinerConstants(plastic_modulus_pa=1e7),
        casing=CasingConstants(clearance_m=(1e-4, 2e-4), feed_per_revolution_m=1e-6),
        friction=Friction(0.1, -1),
    )
    again = SimulationOrder.from_dict(json.loads(json.dumps(order.to_dict())))
    assert again.to_dict() == order.to_dict()
    assert simulated(again).to_npz() == simulated(order).to_npz()


@pytest.mark.parametrize("young", [1.8e9, 3e7])
def test_the_plastic_modulus_that_follows_from_ke_gives_that_ke(young):
    order = replace(ORDER, liner=LinerConstants(ke=9000.0, youngs_modulus_pa=young))
    assert order.ke == pytest.approx(9000.0, rel=1e-12)


def test_a_liner_that_springs_back_is_cut_stably_where_a_stiff_one_is_not():
    # At 241 Hz the delay equation becomes unstable from 9,310 N/m on, the liner from (1 + ε) times that on.
    stiff = replace(ORDER, speed_hz=(241.0,), liner=LinerConstants(ke=9500.0))
    elastic = 9500.0 / 0.05
    springy = LinerConstants(ke=9500.0, youngs_modulus_pa=elastic * 5e-3 / (3.4e-3 * 1e-3))
    assert springy.liner().elastic_recovery == pytest.approx(0.05)
    assert simulated(stiff).speeds.unstable.tolist() == [True]
    assert simulated(replace(stiff, liner=springy)).speeds.unstable.tolist() == [False]


def test_one_step_a_cell_is_taken_where_it_is_short_enough_and_damps_nothing():
    assert ORDER.method.steps_per_cell is None  # at 96 Hz a cell takes 5 µs, 0.2 rad of the highest mode
    fine = replace(ORDER, cells=8000)
    assert fine.method.steps_per_cell == 1
    assert not simulated(fine).speeds.cell_damping_ratio.any()
    assert simulated(ORDER).speeds.cell_damping_ratio.max() > 1e-4


def test_a_speed_of_many_is_kept_as_it_is_among_them():
    whole = simulated(ORDER)
    for i, speed in enumerate(ORDER.speed_hz):
        part = simulated(ORDER.at([speed]))
        for name in ("worn_m", "spectrum_m", "peak_m", "lobes"):
            np.testing.assert_array_equal(getattr(part.speeds, name)[0], getattr(whole.speeds, name)[i])
        assert part.response is None


@pytest.mark.parametrize("speeds", [(241.0,), (200.0, 241.0)])
def test_a_tip_that_never_touches_wears_nothing_and_is_drawn(speeds):
    order = replace(ORDER, speed_hz=speeds, casing=CasingConstants(clearance_m=1e-3, ovalisation_m=0.0))
    outcome = simulated(order)
    assert not outcome.speeds.worn_m.any() and not outcome.speeds.lobes.any()
    assert all(content.startswith(b"\x89PNG") for _, content in chart_files(outcome))


def test_an_outcome_comes_back_from_its_npz():
    outcome = simulated(replace(ORDER, speed_hz=(241.0,)))
    again = SimulationOutcome.from_npz(outcome.order, outcome.to_npz())
    assert again.to_npz() == outcome.to_npz()
    assert again.to_dict()["energy"] == outcome.to_dict()["energy"]


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"speed_hz": (241.0, 241.0)}, "speed_hz[1]"),
        ({"speed_hz": (241.0, 400.0)}, "speed_hz"),
        ({"nodes": ("LE", "LE")}, "nodes[1]"),
        ({"revolutions": 2.5}, "revolutions"),
        ({"liner": LinerConstants(ke=1e4, plastic_modulus_pa=1e7)}, "liner.ke"),
        ({"casing": CasingConstants(radius_m=-1.0)}, "casing.radius_m"),
        ({"cells": 20, "steps_per_cell": 1}, "steps_per_cell"),
    ],
)
def test_what_cannot_be_simulated_is_refused_by_its_field(changes, field):
    with pytest.raises(InvalidInput) as refused:
        replace(ORDER, **changes)
    assert refused.value.field.startswith(field)

"""Screening: deepest lobes, verdict and ranking, against lobes known in closed form."""

from __future__ import annotations

import json

import numpy as np
import pytest

from sdm_core.blade import Blade, ModalState
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import Cancelled, InvalidInput, OutOfSpeedRange
from sdm_core.lobe_tips import deepest_lobe_tips, lobe_grid
from service.rest.replies import to_json
from service.screening.screen import STABLE, UNDECIDED, UNSTABLE, default_contacts, screen
from service.screening.sweep import cut_off, swept
from service.speeds import SpeedRange

LE = {"LE": ContactConfiguration.at("LE")}
EVEN = np.linspace(60.0, 210.0, 20)


def test_the_deepest_tip_is_found_between_the_speeds_of_the_grid(blade, lobes):
    worst = screen([blade], LE, lobes).results[0].worst
    assert worst.ke == pytest.approx(4000.0, rel=1e-5)
    assert worst.speed_hz == pytest.approx(lobes.deepest_tip_hz(), rel=1e-3)
    assert worst.speed_rpm == pytest.approx(60 * worst.speed_hz)
    assert worst.speed_ratio == pytest.approx(worst.speed_hz / 600.0)
    assert worst.lobes_per_revolution == pytest.approx(5.25, rel=1e-3)


def test_the_tips_are_listed_deepest_first(blade, lobes):
    tips = screen([blade], LE, lobes).results[0].critical_speeds
    assert [tip.ke for tip in tips][:3] == pytest.approx([4000.0, 4080.0, 4080.0], rel=1e-4)
    assert sorted(tip.ke for tip in tips) == [tip.ke for tip in tips]


def test_tips_take_a_few_exact_calls_of_at_most_nine_speeds_a_lobe(blade, lobes):
    screen([blade], LE, lobes)
    exact = [count for what, policy, count in lobes.asked if policy == "exact"]
    assert len(exact) <= 5
    assert max(exact) <= 9 * 8
    assert max(exact[1:]) <= 6 * 8


def test_tips_are_exact_even_where_the_surrogate_sweeps(blade, lobes):
    result = screen([blade], LE, lobes).results[0]
    at_tips = np.isin(result.boundary.speed_hz, [tip.speed_hz for tip in result.critical_speeds])
    assert (result.boundary.source[~at_tips] == "surrogate").all()
    assert result.worst.proven
    assert result.worst.error_estimate < 1e-4


def test_the_boundary_drawn_reaches_the_least_point(blade, lobes):
    boundary, worst = (row := screen([blade], LE, lobes).results[0]).boundary, row.worst
    assert (np.diff(boundary.speed_hz) > 0).all()
    assert boundary.speed_hz[np.nanargmin(boundary.critical_ke)] == worst.speed_hz
    assert np.nanmin(boundary.critical_ke) == worst.ke


def test_a_surrogate_that_sees_no_lobe_is_not_believed(blade, lobes):
    lobes.blind_surrogate = True
    result = screen([blade], LE, lobes).results[0]
    assert result.worst.ke == pytest.approx(4000.0, rel=1e-5)
    assert (result.boundary.source == "exact").all()


def test_a_minimum_at_the_end_of_the_range_is_kept(blade, lobes):
    tip = lobes.deepest_tip_hz()
    result = screen([blade], LE, lobes, speed_range=SpeedRange.from_hz(tip * 1.01, tip * 1.05)).results[0]
    assert result.worst.speed_hz == pytest.approx(tip * 1.01, rel=1e-9)


def test_none_below_ke_max_is_said_as_such(blade, lobes):
    result = screen([blade], LE, lobes, ke_max=3000.0, ke_liner=2000.0).results[0]
    assert result.worst is None
    assert result.verdict == STABLE
    assert result.margin is None
    assert result.unstable_share == 0.0


@pytest.mark.parametrize(("ke_liner", "verdict"), [(3999.0, STABLE), (4000.1, UNSTABLE), (20000.0, UNSTABLE)])
def test_the_verdict_compares_the_liner_with_the_smallest_unstable_stiffness(blade, lobes, ke_liner, verdict):
    result = screen([blade], LE, lobes, ke_liner=ke_liner).results[0]
    assert result.verdict == verdict
    assert result.margin == pytest.approx(4000.0 / ke_liner - 1, abs=1e-5)


@pytest.mark.parametrize("ke_liner", [3000.0, 20000.0])
def test_without_proof_nothing_is_called_stable_or_unstable(blade, lobes, ke_liner):
    lobes.error = float("inf")
    result = screen([blade], LE, lobes, ke_liner=ke_liner).results[0]
    assert result.verdict == UNDECIDED
    assert not result.worst.proven
    assert json.loads(to_json(result.to_dict()))["critical_speeds"][0]["error_estimate"] is None


def test_without_a_liner_there_is_no_verdict(blade, lobes):
    assert screen([blade], LE, lobes).results[0].verdict is None


def test_results_are_ranked_safest_first(blade, lobes):
    contacts = {
        "heavy": ContactConfiguration({"LE": 2.0}),
        "light": ContactConfiguration({"LE": 0.1}),
        "usual": ContactConfiguration({"LE": 1.0}),
    }
    report = screen([blade], contacts, lobes)
    assert [row.contact_name for row in report.results] == ["light", "usual", "heavy"]
    assert report.results[0].worst is None  # 40,000 N/m, above ke_max
    assert [row["rank"] for row in report.to_dict()["results"]] == [1, 2, 3]


def test_the_usual_contacts_are_leading_edge_trailing_edge_and_both(blade):
    found = {name: dict(contact.weights) for name, contact in default_contacts(blade).items()}
    assert found == {"LE": {"LE": 1.0}, "TE": {"TE": 1.0}, "both": {"LE": 1.0, "TE": 1.0}}


def test_a_blade_with_one_tip_node_has_one_usual_contact(blade):
    states = [type(s)(s.speed_hz, s.frequency_hz, s.mode_shape[:, :1]) for s in blade.states]
    assert list(default_contacts(Blade("b", ("TIP",), 1e-3, states))) == ["TIP"]


def test_the_report_goes_through_json_unchanged(blade, lobes):
    document = screen([blade], None, lobes, ke_liner=3000.0).to_dict()
    assert json.loads(to_json(document)) == document
    assert (
        document["results"][0]["smallest_unstable_ke"] == document["results"][0]["critical_speeds"][0]["ke"]
    )


def test_progress_counts_up_to_the_end(blade, lobes):
    seen = []
    screen([blade], None, lobes, progress=lambda *state: seen.append(state))
    assert [(done, total) for done, total, _ in seen] == [(0, 3), (1, 3), (2, 3), (3, 3)]


def test_progress_can_stop_the_work(blade, lobes):
    def stop(done: int, total: int, text: str) -> None:
        if done == 1:
            raise Cancelled("screening")

    with pytest.raises(Cancelled):
        screen([blade], None, lobes, progress=stop)
    assert sum(what == "map" for what, _, _ in lobes.asked) == 1


def test_unusable_arguments_are_refused_before_anything_is_asked(blade, lobes):
    for wrong, error in (
        ({"ke_max": 0.0}, InvalidInput),
        ({"ke_max": float("nan")}, InvalidInput),
        ({"ke_liner": -1.0}, InvalidInput),
        ({"ke_liner": 3e4}, InvalidInput),
        ({"contacts": {"x": ContactConfiguration.at("N5")}}, InvalidInput),
    ):
        with pytest.raises(error):
            screen([blade], wrong.pop("contacts", LE), lobes, **wrong)
    with pytest.raises(InvalidInput):
        screen([], LE, lobes)
    assert lobes.asked == []


def test_a_range_a_blade_cannot_follow_is_refused(lobes, blade):
    states = [type(blade.states[0])(s, [600.0 + s], [[1.0, 0.5]]) for s in (0.0, 100.0)]
    short = Blade("short", ("LE", "TE"), 1e-3, states)
    with pytest.raises(OutOfSpeedRange):
        screen([short], LE, lobes, speed_range=SpeedRange.from_hz(50.0, 150.0))


def test_the_grid_puts_eight_speeds_on_every_lobe_of_the_highest_mode(blade):
    grid = lobe_grid(blade, LE["LE"], EVEN, 2.5e4)
    assert (np.diff(grid) > 0).all()
    assert grid[0] == 60.0
    assert grid[-1] == 210.0
    lobe = np.diff(600.0 / grid)
    assert np.abs(lobe).max() <= 1 / 8 + 1e-9


def test_more_lobes_than_can_be_followed_are_refused_with_a_range_that_is_not(blade):
    with pytest.raises(InvalidInput, match="narrow it") as refused:
        lobe_grid(blade, LE["LE"], np.array([1.0, 210.0]), 2.5e4)
    least = float(refused.value.remedy.split(" from ")[1].split()[0])
    assert len(lobe_grid(blade, LE["LE"], np.array([least, 210.0]), 2.5e4)) > 1900


def test_only_tips_below_ke_max_are_given(blade, lobes):
    grid = lobe_grid(blade, LE["LE"], EVEN, 2.5e4)

    def exact(speeds):
        return lobes.boundary(blade, LE["LE"], speeds, 5000.0, "exact")

    tips = deepest_lobe_tips(exact(grid), exact, 600.0, ke_max=4100.0)
    assert [round(tip.ke) for tip in tips] == [4000, 4080, 4080]


def test_the_grid_leaves_out_modes_too_stiff_to_become_unstable(blade):
    """Mode 2 alone is stable below 2ξ(1 + ξ)ω²/G = 4e6 N/m, far above ke_max."""
    states = [ModalState(0.0, [600.0, 7000.0], [[1.0, 0.5], [1.0, 0.5]])]
    two = Blade("two", ("LE", "TE"), 1e-3, states)
    one_mode, both_modes = (lobe_grid(b, LE["LE"], EVEN, ke_max) for b, ke_max in ((two, 2.5e4), (two, 4e6)))
    assert len(one_mode) < 0.4 * len(both_modes)


@pytest.mark.parametrize("above", [1e-4, 1e-3, 1e-2])
def test_a_tip_just_below_ke_max_is_not_lost_between_the_speeds_of_a_grid(blade, lobes, above):
    worst = screen([blade], LE, lobes, ke_max=4000.0 * (1 + above), map_shape=(5, 5)).results[0].worst
    assert worst.ke == pytest.approx(4000.0, rel=5e-5)


def test_a_boundary_cut_off_is_the_one_looked_for_that_far(blade, lobes):
    speeds = np.linspace(60.0, 210.0, 50)
    wide, near = (lobes.boundary(blade, LE["LE"], speeds, ke_max, "exact") for ke_max in (9000.0, 6000.0))
    cut = cut_off(wide, 6000.0)
    assert cut.ke_max == near.ke_max
    assert cut.unstable_ke == near.unstable_ke
    for name in ("critical_ke", "chatter_hz"):
        assert np.array_equal(getattr(cut, name), getattr(near, name), equal_nan=True)


def test_with_arcs_a_sweep_is_asked_for_in_parts(blade, lobes):
    contact = ContactConfiguration.at("LE", arcs=[(0.0, 0.25)])
    whole, parts = (
        swept(lobes, blade, c, np.linspace(60.0, 210.0, 250), 2.5e4, "exact") for c in (LE["LE"], contact)
    )
    assert [count for _, _, count in lobes.asked] == [250, 100, 100, 50]
    assert np.array_equal(whole.critical_ke, parts.critical_ke, equal_nan=True)
    assert whole.unstable_ke == parts.unstable_ke

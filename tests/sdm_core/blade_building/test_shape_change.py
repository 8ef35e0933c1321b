"""Changes of shape: what stays, what moves, and what the critical K_e does."""

from __future__ import annotations

import numpy as np
import pytest
from named_solids import coarse_blade

from sdm_core.assessment.shape_gradient import shape_sensitivities
from sdm_core.blade.build import build_blade
from sdm_core.blade.profile.aerofoil import area_centroid
from sdm_core.blade.profile.shape_change import ShapeChange
from sdm_core.contact import ContactConfiguration
from sdm_core.lobe_tips import least_critical_ke


def _flat(side: np.ndarray) -> np.ndarray:
    return np.stack((side[..., 0], side[..., 1].mean() * side[..., 2]), axis=-1)


def _chord(side: np.ndarray) -> np.ndarray:
    middle = _flat(side).mean(axis=0)
    return middle[-1] - middle[0]


def test_no_change_changes_nothing():
    table = coarse_blade().sections()
    for one, other in zip(ShapeChange().of_sections(table).sides, table.sides, strict=True):
        assert one == pytest.approx(other, abs=1e-12)


def test_each_change_does_what_its_name_says_and_keeps_the_rest():
    table = coarse_blade().sections()
    change = ShapeChange(lean_deg=2.0, sweep_deg=-1.0, stagger_deg=3.0, thickness=1.1, chord=1.2)
    changed = change.of_sections(table)
    height = table.sides[-1][..., 1].mean() - table.sides[0][..., 1].mean()
    before, after = _chord(table.sides[-1]), _chord(changed.sides[-1])
    turned = np.degrees(np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0]))
    assert turned == pytest.approx(3.0, rel=1e-2)  # the mean radius moves a little with r(z)
    assert np.linalg.norm(after) == pytest.approx(1.2 * np.linalg.norm(before), rel=1e-3)
    gap = [
        np.linalg.norm(_flat(side)[1] - _flat(side)[0], axis=1).max()
        for side in (table.sides[0], changed.sides[0])
    ]
    assert gap[1] == pytest.approx(1.1 * gap[0], rel=1e-3)
    centres = [
        area_centroid(np.concatenate((_flat(side)[0], _flat(side)[1][::-1])))
        for side in (table.sides[-1], changed.sides[-1])
    ]
    moved = centres[1] - centres[0]
    assert moved == pytest.approx(height * np.tan(np.radians([-1.0, 2.0])), rel=2e-2, abs=2e-5)


def test_a_changed_blade_stays_between_its_hub_and_casing():
    profile = coarse_blade()
    tip = profile.sections().sides[-1]
    changed = (
        ShapeChange(sweep_deg=5.0, chord=1.2, stagger_deg=-5.0).of_sections(profile.sections()).sides[-1]
    )
    # The casing is a cone: r falls with z by 0.1.
    apex = tip[0, 0, 1] + 0.1 * tip[0, 0, 0]
    assert changed[..., 1] + 0.1 * changed[..., 0] == pytest.approx(
        np.full(changed.shape[:2], apex), rel=1e-9
    )


def test_derivative_of_critical_ke_to_thickness_is_what_building_twice_gives():
    profile, contact, ke_max = coarse_blade(), ContactConfiguration.at("LE", "TE"), 1e6

    def build(parameters):
        change = ShapeChange.from_mapping(parameters)
        return build_blade(change.of_profile(profile), verify=False).blade

    found = shape_sensitivities(
        build, {"thickness": 1.0}, {"thickness": 0.01}, contact, (80.0, 250.0), ke_max
    )
    apart = [
        least_critical_ke(build({"thickness": t}), contact, 80.0, 250.0, ke_max, tolerance=1e-9)[0].ke
        for t in (0.99, 1.01)
    ]
    (thickness,) = found.parameters
    assert thickness.derivative == pytest.approx((apart[1] - apart[0]) / 0.02, rel=2e-2)
    assert thickness.derivative > 0  # a thicker blade is stiffer and heavier

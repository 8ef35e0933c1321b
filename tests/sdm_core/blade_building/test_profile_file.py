"""Profiles from files: what is read back, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from named_solids import ROTOR_37, coarse_blade, needs_sections

from sdm_core.blade.profile import (
    ParametricBlade,
    profile_from_dict,
    profile_to_dict,
    read_profile,
    read_sections,
)
from sdm_core.blade.profile.aerofoil import area_centroid
from sdm_core.errors import DamagedFile, InvalidInput

HEADER = "section,point,z_m,r_m,theta_1_rad,theta_2_rad\n"


def _table(sections: int = 3, points: int = 7) -> str:
    z = np.linspace(-0.02, 0.02, points)
    half = 0.01 * (1 - (z / 0.0201) ** 2)
    rows = [
        f"{i},{j},{z[j]},{0.2 + 0.03 * i},{half[j] + 0.1 * z[j]},{-half[j] + 0.1 * z[j]}"
        for i in range(sections)
        for j in range(points)
    ]
    return HEADER + "\n".join(rows) + "\n"


def test_profile_survives_its_file():
    profile = replace(coarse_blade(), speeds_hz=(0.0, 100.0, 260.0), damping_ratio=(1e-3,) * 5)
    assert profile_from_dict(json.loads(json.dumps(profile_to_dict(profile)))) == profile


def test_section_table_survives_its_file(tmp_path):
    (tmp_path / "s.csv").write_text(_table())
    document = {"schema": "rubscreen/profile/1", "name": "t", "design_speed_hz": 200.0}
    (tmp_path / "p.json").write_text(json.dumps(document | {"sections": {"file": "s.csv"}}))
    profile = read_profile(tmp_path / "p.json")
    again = profile_from_dict(json.loads(json.dumps(profile_to_dict(profile))))
    for one, other in zip(profile.shape.sides, again.shape.sides, strict=True):
        assert np.array_equal(one, other)


def test_order_of_rows_in_a_section_table_does_not_matter(tmp_path):
    lines = _table().splitlines()
    (tmp_path / "a.csv").write_text(_table())
    (tmp_path / "b.csv").write_text("\n".join([lines[0], *reversed(lines[1:])]))
    for one, other in zip(
        read_sections(tmp_path / "a.csv").sides, read_sections(tmp_path / "b.csv").sides, strict=True
    ):
        assert np.array_equal(one, other)


def test_sections_are_met_exactly_by_the_solid_through_them(tmp_path):
    (tmp_path / "s.csv").write_text(_table())
    table = read_sections(tmp_path / "s.csv")
    solid = table.solid()
    corners = solid.positions(np.array([0.0, 1.0]), solid.height, np.array([-1.0, 1.0]))
    for i, side in enumerate(table.sides):
        for k in range(2):
            z, r, theta = side[k, [0, -1]].T
            met = corners[:, i, k]
            assert met == pytest.approx(
                np.stack((r * np.cos(theta), r * np.sin(theta), z), axis=1), abs=1e-12
            )


@needs_sections
def test_rotor_37_is_a_readable_table():
    sides = read_sections(ROTOR_37).sides
    assert (len(sides), sides[0].shape) == (12, (2, 100, 3))


def test_parametric_sections_have_their_centroids_on_the_stacking_line():
    blade = ParametricBlade(0.08, 0.2, 0.04, 0.08, (20.0, 50.0), 30.0, lean_deg=10.0, sweep_deg=-5.0)
    for i, side in enumerate(blade.sections().sides):
        h = i / 12
        outline = np.concatenate((side[0], side[1][::-1]))
        radius = 0.2 + 0.08 * h
        z, y = area_centroid(np.stack((outline[:, 0], radius * outline[:, 2]), axis=1))
        assert z == pytest.approx(-0.08 * h * np.tan(np.radians(5)), abs=1e-9)
        assert y == pytest.approx(0.08 * h * np.tan(np.radians(10)), abs=1e-9)


def test_parametric_section_has_the_chord_thickness_and_stagger_asked_for():
    side = ParametricBlade(0.08, 0.2, 0.04, 0.1, 30.0).sections().sides[0]
    z, _, theta = side.mean(axis=0).T
    chord = np.array([z[-1] - z[0], 0.2 * (theta[-1] - theta[0])])
    assert np.hypot(*chord) == pytest.approx(0.04)
    assert np.degrees(np.arctan2(chord[1], chord[0])) == pytest.approx(30.0)
    across = np.hypot(side[1, 50, 0] - side[0, 50, 0], 0.2 * (side[1, 50, 2] - side[0, 50, 2]))
    assert across == pytest.approx(0.004)


def test_stacking_on_centroids_undoes_any_shift_of_the_sections(tmp_path):
    (tmp_path / "s.csv").write_text(_table())
    straight = read_sections(tmp_path / "s.csv")
    shifted = type(straight)(
        [side + np.array([0.01 * i, 0.0, 0.05 * i]) for i, side in enumerate(straight.sides)]
    )
    for one, other in zip(
        shifted.stacked_on_centroids().sides, straight.stacked_on_centroids().sides, strict=True
    ):
        assert one == pytest.approx(other, abs=1e-12)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (
            {"parametric": {"span_m": -1, "hub_radius_m": 0.2, "chord_m": 0.04, "thickness_ratio": 0.1}},
            "span_m",
        ),
        ({"parametric": {"hub_radius_m": 0.2, "chord_m": 0.04, "thickness_ratio": 0.1}}, "span_m"),
        ({"parametric": None}, "parametric, sections"),
        ({"name": ""}, "name"),
        ({"design_speed_hz": None}, "design_speed_hz"),
        ({"design_speed_hz": "fast"}, "design_speed_hz"),
        ({"materials": {}}, "materials"),
        ({"material": {"E": 108, "nu": 0.34, "rho": 4400}}, "material.E"),
        ({"material": {"E": 108e9, "nu": 0.34}}, "material.rho"),
        ({"mesh": {"chord": 0}}, "mesh.chord"),
        ({"mesh": {"chord": 500, "span": 500, "thickness": 2}}, "mesh"),
        ({"tip": {"line": "middling"}}, "tip.line"),
        ({"tip": {"direction": "upwards"}}, "tip.direction"),
        ({"tip": {"direction": [0, 0, 0]}}, "tip.direction"),
        ({"speeds_hz": [0.0, 200.0, 100.0]}, "speeds_hz"),
        ({"modes": 0}, "modes"),
        ({"damping_ratio": [1e-3, 1e-3]}, "damping_ratio"),
        ({"stacking": "sideways"}, "stacking"),
        ({"schema": "rubscreen/profile/2"}, "schema"),
    ],
)
def test_what_no_blade_has_is_refused_by_name(change, field):
    document = profile_to_dict(coarse_blade()) | change
    with pytest.raises(InvalidInput) as refused:
        profile_from_dict({key: value for key, value in document.items() if value is not None})
    assert refused.value.field.split(".")[-1].split("[")[0] == field.split(".")[-1]


def test_chord_that_would_run_backwards_is_refused_with_its_place():
    with pytest.raises(InvalidInput, match=r"stagger_deg = 70 with camber 60 at 100 % of the span"):
        ParametricBlade(0.08, 0.2, 0.04, 0.1, (20.0, 70.0), 60.0)


def test_a_section_file_cannot_be_named_where_there_is_no_folder():
    document = {"schema": "rubscreen/profile/1", "name": "t", "design_speed_hz": 200.0}
    with pytest.raises(InvalidInput, match=r"sections.file"):
        profile_from_dict(document | {"sections": {"file": "/etc/hostname"}})


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "lacks the columns"),
        ("a,b\n1,2\n", "lacks the columns"),
        (HEADER, "no points"),
        (_table().replace("0.23,", "hub,", 1), "give a finite number"),
        (_table()[:-30], "cut off|finite number|at least"),
        (_table(sections=1), "at least two"),
        (_table(points=3), "at least 5 points"),
        (_table().replace("0,1,", "0,0,", 1), "twice"),
        (_table().replace(",0.2,", ",0.5,"), "hub to tip"),
        (_table().replace(",0.2,", ",-0.2,"), "above 0"),
        (_table().replace(",0.2,", ",200.0,"), "not mm"),
        (_table().replace("-0.02,", "nan,", 1), "finite number"),
    ],
)
def test_a_damaged_section_table_is_refused_in_words(tmp_path, text, says):
    (tmp_path / "s.csv").write_text(text)
    with pytest.raises(InvalidInput, match=says):
        read_sections(tmp_path / "s.csv")


def test_a_binary_file_is_no_section_table(tmp_path):
    (tmp_path / "s.csv").write_bytes(b"\xff\xd8\xff\xe0" + bytes(range(256)))
    with pytest.raises(DamagedFile):
        read_sections(tmp_path / "s.csv")


@given(
    st.dictionaries(
        st.sampled_from(["span_m", "hub_radius_m", "chord_m", "thickness_ratio", "stagger_deg", "lean_deg"]),
        st.one_of(
            st.floats(), st.text(max_size=3), st.none(), st.lists(st.floats(), max_size=4), st.booleans()
        ),
    )
)
def test_any_parameters_give_sections_or_a_named_refusal(parameters):
    document = {
        "schema": "rubscreen/profile/1",
        "name": "any",
        "design_speed_hz": 200.0,
        "parametric": {"span_m": 0.08, "hub_radius_m": 0.2, "chord_m": 0.04, "thickness_ratio": 0.08}
        | parameters,
    }
    try:
        sections = profile_from_dict(document).sections()
    except InvalidInput as error:
        assert error.field and error.remedy
    else:
        assert all(np.isfinite(side).all() for side in sections.sides)


def test_revolutions_per_minute_given_as_hertz_are_recognised_by_the_tip_speed():
    with pytest.raises(InvalidInput, match=r"design_speed_hz = 17000.0: the tip would move at .* not rpm"):
        replace(coarse_blade(), design_speed_hz=17_000.0)


def test_a_profile_with_a_byte_order_mark_is_read(tmp_path):
    document = json.dumps(profile_to_dict(coarse_blade()))
    (tmp_path / "p.json").write_text(document, encoding="utf-8-sig")
    assert read_profile(tmp_path / "p.json") == coarse_blade()


def test_sections_that_hub_and_casing_cut_off_are_refused_when_they_are_read():
    document = profile_to_dict(coarse_blade())
    document["parametric"] |= {"casing_slope": -1.4, "chord_m": 0.2}
    with pytest.raises(InvalidInput, match=r"parametric.casing_slope"):
        profile_from_dict(document)

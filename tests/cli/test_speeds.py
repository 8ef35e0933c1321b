"""Rotor speeds as people write them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.errors import InvalidInput, OutOfSpeedRange
from sdm_core.lobe_tips import evenly_timed
from service.speeds import Speed, SpeedRange, operating_range

positive = st.floats(min_value=1e-3, max_value=1e5)


@given(positive, st.sampled_from(["Hz", "rpm", "ratio", "HZ", "RPM"]), st.sampled_from(["", " "]))
def test_a_speed_is_read_back_from_its_number_and_unit(value, unit, gap):
    speed = Speed.parse(f"{value!r}{gap}{unit}")
    assert speed.value == value
    assert speed.unit.lower() == unit.lower()


@given(positive, positive)
def test_the_three_units_agree_on_one_speed(hz, f1):
    same = [Speed(hz, "Hz"), Speed(60 * hz, "rpm"), Speed(hz / f1, "ratio")]
    assert np.allclose([speed.in_hz(f1) for speed in same], hz, rtol=1e-12)


@given(st.text(max_size=20))
def test_any_text_is_a_range_or_is_refused_with_field_and_remedy(text):
    try:
        found = SpeedRange.parse(text, "--speed")
    except InvalidInput as error:
        assert error.field == "--speed"
        assert error.remedy
    else:
        assert found.low.value > 0


def test_a_unit_written_once_holds_for_both_ends():
    for text in ("0.05:0.33ratio", "0.05ratio:0.33", "0.05ratio:0.33ratio"):
        assert SpeedRange.parse(text) == SpeedRange(Speed(0.05, "ratio"), Speed(0.33, "ratio"))


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("50:300", "unit"),
        ("50Hz", "LOW:HIGH"),
        ("50Hz:300kHz", "Hz, rpm, ratio"),
        ("0Hz:300Hz", "above 0"),
        ("-5Hz:300Hz", "above 0"),
        ("nanHz:300Hz", "above 0"),
        ("300Hz:50Hz", "lower speed first"),
        ("300Hz:300Hz", "lower speed first"),
        ("1e400Hz:2Hz", "above 0"),
        ("", "LOW:HIGH"),
    ],
)
def test_an_unusable_range_is_refused_with_its_remedy(text, remedy):
    with pytest.raises(InvalidInput) as caught:
        SpeedRange.parse(text, "--speed")
    assert caught.value.field == "--speed"
    assert remedy in caught.value.remedy


def test_a_range_past_the_modal_data_names_their_end():
    with pytest.raises(OutOfSpeedRange, match=r"300\.8"):
        SpeedRange.parse("100Hz:400Hz").for_blade(example_blade("nasa_rotor_37"))


def test_ends_in_different_units_are_put_in_order_by_the_blade():
    blade = example_blade("nasa_rotor_37")
    assert SpeedRange.parse("6000rpm:0.3ratio").for_blade(blade) == pytest.approx((100.0, 271.803), rel=1e-5)
    with pytest.raises(InvalidInput, match="lower speed first"):
        SpeedRange.parse("6000rpm:50Hz").for_blade(blade)


def test_the_usual_range_of_nasa_rotor_37_is_30_to_105_percent_of_design_speed():
    assert operating_range(example_blade("nasa_rotor_37")) == pytest.approx((85.9435, 300.80225))


def test_the_usual_range_without_a_design_speed_is_the_papers(blade):
    bare = Blade(blade.name, blade.tip_nodes, blade.damping_ratio, blade.states)
    assert operating_range(bare) == pytest.approx((0.05 * 600.0, 0.45 * 600.0))


def test_the_usual_range_stays_within_the_modal_data():
    states = [ModalState(s, [600.0 + s], [[1.0]]) for s in (0.0, 100.0)]
    assert operating_range(Blade("b", ("LE",), 1e-3, states, design_speed_hz=120.0)) == (36.0, 100.0)
    with pytest.raises(InvalidInput, match="no usual operating range"):
        operating_range(Blade("b", ("LE",), 1e-3, states, design_speed_hz=1000.0))


@given(st.floats(1.0, 100.0), st.floats(1.01, 10.0), st.integers(2, 500))
def test_speeds_evenly_timed_rise_from_end_to_end(low, factor, count):
    speeds = evenly_timed(low, factor * low, count)
    assert (np.diff(speeds) > 0).all()
    assert np.allclose(speeds[[0, -1]], [low, factor * low])

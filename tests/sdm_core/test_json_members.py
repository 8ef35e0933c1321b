"""No object of a JSON text names a member twice: which of the two would count?"""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdm_core.blade import blade_to_dict, example_blade, read_blade
from sdm_core.errors import InvalidInput
from sdm_core.json_members import parse_json

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=12,
)


@given(values)
def test_a_text_without_repetition_is_read_as_the_standard_library_reads_it(value):
    assert parse_json(json.dumps(value)) == value


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('{"ke": 1, "ke": 1}', "ke"),
        ('{"states": [{}, {"a": 1, "speed_hz": 1, "b": 2, "speed_hz": 2}]}', "states[1].speed_hz"),
        ('[[{"": 1, "": 2}]]', "[0][0]."),
        ('{"a": {"x": 1, "x": 1}, "b": {"y": 1, "y": 1}}', "a.x"),
        ('{"a": {"x": 1, "x": 1}, "a": 2}', "a"),
        ('{"a": ' * 300 + '{"b": 1, "b": 2}' + "}" * 300, "a." * 300 + "b"),
    ],
)
def test_a_member_named_twice_is_refused_with_its_place(text, place):
    with pytest.raises(InvalidInput) as refused:
        parse_json(text)
    assert (refused.value.field, refused.value.value) == (place, "given twice")


def test_a_blade_file_with_two_damping_ratios_is_not_read(tmp_path):
    text = json.dumps(blade_to_dict(example_blade("nasa_rotor_37")))
    path = tmp_path / "blade.json"
    path.write_text(text.replace('"damping_ratio"', '"damping_ratio": 0.5, "damping_ratio"', 1))
    with pytest.raises(InvalidInput) as refused:
        read_blade(path)
    assert refused.value.field == "blade.json: damping_ratio"

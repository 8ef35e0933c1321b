"""Blades that are asked about again are read once, and never mistaken for another."""

from __future__ import annotations

import copy
import json

import numpy as np
import pytest

from sdm_core.blade import blade_to_dict, example_blade
from sdm_core.errors import InvalidInput
from service.rest.known_blades import KnownBlades


def document(name: str = "nasa_rotor_37") -> dict:
    return json.loads(json.dumps(blade_to_dict(example_blade(name))))


def test_the_same_json_again_is_the_same_blade():
    known = KnownBlades()
    assert known.blade(document()) is known.blade(document())


def test_a_blade_that_differs_in_its_last_digit_is_another():
    known, changed = KnownBlades(), document()
    first = known.blade(document())
    frequency = changed["states"][-1]["frequency_hz"]
    frequency[-1] = float(np.nextafter(frequency[-1], np.inf))
    assert known.blade(changed) is not first
    assert known.blade(changed).states[-1].frequency_hz[-1] == frequency[-1]


@pytest.mark.parametrize("wrong", [True, "0.001", None, [[0.001]]])
def test_what_python_holds_equal_is_not_taken_for_a_number_read_before(wrong):
    known, good = KnownBlades(), document()
    good["damping_ratio"] = 0.001
    known.blade(good)
    bad = copy.deepcopy(good) | {"damping_ratio": wrong}
    with pytest.raises(InvalidInput):
        known.blade(bad)


def test_one_and_true_are_different_blades():
    known, good = KnownBlades(), document()
    good["mass_kg"] = 1
    known.blade(good)
    with pytest.raises(InvalidInput, match="mass_kg"):
        known.blade(good | {"mass_kg": True})


def test_what_is_no_blade_is_not_remembered_as_one():
    known, bad = KnownBlades(), document() | {"name": ""}
    for _ in range(2):
        with pytest.raises(InvalidInput, match="name"):
            known.blade(bad)


def test_arrays_are_read_each_time():
    known, given = KnownBlades(), document()
    given["states"][0]["mode_shape"] = np.array(given["states"][0]["mode_shape"])
    assert known.blade(given) is not known.blade(given)


def test_what_is_kept_stays_within_its_limit_and_the_last_used_stays_longest():
    size = len(json.dumps(document()))
    known = KnownBlades(most_bytes=20 * size)
    first = known.blade(document())
    for i in range(200):
        known.blade(document() | {"name": f"other {i}"})
        assert known.blade(document()) is first
        assert known._size <= 20 * size
    assert 2 < len(known._blades) < 200

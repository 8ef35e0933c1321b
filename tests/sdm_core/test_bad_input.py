"""Every unusable input is refused with its field, its value and a remedy."""

import contextlib
import copy
import json
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from named_problems import benchmark_blade

from sdm_core.blade import blade_from_dict, blade_to_dict, example_blade, read_blade, write_blade
from sdm_core.boundary import boundary, verdicts
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import DamagedFile, InvalidInput
from sdm_core.floquet.arc_boundary import boundaries_with_arcs
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.lobe_tips import least_critical_ke
from sdm_core.rubbing_blade import RubbingBlade, single_state_problem
from sdm_core.semi_discretization import Averaged, Converged
from sdm_core.stability import stabilities, stability

GOOD = {
    "schema": "rubscreen/blade/1",
    "name": "b",
    "tip_nodes": ["LE", "TE"],
    "damping_ratio": 1e-3,
    "states": [{"speed_hz": 0.0, "frequency_hz": [100.0, 300.0], "mode_shape": [[1.0, 2.0], [3.0, -1.0]]}],
}


def changed(path: list, value) -> dict:
    data = copy.deepcopy(GOOD)
    place = data
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return data


@pytest.mark.parametrize(
    ("path", "value", "field"),
    [
        (["states", 0, "frequency_hz", 1], float("nan"), "states[0].frequency_hz[1]"),
        (["states", 0, "frequency_hz", 1], float("inf"), "states[0].frequency_hz[1]"),
        (["states", 0, "frequency_hz", 1], 1e300, "states[0].frequency_hz[1]"),
        (["states", 0, "frequency_hz", 0], -5.0, "states[0].frequency_hz[0]"),
        (["states", 0, "frequency_hz", 0], 0, "states[0].frequency_hz[0]"),
        (["states", 0, "frequency_hz", 0], "100", "states[0].frequency_hz[0]"),
        (["states", 0, "frequency_hz", 0], True, "states[0].frequency_hz[0]"),
        (["states", 0, "frequency_hz"], [], "states[0].frequency_hz"),
        (["states", 0, "frequency_hz"], 10**400, "states[0].frequency_hz"),
        (["states", 0, "frequency_hz", 0], 10**400, "states[0].frequency_hz[0]"),
        (["states", 0, "mode_shape", 1], [1.0], "states[0].mode_shape[1]"),
        (["states", 0, "mode_shape"], [[1.0, 2.0]], "states[0].mode_shape"),
        (["states", 0, "mode_shape"], [[1.0], [2.0]], "states[0].mode_shape"),
        (["states", 0, "mode_shape", 0, 0], None, "states[0].mode_shape[0][0]"),
        (["states", 0, "speed_hz"], -1.0, "states[0].speed_hz"),
        (["states"], [], "states"),
        (["states", 0], 3, "states[0]"),
        (["damping_ratio"], 1.0, "damping_ratio"),
        (["damping_ratio"], -1e-3, "damping_ratio"),
        (["damping_ratio"], [1e-3], "damping_ratio"),
        (["damping_ratio"], "light", "damping_ratio"),
        (["tip_nodes"], [], "tip_nodes"),
        (["tip_nodes"], ["LE", "LE"], "tip_nodes[1]"),
        (["direction"], "axial", "direction"),
        (["schema"], "rubscreen/blade/2", "schema"),
        (["name"], "", "name"),
        (["mass_kg"], -1.0, "mass_kg"),
        (["tip_radius_m"], [0.2], "tip_radius_m"),
        (["material"], "titanium", "material"),
    ],
)
def test_unusable_blade_files_name_the_field(path, value, field):
    with pytest.raises(InvalidInput) as caught:
        blade_from_dict(changed(path, value))
    assert caught.value.field == field
    assert caught.value.remedy and caught.value.value


@pytest.mark.parametrize("key", ["schema", "name", "tip_nodes", "damping_ratio", "states"])
def test_a_missing_key_is_named(key):
    data = copy.deepcopy(GOOD)
    del data[key]
    with pytest.raises(InvalidInput) as caught:
        blade_from_dict(data)
    assert caught.value.field == key


@pytest.mark.parametrize(
    ("weights", "arcs", "field"),
    [
        ({}, None, "contact.weights"),
        ({"LE": 0.0}, None, "contact.weights"),
        ({"LE": -1.0}, None, "contact.weights.LE"),
        ({"LE": float("nan")}, None, "contact.weights.LE"),
        (["LE"], None, "contact.weights"),
        ({"LE": 1.0}, [], "contact.arcs"),
        ({"LE": 1.0}, [[0.5, 0.7], [0.1, 0.2]], "contact.arcs[1]"),
        ({"LE": 1.0}, [[0.1, 0.5], [0.4, 0.6]], "contact.arcs[1]"),
        ({"LE": 1.0}, [[0.1, 0.2], [0.9, 1.15]], "contact.arcs[1]"),
        ({"LE": 1.0}, [[0.2, 0.2]], "contact.arcs[0][1]"),
        ({"LE": 1.0}, [[0.2, 1.5]], "contact.arcs[0][1]"),
        ({"LE": 1.0}, [[-0.1, 0.2]], "contact.arcs[0][0]"),
        ({"LE": 1.0}, [[1.0, 1.2]], "contact.arcs[0][0]"),
        ({"LE": 1.0}, [0.1, 0.2], "contact.arcs[0]"),
        ({"LE": 1.0}, [[0.1, 0.2, 0.3]], "contact.arcs[0]"),
        ({"LE": 1.0}, "all", "contact.arcs"),
    ],
)
def test_unusable_contacts_name_the_field(weights, arcs, field):
    with pytest.raises(InvalidInput) as caught:
        ContactConfiguration(weights, arcs)
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("speed", "ke_max", "node", "field"),
    [
        ([0.0], 1e4, "LE", "speed_hz[0]"),
        ([100.0, float("nan")], 1e4, "LE", "speed_hz[1]"),
        ([], 1e4, "LE", "speed_hz"),
        ([100.0], 0.0, "LE", "ke_max"),
        ([100.0], float("inf"), "LE", "ke_max"),
        ([100.0], 1e4, "tip", "contact.weights.tip"),
    ],
)
def test_unusable_questions_name_the_field(speed, ke_max, node, field):
    with pytest.raises(InvalidInput) as caught:
        boundary(blade_from_dict(GOOD), ContactConfiguration.at(node), np.array(speed), ke_max)
    assert caught.value.field == field


@pytest.mark.parametrize("steps", [0, 1, -3, 2.5, True, 10**9])
def test_unusable_numbers_of_steps_are_refused(steps):
    from named_problems import mathieu

    with pytest.raises(InvalidInput, match="steps"):
        Averaged(steps).multipliers(mathieu())


def test_a_truncated_blade_file_says_so(tmp_path):
    path = tmp_path / "blade.json"
    write_blade(example_blade("nasa_rotor_37"), path)
    path.write_text(path.read_text()[:2000])
    with pytest.raises(DamagedFile, match="not whole JSON"):
        read_blade(path)
    path.write_bytes(b"\xff\xfe\x00binary")
    with pytest.raises(DamagedFile, match="UTF-8"):
        read_blade(path)
    with pytest.raises(InvalidInput, match="readable file"):
        read_blade(tmp_path / "absent.json")


def test_a_blade_file_reads_back_unchanged(tmp_path):
    blade = example_blade("generic_compressor_blade")
    write_blade(blade, tmp_path / "b.json")
    assert blade_to_dict(read_blade(tmp_path / "b.json")) == blade_to_dict(blade)


def test_keys_of_a_later_version_are_ignored():
    assert blade_from_dict({**GOOD, "colour": "grey"}).name == "b"


def test_errors_travel_between_processes():
    error = pickle.loads(pickle.dumps(InvalidInput("ke", -1, "give more")))
    assert (error.field, error.value, error.remedy) == ("ke", "-1", "give more")


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)


@settings(max_examples=200, deadline=None)
@given(key=st.sampled_from([*GOOD, "direction", "mass_kg", "material", "tip_z_m"]), value=JSON)
def test_no_blade_file_whatever_raises_anything_but_invalid_input(key, value):
    try:
        blade_from_dict({**copy.deepcopy(GOOD), key: value})
    except InvalidInput as error:
        json.dumps([error.field, error.value, error.remedy])


@settings(max_examples=200, deadline=None)
@given(contact=JSON | st.fixed_dictionaries({"weights": JSON, "arcs": JSON}))
def test_no_contact_whatever_raises_anything_but_invalid_input(contact):
    with contextlib.suppress(InvalidInput):
        ContactConfiguration.from_dict(contact)


def test_the_doors_of_the_core_name_what_they_cannot_use():
    blade, contact = benchmark_blade(), ContactConfiguration.at("tip")
    arcs = ContactConfiguration.at("tip", arcs=[[0.0, 0.25]])
    problem = RubbingBlade.from_blade(blade, arcs, 0.3, 0.1)
    asked = {
        "problem": lambda: stability(None),
        "method": lambda: stability(problem, "averaged"),
        "problems = RubbingBlade": lambda: stabilities(problem),
        "blade = NoneType": lambda: boundary(None, contact, [0.3], 1.0),
        "contact = dict": lambda: boundary(blade, {"tip": 1.0}, [0.3], 1.0),
        "contact = NoneType": lambda: least_critical_ke(blade, None, 0.2, 0.4, 1.0),
        r"problems\[0\]": lambda: stabilities([blade]),
        "tolerance": lambda: Converged(tolerance=float("nan")),
        "first_steps": lambda: Converged(first_steps=0),
        "scheme": lambda: Converged(scheme=Averaged(20)),
        "workers": lambda: batch_multipliers([problem], workers=0),
        "listed": lambda: batch_multipliers([problem], listed=-1),
        "ke_max": lambda: boundaries_with_arcs([problem], float("nan")),
        "contact.engagement": lambda: ContactConfiguration.at("tip", engagement=0.5),
        "count": lambda: least_critical_ke(blade, contact, 0.2, 0.4, 4.0, count=2.5),
        "low_hz": lambda: least_critical_ke(blade, contact, "x", 0.4, 4.0),
        "ke = -1": lambda: single_state_problem([1.0], [1e-3], [[1.0]], [1.0], 0.3, -1.0),
        r"damping_ratio\[0\]": lambda: single_state_problem([1.0], [-1e-3], [[1.0]], [1.0], 0.3, 1.0),
        "speed_hz": lambda: single_state_problem([1.0], [1e-3], [[1.0]], [1.0], 0.0, 1.0),
        r"frequency_hz": lambda: single_state_problem([], [], [], [1.0], 0.3, 1.0),
    }
    for field, ask in asked.items():
        with pytest.raises(InvalidInput, match=field):
            ask()
    for one in (contact, arcs):
        with pytest.raises(InvalidInput, match="ke = 1 numbers"):
            verdicts(blade, one, [0.3, 0.4], [1.0])

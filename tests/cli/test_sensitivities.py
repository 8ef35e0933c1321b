"""`rubscreen sensitivities`: the parameters that move the critical K_e most, and all of them as JSON."""

from __future__ import annotations

import json

import numpy as np
import pytest

from sdm_core.blade import Blade, ModalState, example_blade, write_blade
from sdm_core.blade_sensitivity import critical_ke_sensitivities
from sdm_core.contact import ContactConfiguration

ROTOR = "nasa_rotor_37"


def test_the_json_has_every_parameter_and_the_table_the_ten_that_matter_most(rubscreen):
    result = rubscreen(
        "sensitivities", ROTOR, "--at", "14460rpm", "--at", "200Hz", "--policy", "exact", "--json", "-"
    )
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert document["speed_hz"] == [241.0, 200.0]
    exact = critical_ke_sensitivities(example_blade(ROTOR), ContactConfiguration.at("LE"), 241.0, 2.5e4)
    assert document["parameter"] == [i.parameter for i in exact.influences]
    np.testing.assert_allclose(document["relative"][0], [i.relative for i in exact.influences], rtol=1e-9)
    assert document["source"] == ["exact", "exact"]

    first, second = result.stderr.split("at 200 Hz")
    shown = [line for line in first.splitlines() if line.startswith("│")]
    assert len(shown) == 10
    assert "frequency of mode 2" in shown[0] and "+12.38" in shown[0]
    assert "rotor speed" in second


def test_edges_of_arcs_are_told_per_revolution(rubscreen):
    result = rubscreen(
        "sensitivities",
        ROTOR,
        "--at",
        "200Hz",
        "--arcs",
        "0:0.25,0.5:0.75",
        "--policy",
        "exact",
        "--ke-max",
        "1e5",
    )
    assert result.exit_code == 0, result.output
    assert any("of arc" in line and "per revolution" in line for line in result.stdout.splitlines())


def test_no_crossing_is_said_in_words_and_is_no_failure(rubscreen):
    result = rubscreen("sensitivities", ROTOR, "--at", "250Hz", "--policy", "exact", "--ke-max", "10")
    assert result.exit_code == 0
    assert "none below 10 N/m" in result.stdout


@pytest.fixture
def undesigned(tmp_path) -> str:
    blade = Blade("one", ("LE",), 1e-3, [ModalState(0.0, [600.0], [[1.0]])])
    write_blade(blade, tmp_path / "one.json")
    return str(tmp_path / "one.json")


@pytest.mark.parametrize(
    ("options", "field", "remedy"),
    [
        ([], "--at", "give a rotor speed"),
        (["--at", "fast"], "--at", "150Hz"),
        (["--at", "200Hz", "--ke-max", "0"], "--ke-max", "above 0"),
        (["--at", "200Hz", "--nodes", "XX"], "contact.weights.XX", "LE"),
    ],
)
def test_what_cannot_be_used_is_one_line(rubscreen, undesigned, options, field, remedy):
    result = rubscreen("sensitivities", undesigned, *options)
    assert result.exit_code == 2 and result.stdout == ""
    assert result.stderr.strip().count("\n") == 0
    assert result.stderr.startswith(f"rubscreen: {field} = ") and remedy in result.stderr


def test_a_speed_beyond_the_modal_data_is_refused(rubscreen):
    result = rubscreen("sensitivities", ROTOR, "--at", "900Hz", "--policy", "exact")
    assert result.exit_code == 2 and "--at = 900" in result.stderr

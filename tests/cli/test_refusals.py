"""Bad input ends with exit code 2 and one line naming field, value and remedy."""

from __future__ import annotations

import json
import socket

import pytest

from sdm_core.blade import blade_to_dict, example_blade
from service.commands import inputs

ROTOR = "nasa_rotor_37"


@pytest.fixture(autouse=True)
def _no_answers(monkeypatch):
    def refuse(url, models, policy):
        raise AssertionError("bad input must be refused before anything is loaded")

    monkeypatch.setattr(inputs, "answerer_from", refuse)


def assert_refused(result, field: str, value: str, remedy: str) -> None:
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    line = result.stderr.strip()
    assert line.count("\n") == 0, line
    assert line.startswith("rubscreen: ")
    for part in (field, value, remedy):
        assert part in line


@pytest.mark.parametrize(
    ("options", "field", "value", "remedy"),
    [
        (["--speed", "0Hz:300Hz"], "--speed", "0Hz", "above 0"),
        (["--speed", "50:300"], "--speed", "50", "unit"),
        (["--speed", "300Hz:50Hz"], "--speed", "300Hz:50Hz", "lower speed first"),
        (["--speed", "50Hz:500Hz"], "--speed", "500", "300.802"),
        (["--ke-max", "nan"], "--ke-max", "nan", "finite"),
        (["--ke-max", "0"], "--ke-max", "0.0", "above 0"),
        (["--ke-max", "-5"], "--ke-max", "-5", "above 0"),
        (["--ke-liner", "3e4"], "--ke-liner", "30000", "25000"),
        (["--nodes", "XX"], "contact.weights.XX", "1.0", "LE, N2"),
        (["--nodes", ""], "--nodes", "", "e.g. LE,TE"),
        (["--nodes", "LE,LE"], "--nodes", "LE,LE", "once"),
        (["--nodes", "LE", "--weights", "LE=1"], "--nodes", "LE", "not both"),
        (["--weights", "LE"], "--weights", "LE", "LE=1,TE=0.5"),
        (["--weights", "LE=abc"], "--weights", "abc", "number"),
        (["--weights", "LE=nan"], "contact.weights.LE", "nan", "finite"),
        (["--weights", "LE=0"], "contact.weights", "0.0", "above 0"),
        (["--arcs", "0:0.5,0.25:0.75"], "contact.arcs[1]", "0.25", "0.5"),
        (["--arcs", "0.5:0.25"], "contact.arcs[0][1]", "0.25", "0.5"),
        (["--arcs", "nan:0.5"], "contact.arcs[0][0]", "nan", "finite"),
        (["--arcs", "0.5"], "--arcs", "0.5", "START:END"),
        (["--engagement", "0.3:0.4"], "contact.engagement", "down to -0.1", "γ ≥ 0"),
        (["--engagement", "half"], "--engagement", "half", "number"),
        (["--engagement", "0.5:0.1:0.1:0.1"], "--engagement", "0.5:0.1", "MEAN"),
        (["--engagement", "0.5:0.1:0.1,0.1"], "contact.engagement.sine", "2 numbers", "give 1"),
        (["--engagement", "0.5", "--arcs", "0:0.5"], "--engagement", "0.5", "not both"),
    ],
)
@pytest.mark.parametrize("command", ["map", "boundary"])
def test_unusable_options_are_refused(rubscreen, command, options, field, value, remedy):
    assert_refused(rubscreen(command, ROTOR, *options), field, value, remedy)


@pytest.mark.parametrize("grid", ["200", "axb", "1x50", "50x100000", "-5x50"])
def test_an_unusable_grid_is_refused(rubscreen, grid):
    assert_refused(rubscreen("map", ROTOR, "--grid", grid), "--grid", grid, "give")


def test_an_unusable_number_of_speeds_is_refused(rubscreen):
    assert_refused(rubscreen("boundary", ROTOR, "--speeds", "1"), "--speeds", "1", "2 to")


def test_arcs_without_nodes_are_refused_in_a_screening(rubscreen):
    assert_refused(rubscreen("screen", ROTOR, "--arcs", "0:0.5"), "--arcs", "0:0.5", "--nodes")
    refused = rubscreen("screen", ROTOR, "--engagement", "0.5:0.4")
    assert_refused(refused, "--engagement", "0.5:0.4", "--nodes")


def blade_file(tmp_path, text: str, name: str = "blade.json") -> str:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.fixture
def rotor() -> dict:
    return blade_to_dict(example_blade(ROTOR))


@pytest.mark.parametrize("command", ["map", "boundary", "screen"])
def test_a_truncated_blade_file_is_refused(rubscreen, tmp_path, rotor, command):
    text = json.dumps(rotor)
    path = blade_file(tmp_path, text[: len(text) // 2])
    assert_refused(rubscreen(command, path), "blade file", path, "not whole JSON")


def test_a_blade_file_that_is_not_text_is_refused(rubscreen, tmp_path):
    path = tmp_path / "blade.json"
    path.write_bytes(b"\xff\xfe\x00\x01")
    assert_refused(rubscreen("map", str(path)), "blade file", str(path), "UTF-8")


def test_a_blade_file_of_another_schema_is_refused(rubscreen, tmp_path, rotor):
    path = blade_file(tmp_path, json.dumps({**rotor, "schema": "rubscreen/blade/9"}))
    assert_refused(rubscreen("map", path), "schema", "rubscreen/blade/9", "rubscreen/blade/1")


def test_a_blade_file_with_a_frequency_that_is_no_number_is_refused(rubscreen, tmp_path, rotor):
    rotor["states"][1]["frequency_hz"][2] = float("nan")
    path = blade_file(tmp_path, json.dumps(rotor))
    assert_refused(rubscreen("map", path), "states[1].frequency_hz[2]", "nan", "finite")


def test_a_blade_that_is_neither_file_nor_example_is_refused(rubscreen):
    assert_refused(rubscreen("map", "nasa_rotor_73"), "BLADE", "nasa_rotor_73", "nasa_rotor_37")
    assert_refused(rubscreen("map", "missing.json"), "blade file", "missing.json", "readable file")


@pytest.mark.parametrize(("command", "option"), [("map", "npz"), ("map", "png"), ("boundary", "json")])
def test_an_output_under_a_file_is_refused_before_any_work(rubscreen, tmp_path, command, option):
    blocker = tmp_path / "file.txt"
    blocker.write_text("in the way")
    path = str(blocker / f"out.{option}")
    assert_refused(rubscreen(command, ROTOR, f"--{option}", path), f"--{option}", path, "can be written")


def test_an_output_that_is_a_folder_is_refused(rubscreen, tmp_path):
    assert_refused(rubscreen("map", ROTOR, "--png", str(tmp_path)), "--png", str(tmp_path), "folder")


@pytest.mark.parametrize("name", ["x", "link", "./x"])
def test_two_outputs_in_one_file_are_refused(rubscreen, tmp_path, name):
    (tmp_path / "link").symlink_to(tmp_path / "x")
    other = f"{tmp_path}/{name}"
    result = rubscreen("map", ROTOR, "--json", str(tmp_path / "x"), "--png", other)
    assert_refused(result, "--png", other, "another path")


def test_an_output_over_the_blade_read_is_refused(rubscreen, tmp_path, rotor):
    path = blade_file(tmp_path, json.dumps(rotor))
    for command in ("map", "boundary", "screen"):
        assert_refused(rubscreen(command, path, "--json", path), "--json", path, "blade file")


@pytest.mark.parametrize("command", ["map", "boundary", "screen"])
@pytest.mark.parametrize(
    ("options", "field", "value", "remedy"),
    [
        (["--speed", "1Hz:10Hz"], "--speed", "1.0", "at least 6.16"),
        (["--ke-max", "1e9"], "--ke-max", "1000000000.0", "at most"),
    ],
)
def test_what_would_take_hours_is_refused(rubscreen, command, options, field, value, remedy):
    assert_refused(rubscreen(command, ROTOR, *options), field, value, remedy)


@pytest.mark.parametrize("command", ["boundary", "screen"])
def test_more_lobes_than_can_be_followed_are_refused(rubscreen, command):
    result = rubscreen(command, ROTOR, "--speed", "7Hz:300Hz")
    assert_refused(result, "--speed", "7 to 300 Hz", "narrow it")


def test_only_json_goes_to_stdout(rubscreen):
    assert_refused(rubscreen("map", ROTOR, "--png", "-"), "--png", "-", "only --json")


def test_an_unknown_policy_is_refused(rubscreen):
    result = rubscreen("map", ROTOR, "--policy", "guess")
    assert result.exit_code == 2
    assert "--policy" in result.stderr
    assert "guess" in result.stderr


def test_a_port_that_cannot_be_is_refused(rubscreen):
    assert_refused(rubscreen("serve", "--port", "70000"), "--port", "70000", "65535")


def test_an_address_of_another_machine_is_refused_as_the_host(rubscreen):
    result = rubscreen("serve", "--host", "192.0.2.1", "--port", "0")
    assert_refused(result, "--host", "192.0.2.1", "address of this machine")


def test_a_port_in_use_is_refused_as_the_port(rubscreen):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert_refused(rubscreen("serve", "--port", port), "--port", port, "free port")

"""`rubscreen blade`: build, import, check, export, show, and their refusals."""

from __future__ import annotations

import json

import numpy as np
import pytest
from named_solids import coarse_blade

from sdm_core.blade import example_blade, read_blade
from sdm_core.blade.profile import profile_to_dict


@pytest.fixture
def command(rubscreen):
    """The command line, paths given as such."""
    return lambda *arguments: rubscreen(*map(str, arguments))


@pytest.fixture(scope="module")
def profile(tmp_path_factory):
    path = tmp_path_factory.mktemp("profiles") / "fan.json"
    path.write_text(json.dumps(profile_to_dict(coarse_blade("fan"))))
    return path


def test_a_profile_is_built_with_its_reduced_model_and_a_deck(command, profile, tmp_path):
    made, reduced, deck = tmp_path / "b.json", tmp_path / "r.npz", tmp_path / "d.inp"
    done = command("blade", "build", profile, "-o", made, "--reduced", reduced, "--deck", deck)
    assert done.exit_code == 0, done.output
    assert "against the full model" in done.output
    blade = read_blade(made)
    assert (blade.name, blade.mode_count, len(blade.tip_nodes)) == ("fan", 5, 9)
    assert "CENTRIF" in deck.read_text()
    assert reduced.exists()


def test_a_reduced_model_imported_again_is_the_same_blade(command, profile, tmp_path):
    from sdm_core.blade.exchange import read_matrix_model

    made, reduced, again = tmp_path / "b.json", tmp_path / "r.op4", tmp_path / "again.json"
    assert command("blade", "build", profile, "-o", made, "--reduced", reduced, "--no-verify").exit_code == 0
    nodes = sorted(read_matrix_model(reduced).model.node_position_m)
    tip = ",".join(map(str, nodes))
    done = command(
        "blade", "import", reduced, "--tip", tip, "--damping", "1e-3", "--casing-slope", "-0.1", "-o", again
    )
    assert done.exit_code == 0, done.output
    one, other = read_blade(made), read_blade(again)
    for a, b in zip(one.states, other.states, strict=True):
        assert b.frequency_hz == pytest.approx(a.frequency_hz, rel=1e-10)
        assert np.abs(b.mode_shape) == pytest.approx(np.abs(a.mode_shape), rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("ending", ["npz", "mat", "uff", "csv", "json"])
def test_a_blade_survives_export_and_import(command, tmp_path, ending):
    out, again = tmp_path / f"x.{ending}", tmp_path / "again.json"
    assert command("blade", "export", "nasa_rotor_37", out).exit_code == 0
    done = command("blade", "import", out, "-o", again)
    assert done.exit_code == 0, done.output
    one, other = example_blade("nasa_rotor_37"), read_blade(again)
    for a, b in zip(one.states, other.states, strict=True):
        assert b.mode_shape == pytest.approx(a.mode_shape, rel=1e-10)


def test_check_names_what_is_suspicious_and_says_so_by_its_exit_code(command, tmp_path):
    assert command("blade", "check", "nasa_rotor_37").exit_code == 0
    out = tmp_path / "x.json"
    command("blade", "export", "nasa_rotor_37", out)
    document = json.loads(out.read_text())
    for state in document["states"]:
        state["frequency_hz"] = [f / 1000 for f in state["frequency_hz"]]
    out.write_text(json.dumps(document))
    done = command("blade", "check", out)
    assert done.exit_code == 1
    assert "warning" in done.output


def test_show_tells_frequencies_and_direction(command):
    done = command("blade", "show", "nasa_rotor_37")
    assert "906.01" in done.output
    assert "normal to the casing" in done.output


def test_a_section_profile_beside_its_table_is_built(command, tmp_path):
    z = np.linspace(-0.015, 0.015, 15)
    half = 0.004 * (1.02 - (z / 0.015) ** 2)
    rows = [
        f"{i},{j},{z[j]},{0.2 + 0.03 * i},{half[j] + 5 * i * z[j]},{-half[j] + 5 * i * z[j]}"
        for i in range(3)
        for j in range(15)
    ]
    (tmp_path / "s.csv").write_text(
        "section,point,z_m,r_m,theta_1_rad,theta_2_rad\n" + "\n".join(rows) + "\n"
    )
    document = {
        "schema": "rubscreen/profile/1",
        "name": "sections",
        "design_speed_hz": 150.0,
        "sections": {"file": "s.csv"},
        "mesh": {"chord": 8, "span": 8, "thickness": 1},
    }
    (tmp_path / "p.json").write_text(json.dumps(document))
    done = command("blade", "build", tmp_path / "p.json")
    assert done.exit_code == 0, done.output
    assert (tmp_path / "p.blade.json").exists()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("build", "nothing.json"), "give a readable file"),
        (("import", "nothing.op4", "--tip", "1"), "nothing.op4"),
        (("import", "nothing.op4", "--tip", "a"), "--tip"),
        (("show", "nothing"), "BLADE"),
        (("export", "nasa_rotor_37", "x.docx"), "ending"),
        (("check", "nothing.json"), "nothing.json"),
    ],
)
def test_what_cannot_be_is_one_line_and_exit_code_two(command, arguments, says):
    done = command("blade", *arguments)
    assert done.exit_code == 2
    assert says in done.output
    assert "Traceback" not in done.output


def test_matrices_without_tip_nodes_or_damping_are_refused_by_option(command, profile, tmp_path):
    reduced = tmp_path / "r.npz"
    command("blade", "build", profile, "-o", tmp_path / "b.json", "--reduced", reduced, "--no-verify")
    assert "--tip = missing" in command("blade", "import", reduced, "--matrices").output
    assert (
        "name some of"
        in command("blade", "import", reduced, "--matrices", "--tip", "1", "--damping", "1e-3").output
    )
    assert "--damping = missing" in command("blade", "import", reduced, "--matrices", "--tip", "272").output


def test_assess_answers_what_experts_ask(command, tmp_path):
    done = command(
        "assess", "generic_compressor_blade", "--no-robust", "--ke-liner", "20000", "--speed", "120Hz:200Hz",
        "--point", "180Hz=0.7", "--point", "150Hz=0.3", "--clearance", "0.5", "--out", tmp_path / "a",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    for word in ("1B", "Safer edge", "share of the running time unstable", "running clearance"):
        assert word in done.output
    written = {path.name for path in (tmp_path / "a").iterdir()}
    assert written == {"assessment.json", "campbell.png", "lobes_by_mode.png", "clearance.png"}
    assert json.loads((tmp_path / "a" / "assessment.json").read_text())["schema"] == "rubscreen/assessment/1"


def test_an_output_that_cannot_be_written_leaves_nothing_and_keeps_what_was_there(
    command, tmp_path, monkeypatch
):
    import errno

    from sdm_core.blade.exchange import writing

    kept = tmp_path / "x.npz"
    kept.write_bytes(b"older")

    def full(blade, path):
        path.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(writing, "write_npz_blade", full)
    done = command("blade", "export", "nasa_rotor_37", kept)
    assert done.exit_code == 2
    assert "No space left" in done.output
    assert kept.read_bytes() == b"older"
    assert [path.name for path in tmp_path.iterdir()] == ["x.npz"]


def test_several_blade_files_are_checked_one_by_one(command, tmp_path):
    for name in ("a.json", "b.json"):
        command("blade", "export", "nasa_rotor_37", tmp_path / name)
    done = command("blade", "check", tmp_path / "a.json", tmp_path / "b.json")
    assert done.exit_code == 0, done.output
    assert "a.json:" in done.output and "b.json:" in done.output

"""Files are whole or not there; what the commands write and show."""

from __future__ import annotations

import json
import os

import numpy as np
import pytest

from service.commands import inputs, outputs

PNG = b"\x89PNG\r\n\x1a\n"
ROTOR = "nasa_rotor_37"


@pytest.fixture
def answering(monkeypatch, lobes):
    """Commands answer from the parabolic lobes."""
    lobes.frequency_hz = 906.0
    monkeypatch.setattr(inputs, "answerer_from", lambda url, models, policy: lobes)
    return lobes


def test_a_map_is_written_as_json_npz_and_png_into_a_new_folder(rubscreen, answering, tmp_path):
    paths = {kind: tmp_path / "new" / "folder" / f"map.{kind}" for kind in ("json", "npz", "png")}
    options = [text for kind, path in paths.items() for text in (f"--{kind}", str(path))]
    result = rubscreen("map", ROTOR, "--grid", "12x8", *options)
    assert result.exit_code == 0, result.output
    document = json.loads(paths["json"].read_text())
    assert np.shape(document["stable"]) == (8, 12)
    assert document["contact"] == {"weights": {"LE": 1.0}}
    with np.load(paths["npz"]) as arrays:
        assert arrays["stable"].shape == (8, 12)
        assert np.array_equal(arrays["speed_hz"], document["speed_hz"])
    assert paths["png"].read_bytes().startswith(PNG)
    assert sorted(p.name for p in paths["png"].parent.iterdir()) == ["map.json", "map.npz", "map.png"]


def test_json_on_stdout_is_nothing_but_json(rubscreen, answering):
    result = rubscreen("boundary", ROTOR, "--speeds", "50", "--json", "-")
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert len(document["critical_ke"]) == len(document["speed_hz"]) == 50
    assert document["critical_speeds"][0]["ke"] <= np.nanmin(np.array(document["critical_ke"], dtype=float))
    assert "tips of the deepest lobes" in result.stderr


def test_the_policy_and_the_contact_reach_whoever_answers(rubscreen, answering):
    result = rubscreen(
        "map", ROTOR, "--weights", "LE=1,TE=0.5", "--arcs", "0:0.25,0.5:0.75", "--policy", "exact"
    )
    assert result.exit_code == 0
    assert answering.asked[0][:2] == ("map", "exact")


def test_a_screening_shows_its_ranking_and_writes_its_report(rubscreen, answering, tmp_path):
    result = rubscreen("screen", ROTOR, "--ke-liner", "3000", "--grid", "10x10", "--out", str(tmp_path))
    assert result.exit_code == 0, result.output
    assert "safest first" in result.stdout
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["order"] == "safest first"
    assert [row["contact_name"] for row in report["results"]][-1] == "both"
    assert {row["verdict"] for row in report["results"]} == {"stable", "unstable at some speed"}
    charts = sorted(path.name for path in tmp_path.glob("*.png"))
    assert charts == [
        "nasa-rotor-37_LE_map.png",
        "nasa-rotor-37_TE_map.png",
        "nasa-rotor-37_both_map.png",
        "nasa-rotor-37_boundaries.png",
        "ranking.png",
    ]


def test_contacts_are_named_as_they_were_typed(rubscreen, answering, tmp_path):
    path = tmp_path / "report.json"
    options = [
        "--nodes",
        "N5",
        "--nodes",
        "LE,TE",
        "--weights",
        "LE=0.5",
        "--grid",
        "5x5",
        "--json",
        str(path),
    ]
    assert rubscreen("screen", ROTOR, *options).exit_code == 0
    names = {row["contact_name"] for row in json.loads(path.read_text())["results"]}
    assert names == {"N5", "LE,TE", "LE=0.5"}


def test_a_write_that_fails_leaves_the_old_file_and_no_other(tmp_path, monkeypatch):
    target = tmp_path / "report.json"
    target.write_text("old")

    def fail(source, destination):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(outputs.InvalidInput, match="No space left"):
        outputs.write_bytes("--json", target, b"new")
    assert target.read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["report.json"]


def test_what_a_link_points_to_is_written_and_the_link_stays(tmp_path):
    (tmp_path / "link").symlink_to("real.json")
    for content in (b"first", b"second"):
        outputs.write_bytes("--json", tmp_path / "link", content)
        assert (tmp_path / "real.json").read_bytes() == content
    assert (tmp_path / "link").is_symlink()


def test_a_pipe_is_written_to_not_replaced(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        outputs.check_writable(png=str(pipe))
        outputs.write_bytes("--png", pipe, b"chart")
        assert os.read(reader, 100) == b"chart"
    finally:
        os.close(reader)
    assert pipe.is_fifo()


def test_a_bar_that_nobody_watches_leaves_no_empty_line(capsys):
    with outputs.progress_bar("boundary") as show:
        show(1, 2, "half")
    assert capsys.readouterr().err == ""


def test_a_written_file_is_readable_by_others(tmp_path):
    outputs.write_bytes("--json", tmp_path / "a.json", b"{}")
    plain = tmp_path / "b.json"
    plain.write_text("{}")
    assert (tmp_path / "a.json").stat().st_mode == plain.stat().st_mode


def test_version_and_help(rubscreen):
    from sdm_core.version import __version__

    assert rubscreen("--version").stdout.strip() == f"rubscreen {__version__}"
    shown = rubscreen("--help").stdout
    for command in ("demo", "serve", "screen", "map", "boundary", "sensitivities", "train", "models"):
        assert command in shown


def test_long_work_without_a_terminal_says_now_and_then_how_far_it_is(capsys, monkeypatch):
    clock = iter([0.0, 3.0, 12.0, 14.0, 30.0])
    monkeypatch.setattr(outputs.time, "monotonic", lambda: next(clock))
    with outputs.progress_bar("train") as show:
        for done in (1, 5, 6, 9):
            show(done, 10, "fit")
    said = capsys.readouterr().err.splitlines()
    assert said == ["train: fit 5 of 10, 12 s", "train: fit 9 of 10, 30 s"]

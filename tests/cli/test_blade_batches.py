"""Folders of blades: what can be screened is, and what cannot is named with its reason."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from named_solids import coarse_blade

from sdm_core.blade import Blade, ModalState, blade_to_dict, example_blade, write_blade
from sdm_core.blade.profile import profile_to_dict
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from service.client import ServiceProblem
from service.commands import inputs
from service.commands.blade_batch import blade_paths, load_blades
from service.screening.batch import ranked, screen_each
from service.screening.screen import default_contacts, screen

ROTOR = "nasa_rotor_37"
GRID = ("--grid", "5x5")


@pytest.fixture
def answering(monkeypatch, lobes):
    """Commands answer from the parabolic lobes."""
    lobes.frequency_hz = 906.0
    monkeypatch.setattr(inputs, "answerer_from", lambda url, models, policy: lobes)
    return lobes


@pytest.fixture
def folder(tmp_path):
    """Three blades, a truncated one, one with an impossible frequency, one of another schema; and a note."""
    place = tmp_path / "blades"
    place.mkdir()
    rotor = example_blade(ROTOR)
    for name in ("c", "a", "b"):
        write_blade(replace(rotor, name=f"rotor {name}"), place / f"{name}.json")
    whole = (place / "a.json").read_text()
    (place / "cut.json").write_text(whole[: len(whole) // 2])
    document = blade_to_dict(rotor)
    document["states"][1]["frequency_hz"][2] = -5.0
    (place / "negative.json").write_text(json.dumps(document))
    (place / "other.json").write_text(json.dumps({"schema": "someone/else/7"}))
    (place / "notes.txt").write_text("not a blade")
    (place / "more").mkdir()
    (place / ".hidden.json").write_text("{")
    return place


def test_a_folder_is_screened_and_what_cannot_be_is_named(rubscreen, answering, folder, tmp_path):
    path, page = tmp_path / "report.json", tmp_path / "report.html"
    result = rubscreen("screen", str(folder), *GRID, "--json", str(path), "--html", str(page))
    assert result.exit_code == 0, result.output
    report = json.loads(path.read_text())
    assert {row["blade"] for row in report["results"]} == {"rotor a", "rotor b", "rotor c"}
    assert [row["rank"] for row in report["results"]] == list(range(1, 10))
    assert [entry["source"] for entry in report["blades"]] == [str(folder / f"{n}.json") for n in "abc"]
    reasons = {entry["source"].rpartition("/")[2]: entry["reason"] for entry in report["failures"]}
    assert sorted(reasons) == ["cut.json", "negative.json", "other.json"]
    assert "not whole JSON" in reasons["cut.json"]
    assert "states[1].frequency_hz[2] = -5.0" in reasons["negative.json"]
    assert "someone/else/7" in reasons["other.json"]
    assert report["ignored"] == [f"{folder / 'more'}/", str(folder / "notes.txt")]
    assert "rubscreen: 3 of 6 blades could not be screened: " in result.stderr
    assert "notes.txt" in result.stderr
    assert ".hidden" not in result.output + path.read_text()
    text = page.read_text()
    for name, reason in reasons.items():
        assert name in result.stdout
        assert name in text
        assert reason.partition(" = ")[0] in text


def test_a_file_that_is_broken_is_an_error_alone_and_a_failure_in_company(rubscreen, answering, folder):
    alone = rubscreen("screen", str(folder / "cut.json"), *GRID)
    assert alone.exit_code == 2
    assert alone.stdout == ""
    assert alone.stderr.startswith("rubscreen: blade file = ")
    company = rubscreen("screen", str(folder / "cut.json"), ROTOR, *GRID)
    assert company.exit_code == 0, company.output
    assert "1 of 2 blades could not be screened" in company.stderr


def test_a_folder_with_nothing_but_broken_files_is_an_error(rubscreen, answering, folder):
    for name in "abc":
        (folder / f"{name}.json").unlink()
    result = rubscreen("screen", str(folder), *GRID)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "none of the 3 blades could be screened" in result.stderr
    assert "cut.json" in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize("missing", ["nasa_rotor_73", "missing.json"])
def test_a_name_that_is_neither_file_nor_folder_stops_the_batch(rubscreen, answering, folder, missing):
    result = rubscreen("screen", str(folder), missing, *GRID)
    assert result.exit_code == 2
    assert missing in result.stderr
    assert answering.asked == []


def test_a_folder_without_blade_files_is_refused(rubscreen, answering, tmp_path):
    (tmp_path / "notes.txt").write_text("")
    result = rubscreen("screen", str(tmp_path), *GRID)
    assert result.exit_code == 2
    assert "give a folder that holds blade or profile files" in result.stderr


def test_a_blade_named_and_in_a_folder_is_read_once(folder):
    paths = blade_paths([str(folder / "more" / ".." / "b.json"), str(folder), ROTOR, ROTOR])
    names = [text.rpartition("/")[2] for text in paths.files]
    assert names == ["b.json", "a.json", "c.json", "cut.json", "negative.json", "other.json", ROTOR]


def test_a_blade_without_the_node_or_the_speeds_is_left_out(rubscreen, answering, folder, tmp_path):
    rotor = example_blade(ROTOR)
    one = [ModalState(s.speed_hz, s.frequency_hz, s.mode_shape[:, :1]) for s in rotor.states]
    write_blade(Blade("one node", ("LE",), 1e-3, one), folder / "one.json")
    write_blade(replace(rotor, name="short", states=rotor.states[:2]), folder / "short.json")
    path = tmp_path / "report.json"
    options = ["--nodes", "TE", "--speed", "100Hz:250Hz", *GRID, "--json", str(path)]
    result = rubscreen("screen", str(folder), *options)
    assert result.exit_code == 0, result.output
    reasons = {e["source"].rpartition("/")[2]: e["reason"] for e in json.loads(path.read_text())["failures"]}
    assert "contact.weights.TE" in reasons["one.json"]
    assert "200.535" in reasons["short.json"]


def test_an_output_over_a_blade_of_the_folder_is_refused(rubscreen, answering, folder):
    for option in ("--json", "--html"):
        result = rubscreen("screen", str(folder), option, str(folder / "a.json"))
        assert result.exit_code == 2
        assert "blade file read" in result.stderr


def test_a_blade_that_fails_while_it_is_screened_does_not_stop_the_rest(blade, lobes):
    class Fails(type(lobes)):
        def map(self, blade, *rest, **more):
            if blade.name == "bad":
                raise InvalidInput("speed_hz", 1, "ask for less")
            return super().map(blade, *rest, **more)

    bad = replace(blade, name="bad")
    report, kept, failures = screen_each(
        [(bad, "bad.json"), (blade, "good.json")], default_contacts, Fails(), ke_max=2e4
    )
    assert [source for _, source in kept] == ["good.json"]
    assert {row.blade.name for row in report.results} == {blade.name}
    assert [(f.source, f.reason) for f in failures] == [("bad.json", "speed_hz = 1: ask for less")]


def test_a_service_that_is_gone_stops_the_batch(blade, lobes):
    class Gone(type(lobes)):
        def map(self, *rest, **more):
            raise ServiceProblem({"status": None, "detail": "no answer"})

    class Refuses(type(lobes)):
        def map(self, *rest, **more):
            raise ServiceProblem({"status": 422, "detail": "too many\npoints"})

    with pytest.raises(ServiceProblem):
        screen_each([(blade, "x.json")], default_contacts, Gone(), ke_max=2e4)
    report, _, failures = screen_each([(blade, "x.json")], default_contacts, Refuses(), ke_max=2e4)
    assert report is None
    assert failures[0].reason == "too many points"


def test_blades_screened_one_by_one_rank_as_they_do_together(blade, lobes):
    contacts = {"LE": ContactConfiguration.at("LE"), "light": ContactConfiguration({"LE": 0.1})}
    second = replace(blade, name="second")
    together = screen([blade, second], contacts, lobes)
    apart = ranked(screen([one], contacts, lobes) for one in (blade, second))
    assert [(r.blade.name, r.contact_name) for r in apart.results] == [
        (r.blade.name, r.contact_name) for r in together.results
    ]


def test_progress_of_a_batch_counts_every_contact_of_every_blade(blade, lobes):
    seen = []
    blades = [(blade, "a"), (replace(blade, name="b"), "b")]
    screen_each(blades, default_contacts, lobes, ke_max=2e4, progress=lambda *state: seen.append(state[:2]))
    assert seen == [(i, 6) for i in range(7)]


def test_profiles_of_a_folder_are_built_and_impossible_ones_named(tmp_path):
    (tmp_path / "good.json").write_text(json.dumps(profile_to_dict(coarse_blade("good"))))
    impossible = profile_to_dict(coarse_blade("impossible"))
    impossible["parametric"]["stagger_deg"] = [20.0, 84.0]
    (tmp_path / "impossible.json").write_text(json.dumps(impossible))
    said = []
    loaded = load_blades(blade_paths([str(tmp_path)]), lambda done, total, what: said.append(what))
    assert [blade.name for blade in loaded.blades] == ["good"]
    (failure,) = loaded.failures
    assert "impossible.json" in failure.source
    assert "stagger_deg" in failure.reason
    assert "built good" in said


def test_weights_along_the_chord_are_each_blades_own(rubscreen, answering, tmp_path):
    rotor = example_blade(ROTOR)
    for name, bend in (("a", 1.0), ("b", 2.0)):
        theta = tuple(0.02 * np.linspace(0.0, 1.0, 9) ** bend)
        write_blade(replace(rotor, name=name, tip_theta_rad=theta), tmp_path / f"{name}.json")
    write_blade(replace(rotor, name="c"), tmp_path / "c.json")
    path = tmp_path / "out" / "report.json"
    options = ["--weights", "chord", "--nodes", "LE", *GRID, "--json", str(path)]
    result = rubscreen("screen", str(tmp_path), *options)
    assert result.exit_code == 0, result.output
    report = json.loads(path.read_text())
    rows = [row for row in report["results"] if row["contact_name"] == "chord"]
    first, second = (row["contact"]["weights"] for row in rows)
    assert len(first) == len(second) == 9
    assert first != second
    assert "tip_theta_rad" in report["failures"][0]["reason"]  # the third does not say where its nodes are

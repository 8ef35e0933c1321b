"""`rubscreen train` and `rubscreen models`, and models that are not whole."""

from __future__ import annotations

import json
import shutil
from types import SimpleNamespace

import pytest
from nearby_models import nearby

from training import calibration, pipeline, promotion_check, registry
from training.certificate import CalibrationFailed

ROTOR = "nasa_rotor_37"
FOUND = SimpleNamespace(certificates=())


@pytest.fixture
def own_models(tmp_path):
    """A copy of the shipped models."""
    return shutil.copytree(registry.SHIPPED, tmp_path / "models")


def test_the_active_model_is_marked(rubscreen, own_models):
    result = rubscreen("models", "--models", str(own_models), "--json", "-")
    assert result.exit_code == 0, result.output
    listed = json.loads(result.stdout)["models"]
    assert [entry["id"] for entry in listed if entry["active"]] == [registry.active_id()]
    assert registry.active_id() in result.stderr


def test_a_folder_without_models_says_what_to_do(rubscreen, tmp_path):
    result = rubscreen("models", "--models", str(tmp_path))
    assert result.exit_code == 0
    assert "rubscreen train" in result.stdout
    refused = rubscreen("map", ROTOR, "--models", str(tmp_path))
    assert refused.exit_code == 2
    assert str(tmp_path) in refused.stderr
    assert "train a model first" in refused.stderr


@pytest.mark.parametrize("name", ["model.safetensors", "card.json"])
def test_a_model_file_cut_in_half_is_refused(rubscreen, own_models, name):
    file = own_models / registry.active_id() / name
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    result = rubscreen("map", ROTOR, "--models", str(own_models))
    assert result.exit_code == 2
    assert result.stderr.startswith("rubscreen: model = ")
    assert name in result.stderr
    assert "rubscreen train" in result.stderr
    assert result.stderr.count("\n") == 1


def test_the_exact_core_answers_without_any_model(rubscreen, tmp_path):
    options = ["--policy", "exact", "--grid", "5x5", "--models", str(tmp_path)]
    result = rubscreen("map", ROTOR, *options)
    assert result.exit_code == 0, result.output
    assert "100.0% answered by the exact core" in result.stdout


def test_maps_are_answered_at_the_rate_asked_for(rubscreen):
    asked = ["map", ROTOR, "--grid", "20x20"]
    result = rubscreen(*asked, "--alpha", "1e-4", "--json", "-")
    assert result.exit_code == 0, result.output
    certificate = json.loads(result.stdout)["certificate"]
    assert (certificate["alpha"], certificate["distribution"]) == (1e-4, "reference/1")
    assert "false stable below 0.0001 on reference/1 with 95% confidence" in " ".join(result.stderr.split())
    refused = rubscreen(*asked, "--alpha", "0.3")
    assert refused.exit_code == 2
    assert refused.stderr.startswith("rubscreen: alpha = 0.3: ") and "0.0001" in refused.stderr


def test_recalibrating_shows_every_rate_and_writes_another_model(rubscreen, own_models, monkeypatch):
    model = registry.load_model()

    def as_it_says(cases, ke, *, workers, progress=None):
        critical = 10.0 ** model.surrogate.boundary(cases).log_ke
        return critical, ke > critical

    monkeypatch.setattr(calibration, "truth", as_it_says)
    monkeypatch.setattr(
        calibration, "point_verdicts", lambda *asked, **more: 1.0 - as_it_says(*asked, **more)[1]
    )
    asked = ["models", "recalibrate", model.id, "--models", str(own_models), "--evaluation-points", "1000"]
    result = rubscreen(*asked, "--points", "20000", "--no-activate")
    assert result.exit_code == 0, result.output
    (made,) = {entry.id for entry in registry.list_models(own_models)} - {model.id}
    assert made in result.stdout and registry.active_id(own_models) == model.id
    for text in ("20,000 points of reference/1, permanent contact", "0.0005", "not reached"):
        assert text in " ".join(result.stdout.split())


def test_training_that_fails_its_calibration_ends_with_exit_code_1(rubscreen, tmp_path, monkeypatch):
    def fail(*arguments, **settings):
        raise CalibrationFailed("false-stable rate above 0.0005")

    monkeypatch.setattr(pipeline, "train", fail)
    result = rubscreen("train", str(tmp_path / "models"))
    assert result.exit_code == 1
    assert "no model was written" in result.stderr
    assert "Traceback" not in result.stderr


def test_training_options_reach_the_pipeline(rubscreen, tmp_path, monkeypatch):
    seen = {}

    def stop(folder, settings, **more):
        seen.update(folder=folder, settings=settings, **more)
        raise CalibrationFailed("enough")

    monkeypatch.setattr(pipeline, "train", stop)
    rubscreen("train", str(tmp_path), "--seed", "7", "--cases", "4096", "--epochs", "3", "--no-activate")
    assert (seen["settings"].seed, seen["settings"].first_cases, seen["settings"].fit.epochs) == (7, 4096, 3)
    assert seen["folder"] == tmp_path
    assert seen["activate"] is False


def test_training_into_a_file_is_refused_before_any_work(rubscreen, tmp_path, monkeypatch):
    monkeypatch.setattr(pipeline, "train", None)
    blocker = tmp_path / "file.txt"
    blocker.write_text("in the way")
    result = rubscreen("train", str(blocker / "models"))
    assert result.exit_code == 2
    assert "can be written" in result.stderr


@pytest.fixture
def twins(tmp_path):
    """A folder with one model, certified for permanent contact."""
    nearby(tmp_path / "twins")
    return tmp_path / "twins"


def with_nearby(own_models, monkeypatch, **worse):
    """Another model beside the active one, and no fresh points."""
    monkeypatch.setattr(promotion_check, "remeasured", lambda *models: promotion_check.Remeasured((), {}))
    return nearby(own_models, 1.0001, **worse).id


def test_a_model_is_promoted_and_rolled_back_and_the_history_shows_it(rubscreen, twins, monkeypatch):
    first, other = registry.active_id(twins), with_nearby(twins, monkeypatch)
    there = ["--models", str(twins)]
    promoted = rubscreen("models", "promote", other, *there)
    assert promoted.exit_code == 0 and f"{other} is active" in promoted.stdout
    assert "active already" in rubscreen("models", "promote", other, *there).stdout
    assert registry.active_id(twins) == other
    back = rubscreen("models", "rollback", *there)
    assert back.exit_code == 0 and f"{first} is active again" in back.stdout
    shown = rubscreen("models", *there, "--history", "--json", "-")
    events = [(e["event"], e["model"]) for e in json.loads(shown.stdout)["history"]]
    assert events == [("first", first), ("promoted", other), ("rolled back", first)]
    assert "rolled back" in shown.stderr
    assert "history" not in json.loads(rubscreen("models", *there, "--json", "-").stdout)
    nothing = rubscreen("models", "rollback", *there)
    assert nothing.exit_code == 2 and "none was active before" in nothing.stderr


def test_a_worse_model_is_promoted_by_force_alone(rubscreen, twins, monkeypatch):
    first, there = registry.active_id(twins), ["--models", str(twins)]
    worse = with_nearby(twins, monkeypatch, certificates=lambda found: ())
    refused = rubscreen("models", "promote", worse, *there)
    assert refused.exit_code == 1 and registry.active_id(twins) == first
    assert "certified for nothing" in refused.stderr and "--force" in refused.stderr
    forced = rubscreen("models", "promote", worse, *there, "--force")
    assert forced.exit_code == 0 and registry.active_id(twins) == worse
    assert "forced, although it is certified for nothing" in forced.stdout
    assert "certified for nothing" in rubscreen("models", *there, "--history").stdout


def test_an_unknown_model_is_not_promoted(rubscreen, own_models):
    refused = rubscreen("models", "promote", "0" * 16, "--models", str(own_models))
    assert refused.exit_code == 2 and refused.stderr.count("\n") == 1
    assert rubscreen("models", "--history", "--url", "http://127.0.0.1:9").exit_code == 2


def test_recalibrating_on_fewer_points_leaves_the_active_model_and_says_why(
    rubscreen, own_models, monkeypatch
):
    first = registry.active_id(own_models)
    monkeypatch.setattr(
        calibration, "recalibrate", lambda *asked, **more: (registry.load_model(), FOUND, ("it is worse",))
    )
    result = rubscreen("models", "recalibrate", "--models", str(own_models), "--points", "20000")
    assert result.exit_code == 1 and registry.active_id(own_models) == first
    assert "not active" in result.stdout and "it is worse" in result.stderr and "--force" in result.stderr


def test_a_folder_of_answers_is_refused_before_anything_starts(rubscreen, tmp_path):
    (tmp_path / "file").write_text("in the way")
    refused = rubscreen("serve", "--keep-answers", str(tmp_path / "file"), "--port", "0")
    assert refused.exit_code == 2 and "--keep-answers" in refused.stderr
    missing = rubscreen("train", str(tmp_path / "models"), "--with-served", str(tmp_path / "none"))
    assert missing.exit_code == 2 and "kept its answers in" in missing.stderr

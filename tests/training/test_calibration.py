"""Calibrating a model: from the same weights another card, and never a worse one by luck."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from sdm_core.errors import DamagedFile, InvalidInput
from training import calibration, pipeline, registry
from training.calibration import CalibrationSettings, recalibrate
from training.certificate import CalibrationFailed
from training.contact_class import ARCS, PERMANENT
from training.fit import FitSettings
from training.pipeline import TrainingSettings, train
from training.registry import active_id, load_model
from training.seeds import seed_for
from training.surrogate import Architecture

QUICK = CalibrationSettings(points=16_000, evaluation_points=500, workers=1)


@pytest.fixture
def models(tmp_path):
    """A copy of the shipped models."""
    return shutil.copytree(registry.SHIPPED, tmp_path / "models")


@pytest.fixture
def labels(monkeypatch):
    """Labels as the shipped surrogate would give them, times `factor`: cheap, and of known error."""
    surrogate = load_model().surrogate

    class Labels:
        factor = 1.0

        def kappa(self, cases, *, workers, progress=None):
            return self.factor * 10.0 ** surrogate.boundary(cases).log_ke / cases.stiffness_scale

        def verdicts(self, cases, ke, *, workers, progress=None):
            return (ke <= self.kappa(cases, workers=1) * cases.stiffness_scale).astype(float)

        def truth(self, cases, ke, *, workers, progress=None):
            critical = self.kappa(cases, workers=1) * cases.stiffness_scale
            return critical, ke > critical

    labels = Labels()
    monkeypatch.setattr(calibration, "truth", labels.truth)
    monkeypatch.setattr(calibration, "point_verdicts", labels.verdicts)
    return labels


def test_recalibrating_keeps_the_weights_and_leaves_the_old_model_beside_the_new(models, labels):
    old = load_model(folder=models)
    made, found, _ = recalibrate(None, models, QUICK, activate=False)
    again = load_model(made.id, models)
    assert made.id != old.id == active_id(models)
    assert load_model(old.id, models).card == old.card
    kept = ("weights_sha256", "dataset", "fit", "design_space", "seed", "architecture")
    assert {k: again.card[k] for k in kept} == {k: old.card[k] for k in kept}
    assert again.certificates == found.certificates
    for contact, purpose in ((PERMANENT, "calibration"), (ARCS, "calibration, arcs")):
        certificate = again.certificate(contact)
        assert certificate.points == 16_000 and certificate.seed == seed_for(purpose, 2013)
        assert certificate.alphas == (1e-2, 5e-3, 1e-3, 5e-4) and certificate.not_reached == (1e-4,)
        assert again.card["evaluation"][contact]["auto"]["points"] == 500


def test_the_same_calibration_gives_the_same_model(models, labels):
    first, *_ = recalibrate(None, models, QUICK, activate=False)
    second, *_ = recalibrate(first.id, models, QUICK, activate=False)
    assert first.id == second.id


def test_a_certificate_from_fewer_points_does_not_replace_the_active_one(models, labels):
    active = active_id(models)
    made, _, refused = recalibrate(None, models, QUICK)
    assert active_id(models) == active != made.id
    assert any("certified on 16,000 points, now 200,000" in reason for reason in refused)
    assert any("0.0001 is certified now" in reason for reason in refused)


def test_a_surrogate_that_errs_on_the_unsafe_side_gets_no_certificate(models, labels):
    labels.factor = 0.05  # blades are unstable from a twentieth of what the surrogate says
    before = sorted(models.iterdir())
    with pytest.raises(CalibrationFailed, match=r"0\.0005"):
        recalibrate(None, models, QUICK)
    assert sorted(models.iterdir()) == before


def test_too_few_points_are_no_certificate_however_good_the_surrogate(models, labels):
    with pytest.raises(CalibrationFailed, match="500 points"):
        recalibrate(None, models, replace(QUICK, points=500))


def test_a_card_of_the_age_before_certificates_is_refused_until_it_is_recalibrated(models, labels):
    new = load_model(folder=models)
    card = {k: v for k, v in new.card.items() if k != "certificates"}
    card |= {"format": "rubscreen/model/1", "verification_band": {"spreads": 10.0, "alpha": 5e-4}}
    text = json.dumps(card, indent=1, sort_keys=True) + "\n"
    weights = (models / new.id / "model.safetensors").read_bytes()
    old_id = registry._identifier(weights, text)
    shutil.copytree(models / new.id, models / old_id)
    (models / old_id / "card.json").write_text(text)
    with pytest.raises(DamagedFile, match=f"rubscreen models recalibrate {old_id}"):
        load_model(old_id, models)
    made, *_ = recalibrate(old_id, models, QUICK, activate=False)
    assert made.card["weights_sha256"] == new.card["weights_sha256"]
    assert "verification_band" not in made.card
    cases = calibration.reference_sample(50, 1).cases
    same = load_model(made.id, models).surrogate.boundary(cases)
    np.testing.assert_array_equal(same.log_ke, new.surrogate.boundary(cases).log_ke)


def test_a_device_that_is_not_there_is_refused_before_anything_is_labelled(tmp_path, monkeypatch):
    monkeypatch.setattr(pipeline, "asked", None)
    settings = TrainingSettings(fit=FitSettings(device="bananas"))
    with pytest.raises(InvalidInput, match="device = bananas: use auto, cpu"):
        train(tmp_path / "models", settings)
    assert not list(tmp_path.iterdir())


def test_training_writes_the_card_that_recalibrating_does(tmp_path, labels, monkeypatch):
    shipped = load_model()

    def certified_as_shipped(surrogate, design_space, settings, progress):
        assert (settings.points, settings.seed) == (200_000, 11)
        return calibration.calibrated(shipped.surrogate, design_space, QUICK, progress)

    monkeypatch.setattr(pipeline, "calibrated", certified_as_shipped)
    quick = FitSettings(Architecture(width=8, blocks=1), epochs=1, batch=32)
    settings = TrainingSettings(
        first_cases=128,
        cases_each=64,
        rounds=2,
        round_epochs=1,
        monitor_points=200,
        seed=11,
        threads=1,
        fit=quick,
    )
    made = train(tmp_path / "models", settings)
    assert [one.labels for one in made.rounds] == [124, 188]
    again = load_model(folder=tmp_path / "models")
    assert again.id == made.model.id and again.certificates == made.model.certificates
    assert again.card.keys() == shipped.card.keys()
    assert made.refused == ()
    others = shutil.copytree(registry.SHIPPED, tmp_path / "others")
    recalibrated, *_ = recalibrate(None, others, QUICK, activate=False)
    assert recalibrated.card.keys() == again.card.keys()

"""Datasets and model files: whole, unaltered, or refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sdm_core.errors import DamagedFile, InvalidInput
from training.cases import CaseBatch
from training.certificate import Certificate, CertifiedBand
from training.contact_class import ARCS, PERMANENT
from training.dataset import Dataset, kept_labels
from training.design_space import DesignSpace
from training.registry import active_id, list_models, load_model, write_model
from training.space_filling import space_filling
from training.surrogate import Architecture, BoundaryNetwork, Surrogate

LINE = CertifiedBand(5e-4, 9.0, 10_000, 0, 0.02, 1e-4)
CERTIFICATES = [
    Certificate("synthetic", PERMANENT, 0.95, 20_000, 1, (LINE,), (80.0, 9.0), (1e-4,)),
    Certificate("elsewhere", PERMANENT, 0.9, 30_000, 2, (), (80.0, 9.0), (5e-4,)),
    Certificate("synthetic", ARCS, 0.95, 20_000, 3, (), (80.0,), ()),
]


@pytest.fixture
def dataset():
    cases = space_filling(DesignSpace(), 4, 2, seed=1, contact=ARCS)
    return Dataset(cases, np.linspace(0.1, 0.8, len(cases)), {"seed": 1})


@pytest.fixture
def models(tmp_path):
    architecture = Architecture(width=8, blocks=1)
    surrogate = Surrogate(BoundaryNetwork(architecture), architecture)
    model = write_model(surrogate, DesignSpace(), CERTIFICATES, {"seed": 1}, tmp_path)
    return tmp_path, model


def test_a_dataset_reads_back_unchanged_and_is_never_rewritten(dataset, tmp_path):
    path = dataset.write(tmp_path)
    stamp = path.stat().st_mtime_ns
    again = Dataset.read(path)
    assert again.digest == dataset.digest
    assert again.provenance == {"seed": 1}
    np.testing.assert_array_equal(again.kappa, dataset.kappa)
    assert dataset.write(tmp_path) == path and path.stat().st_mtime_ns == stamp


def test_a_dataset_of_other_content_has_another_digest(dataset):
    other = Dataset(dataset.cases, dataset.kappa * 1.0000001, dataset.provenance)
    assert other.digest != dataset.digest
    assert Dataset(dataset.cases, dataset.kappa, {"seed": 2}).digest != dataset.digest


def test_a_dataset_cut_short_is_refused(dataset, tmp_path):
    path = dataset.write(tmp_path)
    path.chmod(0o644)
    whole = path.read_bytes()
    for size in (0, 10, len(whole) // 2, len(whole) - 5):
        path.write_bytes(whole[:size])
        with pytest.raises(DamagedFile, match="label again"):
            Dataset.read(path)
    with pytest.raises(InvalidInput):
        Dataset.read(tmp_path / "absent.npz")


def test_labels_are_kept_for_a_training_that_was_killed_and_made_again_when_damaged(dataset, tmp_path):
    asked = []

    def label():
        asked.append(1)
        return dataset.kappa

    for _ in range(2):
        np.testing.assert_array_equal(kept_labels(dataset.cases, tmp_path, label), dataset.kappa)
    assert len(asked) == 1
    (kept,) = tmp_path.iterdir()
    kept.chmod(0o644)
    kept.write_bytes(kept.read_bytes()[:-9])
    np.testing.assert_array_equal(kept_labels(dataset.cases, tmp_path, label), dataset.kappa)
    assert len(asked) == 2
    kept_labels(dataset.cases[1:], tmp_path, lambda: dataset.kappa[1:])  # others are not taken for these
    assert len(list(tmp_path.iterdir())) == 2


def test_a_model_reads_back_with_the_same_answers(models):
    folder, model = models
    again = load_model(folder=folder)
    assert again.id == model.id == active_id(folder)
    cases = space_filling(DesignSpace(), 3, 2, seed=2)
    ours, theirs = model.surrogate.boundary(cases), again.surrogate.boundary(cases)
    np.testing.assert_array_equal(ours.log_ke, theirs.log_ke)
    assert list(again.certificates) == CERTIFICATES
    assert again.design_space == DesignSpace()
    assert [(e.id, e.active) for e in list_models(folder)] == [(model.id, True)]


def test_only_the_first_model_of_a_folder_becomes_active_by_being_written(models):
    folder, model = models
    same = write_model(model.surrogate, DesignSpace(), CERTIFICATES, {"seed": 1}, folder)
    other = write_model(model.surrogate, DesignSpace(), CERTIFICATES, {"seed": 2}, folder)
    assert same.id == model.id != other.id
    assert active_id(folder) == model.id
    assert len(list_models(folder)) == 2


@pytest.mark.parametrize("share", [0.0, 0.5, 0.999])
def test_a_model_file_cut_short_is_refused(models, share):
    folder, model = models
    path = folder / model.id / "model.safetensors"
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(DamagedFile, match=r"checksum.*rubscreen train"):
        load_model(folder=folder)


def test_a_card_cut_short_or_of_another_code_is_refused(models):
    folder, model = models
    path = folder / model.id / "card.json"
    text = path.read_text()
    path.write_text(text[: len(text) // 2])
    with pytest.raises(DamagedFile, match=r"card\.json"):
        load_model(folder=folder)
    (entry,) = list_models(folder)
    assert entry.active and "card.json" in entry.damage
    for change in ({"features": ["other"]}, {"certificates": []}):
        path.write_text(json.dumps({**json.loads(text), **change}, indent=1, sort_keys=True) + "\n")
        with pytest.raises(DamagedFile, match="not the one written"):
            load_model(folder=folder)


@pytest.mark.parametrize("name", ["absent", "../models", "", "."])
def test_an_unknown_model_is_refused_by_name(models, name):
    folder, _ = models
    with pytest.raises(InvalidInput, match="name one of"):
        load_model(name, folder)


def test_a_folder_without_models_says_to_train(tmp_path):
    with pytest.raises(InvalidInput, match="train a model first"):
        load_model(folder=tmp_path / "nothing")


def test_membership_of_the_design_space_names_the_reason():
    space = DesignSpace()
    good = space_filling(space, 64, 2, seed=3)
    assert space.contains(good).mean() > 0.9

    def with_changes(**changes) -> CaseBatch:
        return replace(good, **changes)

    slow = space.first_violation(with_changes(speed_hz=good.speed_hz * 0.01))
    assert set(slow) == {"speed/f1 outside 0.045 to 0.9"}
    damped = space.first_violation(with_changes(damping_ratio=np.full_like(good.omega, 0.1)))
    assert set(damped) == {"damping_ratio outside 0.00012 to 0.017"}
    undamped = space.contains(with_changes(damping_ratio=np.zeros_like(good.omega)))
    assert not undamped.any()
    untouched = space.first_violation(with_changes(contact_matrix=np.zeros_like(good.contact_matrix)))
    assert set(untouched) == {"no mode moves the contact nodes"}
    many = space.first_violation(with_changes(mode_count=np.full(len(good), 6)))
    assert set(many) == {"more than 5 modes"}
    with pytest.raises(InvalidInput):
        space_filling(space, 0, 1, seed=1)


def test_membership_looks_at_the_arcs_of_contact_and_at_stiffness():
    space = DesignSpace()
    good = space_filling(space, 64, 2, seed=3, contact=ARCS)
    assert space.contains(good).mean() > 0.9 and not good.permanent.any()
    rare = replace(good, arcs=good.arcs * 1e-3)
    assert set(space.first_violation(rare)) == {"share of the revolution in contact outside 0.03 to 0.95"}
    assert set(space.first_violation(replace(good, arc_count=np.full(len(good), 5)))) == {
        "more than 4 arcs of contact"
    }
    smooth = replace(good, arcs=np.full_like(good.arcs, np.nan), arc_count=np.zeros(len(good), int))
    assert set(space.first_violation(smooth)) == {"smooth engagement, which this model does not cover"}
    stiff = np.where(np.arange(len(good)) % 2 == 0, 1.01, 0.99) * space.largest_ke(good)
    odd = np.arange(len(good)) % 2 == 1
    np.testing.assert_array_equal(space.contains(good, stiff), space.contains(good) & odd)

"""One command trains: sample, label, fit, calibrate, evaluate, write."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path

import torch

from sdm_core.version import __version__
from training.calibration import CalibrationSettings, Progress, calibrated
from training.cases import CaseBatch
from training.dataset import Dataset
from training.design_space import DesignSpace
from training.evaluation import Evaluation
from training.fit import FitSettings, fit
from training.labelling import KAPPA_MAX, critical_kappa
from training.promotion import promote_unless_worse
from training.registry import Model, write_model
from training.served_answers import ServedAnswers
from training.served_cases import ServedCases


@dataclass(frozen=True)
class TrainingSettings:
    """What training does; the defaults write the shipped model.

    Attributes
    ----------
    designs, speeds_each
        Size of the training set: blades, and speeds of each.
    calibration_points, evaluation_points
        Independent points of the reference design space.
    seed
        Of everything; calibration and evaluation each have a seed of their own derived from it.
    threads
        Torch threads and labelling processes. With seed, thread count and machine the same, so
        are the figures.
    """

    designs: int = 32_768
    speeds_each: int = 6
    calibration_points: int = 200_000
    evaluation_points: int = 20_000
    seed: int = 2013
    threads: int = 2
    fit: FitSettings = field(default_factory=FitSettings)
    design_space: DesignSpace = field(default_factory=DesignSpace)


@dataclass(frozen=True)
class TrainingResult:
    """The written model, its held-out figures, how long each stage took, s, and why it was not promoted."""

    model: Model
    evaluation: Evaluation
    dataset_path: Path
    seconds: dict[str, float]
    refused: tuple[str, ...] = ()


def train(
    models_folder: Path,
    settings: TrainingSettings | None = None,
    *,
    data_folder: Path | None = None,
    served_folder: Path | None = None,
    activate: bool = True,
    progress: Progress = lambda stage, done, of, remark: None,
) -> TrainingResult:
    """Train a model from nothing and write it.

    Parameters
    ----------
    models_folder
        Where the model folder goes.
    data_folder
        Where the labelled dataset goes; by default a ``datasets`` folder beside the models.
    served_folder
        Where a service kept its exact answers (`training.served_answers`): their cases join the training
        set, labelled like the others.
    activate
        Promote it to the active model of its folder, unless it is worse than the one there is.

    Raises
    ------
    InvalidInput
        When there is no such `served_folder`.
    CalibrationFailed
        When no verification band keeps the false-stable bound; nothing is written then.
    """
    s = settings or TrainingSettings()
    seconds: dict[str, float] = {}
    clock = time.perf_counter()

    def lap(stage: str) -> None:
        nonlocal clock
        seconds[stage] = round(time.perf_counter() - clock, 1)
        clock = time.perf_counter()

    served = None if served_folder is None else ServedAnswers.read(served_folder)
    dataset = labelled_dataset(s, progress, served)
    dataset_path = dataset.write(data_folder or models_folder.parent / "datasets")
    lap("label")

    before = torch.get_num_threads()
    torch.set_num_threads(s.threads)
    try:
        surrogate = fit(
            dataset.cases,
            dataset.kappa,
            s.fit,
            seed=s.seed,
            progress=lambda epoch, of, loss: progress("fit", epoch, of, f"loss {loss:.4f}"),
        )
    finally:
        torch.set_num_threads(before)
    lap("fit")

    points = CalibrationSettings(s.calibration_points, s.evaluation_points, s.seed, s.threads)
    calibration = calibrated(surrogate, s.design_space, points, progress)
    lap("calibrate and evaluate")

    card = {
        "code_version": __version__,
        "seed": s.seed,
        "threads": s.threads,
        "dataset": {"sha256": dataset.digest, **dataset.provenance},
        "fit": s.fit.to_dict(),
        **calibration.card(),
    }
    model = write_model(
        surrogate, s.design_space, calibration.certificates, card, models_folder, activate_first=activate
    )
    refused = promote_unless_worse(model.id, models_folder) if activate else ()
    lap("promote")
    return TrainingResult(model, calibration.evaluation, dataset_path, seconds, refused)


def labelled_dataset(s: TrainingSettings, progress: Progress, served: ServedCases | None = None) -> Dataset:
    """Sample the design space, add what was `served`, and label it all with the exact core."""
    progress("sample", 0, s.designs, "")
    cases = s.design_space.sample(s.designs, s.speeds_each, s.seed)
    progress("sample", s.designs, s.designs, "")
    joined = None if served is None else served.for_training(s.design_space)
    if joined is not None:
        cases = CaseBatch.concatenate([cases, joined.cases])
    kappa = critical_kappa(
        cases, workers=s.threads, progress=lambda done, of: progress("label", done, of, "exact core")
    )
    provenance = {
        "design_space": s.design_space.to_dict(),
        "sampling": "scrambled Sobol",
        "designs": s.designs,
        "speeds_each": s.speeds_each,
        "seed": s.seed,
        "labels": "closed-form first crossing, proven by root count",
        "kappa_max": KAPPA_MAX,
        "code_version": __version__,
        **({} if joined is None else {"served": joined.provenance}),
    }
    return Dataset(cases, kappa, provenance)

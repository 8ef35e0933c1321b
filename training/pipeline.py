"""One command trains: sample, label, fit, ask where it is unsure, calibrate, evaluate, write."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import torch

from sdm_core.version import __version__
from training.active_learning import ActiveLearner
from training.calibration import CLASSES, CalibrationSettings, Progress, calibrated
from training.cases import CaseBatch
from training.contact_class import in_words
from training.dataset import Dataset, kept_labels
from training.design_space import DesignSpace
from training.device import chosen_device
from training.evaluation import Evaluation
from training.fit import FitSettings, fit
from training.labelling import critical_kappa
from training.monitoring import Goal, Monitor
from training.promotion import promote_unless_worse
from training.registry import Model, write_model
from training.served_answers import ServedAnswers
from training.served_cases import TrainingCases
from training.surrogate import Surrogate


@dataclass(frozen=True)
class TrainingSettings:
    """What training does; the defaults write the shipped model.

    Attributes
    ----------
    first_cases
        Labelled before the first fit, space-filling, half of them with arcs.
    cases_each, rounds
        Labelled in each round of asking, and the most rounds there are.
    round_epochs
        Of the fit after each round but the last.
    goal
        The certified figure at which asking stops; None asks in every round.
    calibration_points, evaluation_points, monitor_points
        Independent points of the reference design space in each class of contact.
    seed
        Of everything; calibration, evaluation and monitoring each have a seed of their own derived from it.
    threads
        Labelling processes. Torch fits on one thread: batches as small as these gain next to nothing from
        more, and lose much where another program wants the cores. With seed, device and machine the same, so
        are the figures.
    fit
        The last fit.
    """

    first_cases: int = 98_304
    cases_each: int = 49_152
    rounds: int = 3
    round_epochs: int = 8
    goal: Goal | None = field(default_factory=Goal)
    calibration_points: int = 200_000
    evaluation_points: int = 20_000
    monitor_points: int = 100_000
    seed: int = 2013
    threads: int = 2
    fit: FitSettings = field(default_factory=FitSettings)
    design_space: DesignSpace = field(default_factory=DesignSpace)


@dataclass(frozen=True)
class Round:
    """One round of asking: labels so far, and what the monitoring sample says of the surrogate after it.

    Attributes
    ----------
    verified_share
        By class of contact, at the goal's rate; infinite where the rate is not proven.
    """

    labels: int
    verified_share: dict[str, float]


@dataclass(frozen=True)
class TrainingResult:
    """The written model, its held-out figures by class of contact, and how long each stage took, s.

    Attributes
    ----------
    refused
        Why it was not promoted.
    """

    model: Model
    evaluations: dict[str, Evaluation]
    dataset_path: Path
    rounds: tuple[Round, ...]
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
        Where the labelled dataset goes; by default a ``datasets`` folder beside the models. Labels are kept
        there round by round, so that a training that was killed does not label again.
    served_folder
        Where a service kept its exact answers (`training.served_answers`): their cases join the training
        set, labelled like the others.
    activate
        Promote it to the active model of its folder, unless it is worse than the one there is.

    Raises
    ------
    InvalidInput
        When there is no such `served_folder`.
    InvalidInput
        For a device that is not there, before anything is done.
    CalibrationFailed
        When no verification band keeps the false-stable bound; nothing is written then.
    """
    s = settings or TrainingSettings()
    chosen_device(s.fit.device)  # before minutes of labelling, not after
    watch = _Watch()
    data_folder = data_folder or models_folder.parent / "datasets"
    served = None
    if served_folder is not None:
        served = ServedAnswers.read(served_folder).for_training(s.design_space)
    with _torch_threads(1):
        learner, rounds = asked(s, served, data_folder, progress, watch.lap)
        cases, kappa = learner.labelled
        dataset = Dataset(cases, kappa, _provenance(s, learner.labels, rounds, served))
        dataset_path = dataset.write(data_folder)
        surrogate = _fitted(learner, s, s.fit, progress, "fit")
        watch.lap("fit")

    points = CalibrationSettings(s.calibration_points, s.evaluation_points, s.seed, s.threads)
    calibration = calibrated(surrogate, s.design_space, points, progress)
    watch.lap("calibrate and evaluate")

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
    watch.lap("promote")
    return TrainingResult(model, calibration.evaluations, dataset_path, tuple(rounds), watch.seconds, refused)


def asked(
    s: TrainingSettings,
    served: TrainingCases | None,
    data_folder: Path,
    progress: Progress = lambda stage, done, of, remark: None,
    lap: Callable[[str], None] = lambda stage: None,
) -> tuple[ActiveLearner, list[Round]]:
    """Label, fit and ask again, until the goal is certified on the monitoring sample or rounds are over.

    What was `served` is labelled with the first cases. `lap` is called after each stage with its name.
    """
    learner, rounds = ActiveLearner(s.design_space, s.seed), []
    monitor = None
    for number in range(s.rounds + 1):
        stage = f"label, round {number} of {s.rounds}"
        progress(stage, 0, 1, "drawing")
        cases = learner.ask(s.cases_each if number else s.first_cases)
        if served is not None and number == 0:
            cases = CaseBatch.concatenate([cases, served.cases])

        def labelled(done: int, of: int, stage: str = stage) -> None:
            progress(stage, done, of, "exact core")

        kappa = kept_labels(
            cases,
            data_folder,
            partial(critical_kappa, cases, s.design_space, workers=s.threads, progress=labelled),
        )
        learner.tell(cases, kappa)
        lap("label")
        if number == s.rounds:
            break
        short = replace(s.fit, epochs=s.round_epochs)
        learner.learnt(_fitted(learner, s, short, progress, f"fit, round {number} of {s.rounds}"))
        lap("fit between rounds")
        if s.goal is None:
            continue
        monitor = monitor or Monitor.drawn(CLASSES, s.monitor_points, s.seed, s.threads, progress)
        shares = monitor.verified_shares(learner.surrogate, s.design_space, s.goal)
        rounds.append(Round(learner.labels, shares))
        told = ", ".join(f"{in_words(c)} {share_in_words(share)}" for c, share in shares.items())
        progress("monitor", number + 1, s.rounds + 1, f"to verify for {s.goal.alpha:g}: {told}")
        lap("monitor")
        if s.goal.reached(shares):
            break
    return learner, rounds


def share_in_words(share: float) -> str:
    """A share to verify, or that no band proves the rate."""
    return f"{share:.1%}" if share <= 1.0 else "no band proves it"


def _fitted(
    learner: ActiveLearner, s: TrainingSettings, settings: FitSettings, progress: Progress, stage: str
) -> Surrogate:
    cases, kappa = learner.labelled
    return fit(
        cases,
        kappa,
        settings,
        seed=s.seed,
        space=s.design_space,
        progress=lambda epoch, of, loss: progress(stage, epoch, of, f"loss {loss:.4f}"),
    )


def _provenance(
    s: TrainingSettings, labels: int, rounds: list[Round], served: TrainingCases | None
) -> dict[str, Any]:
    return {
        "design_space": s.design_space.to_dict(),
        "sampling": "scrambled Sobol, then by risk",
        "first_cases": s.first_cases,
        "labels": labels,
        "rounds": [{"labels": r.labels, "verified_share": r.verified_share} for r in rounds],
        "seed": s.seed,
        "labelled_by": "in permanent contact closed form, proven by root count; with arcs by verdicts",
        "code_version": __version__,
        **({} if served is None else {"served": served.provenance}),
    }


@contextmanager
def _torch_threads(count: int) -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)


class _Watch:
    """Seconds by stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._clock = time.perf_counter()

    def lap(self, stage: str) -> None:
        now = time.perf_counter()
        self.seconds[stage] = round(self.seconds.get(stage, 0.0) + now - self._clock, 1)
        self._clock = now

"""Calibration: certificate and held-out figures of a surrogate, on points of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sdm_core.version import __version__
from training.certificate import DEFAULT_ALPHA, CalibrationFailed, Certificate, certify
from training.contact_class import PERMANENT
from training.design_space import DesignSpace
from training.evaluation import Evaluation, evaluate
from training.labelling import critical_kappa
from training.promotion import promote_unless_worse
from training.reference_space import NAME, ReferenceSample, reference_sample
from training.registry import Model, load_model, write_model
from training.seeds import seed_for
from training.surrogate import Surrogate

Progress = Callable[[str, int, int, str], None]
"""Called with (stage, done, of, remark)."""


@dataclass(frozen=True)
class CalibrationSettings:
    """What a surrogate is calibrated and evaluated on; the defaults are the shipped model's.

    Attributes
    ----------
    points, evaluation_points
        Independent points of the reference design space. The strictest rate of the ladder, 1e-4, takes
        46,050 points accepted as stable without one error, 92,000 in all; more leave room for errors.
    seed
        The user's; either sample has a seed of its own derived from it.
    workers
        Labelling processes.
    """

    points: int = 200_000
    evaluation_points: int = 20_000
    seed: int = 2013
    workers: int = 2


@dataclass(frozen=True)
class Calibration:
    """What calibration found, ready for a model card."""

    certificates: tuple[Certificate, ...]
    evaluation: Evaluation
    evaluation_seed: int

    def card(self) -> dict[str, Any]:
        """The part of a model card that a calibration writes."""
        evaluated = {"seed": self.evaluation_seed, "alpha": DEFAULT_ALPHA}
        return {"evaluation": {**self.evaluation.to_dict(), **evaluated}, "calibrated_by": __version__}


def calibrated(
    surrogate: Surrogate,
    design_space: DesignSpace,
    settings: CalibrationSettings,
    progress: Progress = lambda stage, done, of, remark: None,
) -> Calibration:
    """Certify a surrogate on one independent sample, and count its mistakes on another.

    Raises
    ------
    CalibrationFailed
        When no verification band keeps `DEFAULT_ALPHA`.
    """
    seed = seed_for("calibration", settings.seed)
    sample, critical = truth(settings.points, seed, settings.workers, "calibrate", progress)
    boundary, inside = surrogate.boundary(sample.cases), design_space.contains(sample.cases)
    unstable = sample.ke > critical
    certificate = certify(
        boundary, inside, sample.ke, unstable, distribution=NAME, contact=PERMANENT, seed=seed
    )
    if DEFAULT_ALPHA not in certificate.alphas:
        raise CalibrationFailed(
            f"no band keeps a false-stable rate of {DEFAULT_ALPHA:g} on {settings.points} points"
        )

    seed = seed_for("evaluation", settings.seed)
    sample, critical = truth(settings.evaluation_points, seed, settings.workers, "evaluate", progress)
    evaluation = evaluate(
        surrogate.boundary(sample.cases),
        certificate.line().band,
        design_space.contains(sample.cases),
        sample.ke,
        critical,
        sample.ke > critical,
        distribution=NAME,
    )
    return Calibration((certificate,), evaluation, seed)


def recalibrate(
    model_id: str | None,
    folder: Path,
    settings: CalibrationSettings | None = None,
    *,
    activate: bool = True,
    progress: Progress = lambda stage, done, of, remark: None,
) -> tuple[Model, Calibration, tuple[str, ...]]:
    """Give a model of a folder a new certificate; weights and domain stay.

    A card is part of what a model is named after, so the result is another model beside the old one.

    Parameters
    ----------
    model_id
        None is the active one.
    settings
        None draws the points that a training with the model's own seed would draw. Calibrating with one
        seed after another until a certificate pleases would prove nothing.
    activate
        Promote the result, unless it is worse than the active model.

    Returns
    -------
    The model written, what calibration found, and why it was not promoted (empty where it was, or was not
    to be).

    Raises
    ------
    InvalidInput, DamagedFile
        As `load_model`.
    CalibrationFailed
        As `calibrated`; nothing is written then.
    """
    old = load_model(model_id, folder, certified=False)
    s = settings or CalibrationSettings(seed=_seed_of(old))
    found = calibrated(old.surrogate, old.design_space, s, progress)
    kept = {k: v for k, v in old.card.items() if k not in ("verification_band", "calibration", "format")}
    card = {**kept, **found.card()}
    model = write_model(
        old.surrogate, old.design_space, found.certificates, card, folder, activate_first=activate
    )
    return model, found, promote_unless_worse(model.id, folder) if activate else ()


def seed_of(model_id: str | None, folder: Path) -> int:
    """The seed that a model was trained with; None is the active model."""
    return _seed_of(load_model(model_id, folder, certified=False))


def _seed_of(model: Model) -> int:
    return int(model.card.get("seed", CalibrationSettings.seed))


def truth(
    points: int,
    seed: int,
    workers: int,
    stage: str,
    progress: Progress = lambda stage, done, of, remark: None,
) -> tuple[ReferenceSample, np.ndarray]:
    """Points of the reference space in permanent contact, and their exact first crossings, N/m."""
    sample = reference_sample(points, seed)
    kappa = critical_kappa(
        sample.cases, workers=workers, progress=lambda done, of: progress(stage, done, of, "exact core")
    )
    return sample, kappa * sample.cases.stiffness_scale

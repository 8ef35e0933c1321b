"""Calibration: certificate and held-out figures of a surrogate, on points of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sdm_core.version import __version__
from training.certificate import DEFAULT_ALPHA, CalibrationFailed, Certificate, certify
from training.contact_class import ARCS, PERMANENT, in_words
from training.design_space import DesignSpace
from training.evaluation import Evaluation, evaluate
from training.labelling import point_verdicts, truth
from training.promotion import promote_unless_worse
from training.reference_space import NAME, reference_sample
from training.registry import Model, load_model, write_model
from training.seeds import seed_for
from training.surrogate import Surrogate

CLASSES = (PERMANENT, ARCS)

Progress = Callable[[str, int, int, str], None]
"""Called with (stage, done, of, remark)."""


@dataclass(frozen=True)
class CalibrationSettings:
    """What a surrogate is calibrated and evaluated on; the defaults are the shipped model's.

    Attributes
    ----------
    points, evaluation_points
        Independent points of the reference design space in each class of contact. The strictest rate of the
        ladder, 1e-4, takes 46,050 points accepted as stable without one error, 92,000 in all; more leave
        room for errors.
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
    """What calibration found, ready for a model card; evaluations by class of contact."""

    certificates: tuple[Certificate, ...]
    evaluations: dict[str, Evaluation]
    evaluation_seeds: dict[str, int]

    def card(self) -> dict[str, Any]:
        """The part of a model card that a calibration writes."""
        evaluated = {
            contact: {**found.to_dict(), "seed": self.evaluation_seeds[contact], "alpha": DEFAULT_ALPHA}
            for contact, found in self.evaluations.items()
        }
        return {"evaluation": evaluated, "calibrated_by": __version__}


def calibrated(
    surrogate: Surrogate,
    design_space: DesignSpace,
    settings: CalibrationSettings,
    progress: Progress = lambda stage, done, of, remark: None,
) -> Calibration:
    """Certify a surrogate on an independent sample of each class of contact, count its mistakes on others.

    Raises
    ------
    CalibrationFailed
        When no verification band keeps `DEFAULT_ALPHA` in one of the classes.
    """
    certificates, evaluations, seeds = [], {}, {}
    for contact in CLASSES:
        certificate = certified(surrogate, design_space, contact, settings, progress)
        if DEFAULT_ALPHA not in certificate.alphas:
            raise CalibrationFailed(
                f"no band keeps a false-stable rate of {DEFAULT_ALPHA:g} in {in_words(contact)} "
                f"on {settings.points} points"
            )
        certificates.append(certificate)
    for certificate in certificates:
        contact = certificate.contact
        seeds[contact] = seed_for(_purpose("evaluation", contact), settings.seed)
        sample = reference_sample(settings.evaluation_points, seeds[contact], contact)
        inside = design_space.contains(sample.cases, sample.ke)

        def report(done: int, of: int, contact: str = contact) -> None:
            progress("evaluate", done, of, in_words(contact))

        critical, unstable = truth(sample.cases, sample.ke, workers=settings.workers, progress=report)
        evaluations[contact] = evaluate(
            surrogate.boundary(sample.cases),
            certificate.line().band,
            inside,
            sample.ke,
            critical,
            unstable,
            distribution=NAME,
            ke_max=design_space.largest_ke(sample.cases),
        )
    return Calibration(tuple(certificates), evaluations, seeds)


def certified(
    surrogate: Surrogate,
    design_space: DesignSpace,
    contact: str,
    settings: CalibrationSettings,
    progress: Progress = lambda stage, done, of, remark: None,
) -> Certificate:
    """The certificate of one class of contact, of verdicts at points drawn for nothing else."""
    seed = seed_for(_purpose("calibration", contact), settings.seed)
    sample = reference_sample(settings.points, seed, contact)
    stable = point_verdicts(
        sample.cases,
        sample.ke,
        workers=settings.workers,
        progress=lambda done, of: progress("calibrate", done, of, in_words(contact)),
    )
    inside = design_space.contains(sample.cases, sample.ke)
    boundary = surrogate.boundary(sample.cases)
    # A point that the exact core leaves undecided counts as unstable: to call it stable is an error.
    return certify(boundary, inside, sample.ke, stable != 1.0, distribution=NAME, contact=contact, seed=seed)


def _purpose(stage: str, contact: str) -> str:
    return stage if contact == PERMANENT else f"{stage}, {contact}"


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

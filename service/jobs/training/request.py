"""What a training job is asked, as it is kept in its folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from training.fit import FitSettings
from training.pipeline import TrainingSettings

_USUAL = TrainingSettings()


@dataclass(frozen=True)
class TrainingRequest:
    """Size and seed of a training, and what becomes of the model; the defaults are those of the shipped one.

    Attributes
    ----------
    seed
        Of everything drawn by chance.
    first_cases, cases_each, rounds, epochs, points, evaluation_points
        As of `training.pipeline.TrainingSettings`; `points` are those of the certificate.
    threads
        Labelling processes.
    device
        Where torch fits.
    with_served
        Train on what the service answered exactly, too.
    promote
        Make the model the active one, unless the gate refuses it.
    """

    seed: int
    first_cases: int = _USUAL.first_cases
    cases_each: int = _USUAL.cases_each
    rounds: int = _USUAL.rounds
    epochs: int = _USUAL.fit.epochs
    points: int = _USUAL.calibration_points
    evaluation_points: int = _USUAL.evaluation_points
    threads: int = _USUAL.threads
    device: str = "auto"
    with_served: bool = False
    promote: bool = True

    def settings(self) -> TrainingSettings:
        """For the pipeline."""
        return TrainingSettings(
            first_cases=self.first_cases,
            cases_each=self.cases_each,
            rounds=self.rounds,
            monitor_points=min(self.points, _USUAL.monitor_points),
            calibration_points=self.points,
            evaluation_points=self.evaluation_points,
            seed=self.seed,
            threads=self.threads,
            fit=FitSettings(epochs=self.epochs, device=self.device),
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> TrainingRequest:
        """From the JSON of `to_dict`."""
        return cls(**data)

"""What screening code needs: something that answers, here or over the network."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from training.answers import BoundaryAnswers, MapAnswers, PointAnswers, SensitivityAnswers


class Answerer(Protocol):
    """Answers stability questions: a `training.screening.Screener` or a `service.client.Client`.

    `alpha` is the rate of unstable designs called stable that the answers must keep; None leaves it to
    the model.
    """

    def points(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> PointAnswers:
        """Verdicts at points (speed_hz[i], ke[i])."""
        ...

    def boundary(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke_max: float,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> BoundaryAnswers:
        """The first crossing at each speed."""
        ...

    def sensitivities(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke_max: float,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> SensitivityAnswers:
        """What moves the first crossing at each speed."""
        ...

    def map(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> MapAnswers:
        """Verdicts on the grid of speeds and stiffnesses."""
        ...

"""An answerer whose answers are counted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from service.answerer import Answerer
from service.operation.metrics import Metrics
from training.answers import BoundaryAnswers, MapAnswers, PointAnswers, SensitivityAnswers


@dataclass(frozen=True)
class CountedAnswerer:
    """Answers as `answerer` does, and tells `metrics` who answered and why."""

    answerer: Answerer
    metrics: Metrics

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
        found = self.answerer.points(blade, contact, speed_hz, ke, policy, alpha)
        self.metrics.count_answers("stability", contact, found.source, found.reason)
        return found

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
        found = self.answerer.boundary(blade, contact, speed_hz, ke_max, policy, alpha)
        self.metrics.count_answers("boundary", contact, found.source, found.reason)
        return found

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
        found = self.answerer.sensitivities(blade, contact, speed_hz, ke_max, policy, alpha)
        self.metrics.count_answers("sensitivities", contact, found.source, found.reason)
        return found

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
        found = self.answerer.map(blade, contact, speed_hz, ke, policy, alpha)
        self.metrics.count_answers("map", contact, found.source, found.reason)
        return found

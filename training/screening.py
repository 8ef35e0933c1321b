"""The one function that decides: surrogate or exact core."""

from __future__ import annotations

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from training.answers import BoundaryAnswers, MapAnswers, PointAnswers


class Screener:
    """Answers stability questions from the surrogate where it is sure, else from the exact core."""

    def points(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray,
        policy: str = "auto",
    ) -> PointAnswers: ...

    def boundary(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke_max: float,
        policy: str = "auto",
    ) -> BoundaryAnswers: ...

    def map(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray,
        policy: str = "auto",
    ) -> MapAnswers: ...

"""A stand-in for the screener whose lobes are known in closed form."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from typer.testing import CliRunner

from sdm_core.blade import Blade, ModalState
from sdm_core.contact import ContactConfiguration
from service import cli
from training.answers import BoundaryAnswers, MapAnswers, PointAnswers


@dataclass
class ParabolicLobes:
    """Lobes that are parabolas in x = f/Ω round x = k + 1/4, for whatever blade and contact.

    K_e = depth · (1 + rise·|k − deepest| + 30 (x − k − 1/4)²) over the sum of the contact's weights.
    """

    frequency_hz: float = 600.0
    depth: float = 4000.0
    deepest: int = 5
    rise: float = 0.02
    blind_surrogate: bool = False
    error: float = 1e-12
    asked: list[tuple[str, str, int]] = field(default_factory=list)
    model_id: str = "parabolas"

    def critical_ke(self, contact: ContactConfiguration, speed_hz: np.ndarray) -> np.ndarray:
        x = self.frequency_hz / speed_hz
        k = np.round(x - 0.25)
        ke = self.depth * (1 + self.rise * np.abs(k - self.deepest) + 30 * (x - k - 0.25) ** 2)
        return ke / sum(contact.weights.values())

    def deepest_tip_hz(self) -> float:
        return self.frequency_hz / (self.deepest + 0.25)

    def points(self, blade, contact, speed_hz, ke, policy="auto", alpha=None) -> PointAnswers:
        raise AssertionError("screening asks for boundaries and maps")

    def boundary(self, blade, contact, speed_hz, ke_max, policy="auto", alpha=None) -> BoundaryAnswers:
        self.asked.append(("boundary", policy, len(speed_hz)))
        exact = policy == "exact"
        ke = self.critical_ke(contact, speed_hz)
        ke[(ke > ke_max) | (self.blind_surrogate and not exact)] = np.nan
        intervals = tuple(() if np.isnan(k) else ((float(k), ke_max),) for k in ke)
        return BoundaryAnswers(
            speed_hz,
            ke_max,
            ke,
            np.where(np.isnan(ke), np.nan, self.frequency_hz),
            np.full(len(ke), self.error),
            intervals if exact else (None,) * len(ke),
            np.full(len(ke), "exact" if exact else "surrogate"),
            np.full(len(ke), "requested" if exact else "confident"),
            self.model_id,
            "parabola",
        )

    def map(self, blade, contact, speed_hz, ke, policy="auto", alpha=None) -> MapAnswers:
        self.asked.append(("map", policy, len(speed_hz) * len(ke)))
        unstable = ke[:, None] >= self.critical_ke(contact, speed_hz)[None, :]
        source = np.full(unstable.shape, "surrogate")
        source[:, ::10] = "exact"
        return MapAnswers(
            speed_hz,
            ke,
            np.where(unstable, 0.0, 1.0),
            np.where(source == "exact", np.nan, unstable),
            source,
            np.where(source == "exact", "near_boundary", "confident"),
            self.model_id,
            "parabola",
        )


@pytest.fixture
def lobes() -> ParabolicLobes:
    return ParabolicLobes()


@pytest.fixture
def blade() -> Blade:
    """One mode at 600 Hz, two tip nodes, design speed 200 Hz."""
    return Blade(
        "one-mode", ("LE", "TE"), 1e-3, [ModalState(0.0, [600.0], [[1.0, 0.5]])], design_speed_hz=200.0
    )


@pytest.fixture
def rubscreen():
    """Run the command line in this process."""

    def run(*arguments: str):
        return CliRunner().invoke(cli.app, list(arguments), env={"COLUMNS": "200", "TERM": "dumb"})

    return run

"""What is compared: each method answers one point at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from benchmarks.named_charts import Chart
from benchmarks.textbook import STEPS, spectral_radius, spectral_radius_with_arcs
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.stability import stability


@dataclass(frozen=True)
class Answer:
    """What a method says of one point.

    Attributes
    ----------
    unstable
        None where it does not decide.
    radius
        |μ|, NaN where it does not give it.
    """

    unstable: bool | None
    radius: float


class Method(Protocol):
    """One of the methods compared.

    Attributes
    ----------
    name
        As the table shows it.
    most_points
        Points of a chart it is asked: fewer where it is slow.
    """

    name: str
    most_points: int

    def cannot(self, chart: Chart) -> str:
        """Why it has no answer for this chart; empty where it has."""
        ...

    def prepare(self, chart: Chart) -> None:
        """What is done once a chart and timed apart."""
        ...

    def answer(self, problem: RubbingBlade) -> Answer:
        """The verdict on one point, and |μ| where the method gives it."""
        ...


@dataclass(frozen=True)
class Multipliers:
    """rubscreen's `stability`: the dominant multiplier with its error, the verdict proven."""

    name: str = "rubscreen, multipliers"
    most_points: int = 400

    def cannot(self, chart: Chart) -> str:
        return ""

    def prepare(self, chart: Chart) -> None: ...

    def answer(self, problem: RubbingBlade) -> Answer:
        found = stability(problem, truncation=False)
        radius = found.spectral_radius if np.isfinite(found.error_estimate) else np.nan
        return Answer(None if found.stable is None else not found.stable, radius)


@dataclass(frozen=True)
class Textbook:
    """Averaged semi-discretization, dense."""

    name: str = f"textbook, N = {STEPS}"
    most_points: int = 400

    def cannot(self, chart: Chart) -> str:
        return ""

    def prepare(self, chart: Chart) -> None: ...

    def answer(self, problem: RubbingBlade) -> Answer:
        p = problem
        arguments = (p.omega, p.damping_ratio, p.contact_matrix, p.speed_hz, p.ke)
        radius = (
            spectral_radius(*arguments) if p.arcs is None else spectral_radius_with_arcs(*arguments, p.arcs)
        )
        return Answer(radius > 1.0, radius)

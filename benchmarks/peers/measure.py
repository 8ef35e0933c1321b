"""Time, errors and wrong verdicts of each method on each chart."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from rich.progress import Progress, track

from benchmarks.named_charts import Chart
from benchmarks.peers.methods import Method
from benchmarks.peers.truth import Truth
from sdm_core.boundary import verdicts

WHOLE_CHART = "rubscreen, verdicts"


@dataclass(frozen=True)
class Row:
    """One method on one chart.

    Attributes
    ----------
    cannot
        Why there is nothing to report, or empty.
    points
        How many were asked.
    seconds
        Mean time a point, s.
    chart_seconds
        Time of the whole chart, s, from the mean where not all points were asked.
    preparation
        Done once before, s, and not in the times above.
    errors
        Relative errors of |μ| where the method gives it.
    judged
        Verdicts compared with the truth; the others are of points where it is not known.
    undecided
        Points where the method did not decide.
    """

    chart: str
    method: str
    cannot: str = ""
    points: int = 0
    seconds: float = np.nan
    chart_seconds: float = np.nan
    preparation: float = 0.0
    errors: np.ndarray | None = None
    judged: int = 0
    false_stable: int = 0
    false_unstable: int = 0
    undecided: int = 0


def whole_chart(chart: Chart, truth: Truth) -> Row:
    """rubscreen as it is meant to be used: one call for all verdicts."""
    with Progress(transient=True) as progress:
        task = progress.add_task(f"{chart.name}: {WHOLE_CHART}", total=len(chart))
        start = time.perf_counter()
        stable = verdicts(
            chart.blade,
            chart.contact,
            chart.speed_hz,
            chart.ke,
            progress=lambda done, _: progress.update(task, completed=done),
            workers=1,
        )
        took = time.perf_counter() - start
    return Row(
        chart.name,
        WHOLE_CHART,
        points=len(chart),
        seconds=took / len(chart),
        chart_seconds=took,
        **_judged(1.0 - stable, truth.unstable),
    )


def point_by_point(chart: Chart, method: Method, truth: Truth) -> Row:
    """A method that answers one point at a time, on the first points of the sample."""
    reason = method.cannot(chart)
    if reason:
        return Row(chart.name, method.name, reason)
    asked = truth.sample[: method.most_points]
    problems = [chart.problem(i) for i in asked]
    start = time.perf_counter()
    method.prepare(chart)
    preparation = time.perf_counter() - start
    method.answer(problems[0])  # the first call pays for what is loaded late
    answers, took = [], 0.0
    for problem in track(problems, f"{chart.name}: {method.name}", transient=True):
        start = time.perf_counter()
        answers.append(method.answer(problem))
        took += time.perf_counter() - start
    unstable = np.array([np.nan if a.unstable is None else float(a.unstable) for a in answers])
    errors = np.abs(np.array([a.radius for a in answers]) / truth.radius[: len(asked)] - 1.0)
    return Row(
        chart.name,
        method.name,
        points=len(asked),
        seconds=took / len(asked),
        chart_seconds=took / len(asked) * len(chart),
        preparation=preparation,
        errors=errors[~np.isnan(errors)],
        **_judged(unstable, truth.unstable[asked]),
    )


def _judged(said: np.ndarray, unstable: np.ndarray) -> dict[str, int]:
    known = ~np.isnan(unstable)
    return {
        "judged": int(known.sum()),
        "false_stable": int(((said == 0.0) & (unstable == 1.0)).sum()),
        "false_unstable": int(((said == 1.0) & (unstable == 0.0)).sum()),
        "undecided": int(np.isnan(said).sum()),
    }

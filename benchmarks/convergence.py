"""Convergence orders of every semi-discretization beside theory, and what they cost up to N = 10,000."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from rich.console import Console, Group
from rich.table import Table
from threadpoolctl import threadpool_limits

from benchmarks.named_charts import benchmark_chart
from sdm_core.collocation import Collocation
from sdm_core.delay_equation import DelayEquation, delayed_mathieu
from sdm_core.floquet.characteristic import CharacteristicEquation
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.semi_discretization import Averaged, Gauss, Linear, StructuredAveraged

STEPS = (5, 10, 20, 40, 80, 160, 320, 640, 1250, 2500, 5000, 10_000)
MOST_DENSE = 640
FIGURE = Path("out/bench/convergence.png")
_FITTED = (1e-12, 2e-2)  # relative errors between rounding and where a scheme begins to converge
_MOST_FITTED = 4
_LONG = 1000  # steps from which time and memory are fitted: below, what does not depend on N shows

Multipliers = Callable[[DelayEquation], np.ndarray]


@dataclass(frozen=True)
class Scheme:
    """A method by name: its theoretical order, and its leading multipliers at N steps."""

    name: str
    order: int
    at: Callable[[int], Multipliers]
    most_steps: int = STEPS[-1]


def _pair(make: Callable[[int], StructuredAveraged | Linear | Gauss]) -> Callable[[int], Multipliers]:
    return lambda steps: lambda equation: make(steps).multipliers(equation, 2)


SCHEMES = (
    Scheme("dense averaged", 2, lambda steps: Averaged(steps).multipliers, MOST_DENSE),
    Scheme("averaged", 2, _pair(StructuredAveraged)),
    Scheme("averaged, aligned", 2, _pair(lambda steps: StructuredAveraged(steps, aligned=True))),
    Scheme("linear, aligned", 2, _pair(lambda steps: Linear(steps, aligned=True))),
    Scheme("Gauss, 2 nodes", 4, _pair(lambda steps: Gauss(steps, 2))),
    Scheme("Gauss, 3 nodes", 6, _pair(lambda steps: Gauss(steps, 3))),
    Scheme("Gauss, 4 nodes", 8, _pair(lambda steps: Gauss(steps, 4))),
)


@dataclass(frozen=True)
class Problem:
    """A delay equation and |μ| of its dominant multiplier, from a method that has no steps."""

    name: str
    equation: DelayEquation
    radius: float


@dataclass(frozen=True)
class Measured:
    """One scheme on one problem.

    Attributes
    ----------
    steps
        N, shape (k,).
    error
        Relative error of |μ|, shape (k,).
    seconds
        Of one solution, shape (k,).
    peak_mb
        Largest memory allocated at a time, MB, shape (k,).
    """

    problem: Problem
    scheme: Scheme
    steps: np.ndarray
    error: np.ndarray
    seconds: np.ndarray
    peak_mb: np.ndarray

    @property
    def fitted(self) -> np.ndarray:
        """Places of the finest few errors above rounding."""
        low, high = _FITTED
        return np.flatnonzero((self.error > low) & (self.error < high))[-_MOST_FITTED:]

    @property
    def order(self) -> float:
        """Slope through the fitted errors; NaN where there are fewer than two."""
        at = self.fitted
        return -_slope(self.steps[at], self.error[at]) if len(at) > 1 else np.nan


def problems() -> list[Problem]:
    """Permanent contact, two quarters (no N cuts the revolution at their ends) and delayed Mathieu."""
    out = []
    for name, arcs in (("permanent contact", None), ("two arcs", [[0.1234, 0.3734], [0.5731, 0.8231]])):
        chart = benchmark_chart(arcs)
        blade = RubbingBlade.from_blade(chart.blade, chart.contact, 0.1, 0.05 * (2 * np.pi) ** 2)
        out.append(Problem(name, blade.delay_equation(), abs(CharacteristicEquation(blade).dominant()[0])))
    mathieu = delayed_mathieu(3.0, 2.0, -0.15, 0.1)
    out.append(Problem("delayed Mathieu", mathieu, abs(Collocation(64).multipliers(mathieu, 1)[0])))
    return out


def measured(problem: Problem, scheme: Scheme) -> Measured:
    """Errors, times and memory of one scheme over all N."""
    steps = np.array([n for n in STEPS if n <= scheme.most_steps])
    error, seconds, peak = np.empty(len(steps)), np.empty(len(steps)), np.empty(len(steps))
    for i, n in enumerate(steps):
        solve = scheme.at(int(n))
        tracemalloc.start()
        error[i] = abs(abs(solve(problem.equation)[0]) / problem.radius - 1)
        peak[i] = tracemalloc.get_traced_memory()[1] / 1e6
        tracemalloc.stop()
        took = []
        while len(took) < 3 and sum(took) < 1.0:
            start = time.perf_counter()
            solve(problem.equation)
            took.append(time.perf_counter() - start)
        seconds[i] = min(took)
    return Measured(problem, scheme, steps, error, seconds, peak)


def orders(results: list[Measured]) -> Table:
    """Fitted orders beside theory."""
    out = Table(title="Order of the error of |μ| in the step")
    for column in (
        "problem",
        "method",
        "fitted order",
        "theory",
        "N fitted",
        "error at N = 40",
        "at 160",
        "at 640",
    ):
        out.add_column(column)
    for one in results:
        at = one.fitted
        over = f"{one.steps[at[0]]}–{one.steps[at[-1]]}" if len(at) > 1 else "–"
        errors = [f"{one.error[one.steps == n][0]:.1e}" if n in one.steps else "" for n in (40, 160, 640)]
        theory = str(one.scheme.order)
        out.add_row(one.problem.name, one.scheme.name, f"{one.order:.2f}", theory, over, *errors)
    return out


def costs(results: list[Measured]) -> Table:
    """Time and memory at the largest N, and the powers of N they grow with."""
    out = Table(title=f"Cost at the largest N; exponents fitted from N = {_LONG} up (dense: from 80)")
    for column in ("problem", "method", "N", "time", "time ∝ N^", "peak memory", "memory ∝ N^"):
        out.add_column(column)
    for one in results:
        long = one.steps >= (_LONG if one.steps[-1] > _LONG else 80)
        out.add_row(
            one.problem.name,
            one.scheme.name,
            f"{one.steps[-1]:,}",
            f"{1e3 * one.seconds[-1]:.1f} ms",
            f"{_slope(one.steps[long], one.seconds[long]):.2f}",
            f"{one.peak_mb[-1]:.1f} MB",
            f"{_slope(one.steps[long], one.peak_mb[long]):.2f}",
        )
    return out


def figure(results: list[Measured]) -> Figure:
    """Errors against N for each problem; time and memory against N."""
    out = Figure(figsize=(16, 9.5), layout="constrained")
    FigureCanvasAgg(out)
    axes = out.subplots(2, 3)
    names = list(dict.fromkeys(one.problem.name for one in results))
    for axis, name in zip(axes[0], names, strict=True):
        for one in (r for r in results if r.problem.name == name):
            _line(axis, one, np.maximum(one.error, 1e-16))
        axis.set(title=name, ylabel="relative error of |μ|", ylim=(1e-16, 10))
    for axis, name in zip(axes[1], (names[1], names[2], names[2]), strict=True):
        memory = axis is axes[1, 2]
        for one in (r for r in results if r.problem.name == name):
            _line(axis, one, one.peak_mb if memory else one.seconds)
        axis.set(title=name, ylabel="peak memory, MB" if memory else "time of one solution, s")
    for axis in axes.flat:
        axis.set(xscale="log", yscale="log", xlabel="steps per revolution N")
        axis.grid(True, which="major", alpha=0.35)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    out.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=12)
    return out


def _line(axis: Axes, one: Measured, values: np.ndarray) -> None:
    place = SCHEMES.index(one.scheme)
    label = f"{one.scheme.name} (order {one.scheme.order})"
    hollow = {"markersize": 10, "markerfacecolor": "none"} if place == 0 else {"markersize": 5}
    axis.plot(one.steps, values, f"{'sovD^*x'[place]}-", color=f"C{place}", label=label, **hollow)


def _slope(x: np.ndarray, y: np.ndarray) -> float:
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def table() -> Group:
    """Measure all, draw `FIGURE`, and both tables."""
    with threadpool_limits(1):
        results = [measured(problem, scheme) for problem in problems() for scheme in SCHEMES]
    FIGURE.parent.mkdir(parents=True, exist_ok=True)
    figure(results).savefig(FIGURE, dpi=110)
    return Group(orders(results), costs(results), f"Drawn: {FIGURE}")


def main() -> None:
    Console(width=150).print(table())


if __name__ == "__main__":
    main()

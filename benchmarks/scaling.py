"""What an answer costs as modes, nodes, points and steps grow, with fitted exponents."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from rich.console import Console, Group
from rich.progress import track
from rich.table import Table
from threadpoolctl import threadpool_limits

from benchmarks.random_blades import random_rubbing_blade
from sdm_core.floquet.arc_boundary import boundaries_with_arcs
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.permanent_contact.permanent_boundary import permanent_crossings
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.semi_discretization import Averaged, Gauss, StructuredAveraged

FIGURE = Path("out/bench/scaling.png")
MODES, NODES, POINTS = (1, 2, 3, 4, 5, 6, 8, 10), (1, 3, 9, 27, 81), (1, 4, 16, 64, 256)
STEPS = (20, 40, 80, 160, 320, 640, 1280, 2560, 5120, 10_240)
MOST_DENSE = 640
SPEEDS, STRENGTH = 16, 2.0
REPEATS, LONG = 3, 1.0

Work = Callable[[list[RubbingBlade]], object]


@dataclass(frozen=True)
class Line:
    """Seconds of one method against what grows; the fit is over its upper half."""

    method: str
    against: str
    x: np.ndarray
    seconds: np.ndarray

    @property
    def exponent(self) -> float:
        upper = slice(len(self.x) // 2 - 1, None)
        return float(np.polyfit(np.log(self.x[upper]), np.log(self.seconds[upper]), 1)[0])


def _over_speeds(
    problems: list[RubbingBlade], solve: Callable[[list[RubbingBlade], float], object]
) -> object:
    return solve(problems, STRENGTH * float(np.median([p.ke for p in problems])))


METHODS: dict[str, tuple[bool, Work]] = {
    "multipliers, arcs, a point": (True, lambda problems: batch_multipliers(problems, workers=1)),
    "boundary, arcs, a speed": (
        True,
        lambda problems: _over_speeds(problems, lambda p, k: boundaries_with_arcs(p, k, workers=1)),
    ),
    "boundary, permanent, a speed": (False, lambda problems: _over_speeds(problems, permanent_crossings)),
}


def blades(count: int, *, modes: int = 3, nodes: int = 3, arcs: bool) -> list[RubbingBlade]:
    """Random points of weak to moderate contact with equally many modes and nodes."""
    rng = np.random.default_rng(modes + 100 * nodes)
    found: list[RubbingBlade] = []
    while len(found) < count:
        problem = random_rubbing_blade(rng, modes, nodes, arcs=arcs)
        shift = np.trace(problem.contact_matrix / problem.omega[:, None]) * problem.tau * problem.ke
        if shift < 1.0:
            found.append(problem)
    return found


def seconds(work: Callable[[], object]) -> float:
    """Of the fastest of a few runs."""
    best, spent = np.inf, 0.0
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        taken = time.perf_counter() - start
        best, spent = min(best, taken), spent + taken
        if spent > LONG:
            break
    return best


def measured() -> list[Line]:
    """Every method against modes, nodes and points, and the schemes against steps."""
    lines = []
    for method, (arcs, work) in METHODS.items():
        for against, grid in (("modes n", MODES), ("nodes r", NODES), ("points in a call", POINTS)):
            taken = []
            for size in track(grid, f"{method}: {against}", transient=True):
                count = size if against == "points in a call" else SPEEDS
                shape = {"modes": size} if against == "modes n" else {"nodes": size}
                problems = blades(count, arcs=arcs, **({} if against == "points in a call" else shape))
                taken.append(seconds(lambda p=problems, work=work: work(p)) / len(problems))
            lines.append(Line(method, against, np.array(grid, float), np.array(taken)))
    equation = blades(1, arcs=True)[0].delay_equation()
    for name, make in (
        ("dense averaged", Averaged),
        ("averaged on the contact history", StructuredAveraged),
        ("Gauss, order 6", Gauss),
    ):
        grid = [n for n in STEPS if make is not Averaged or n <= MOST_DENSE]
        taken = [
            seconds(lambda n=n, make=make: make(n).multipliers(equation))
            for n in track(grid, name, transient=True)
        ]
        lines.append(Line(name, "steps N", np.array(grid, float), np.array(taken)))
    return lines


def figure(lines: list[Line]) -> Figure:
    """One panel for each thing that grows."""
    panels = list(dict.fromkeys(line.against for line in lines))
    out = Figure(figsize=(12, 9), layout="constrained")
    FigureCanvasAgg(out)
    for axis, against in zip(out.subplots(2, 2).flat, panels, strict=True):
        for line, mark in zip([x for x in lines if x.against == against], "os^", strict=False):
            label = f"{line.method} ∝ {against.split()[-1]}^{line.exponent:.1f}"
            axis.loglog(line.x, 1e3 * line.seconds, marker=mark, label=label.replace("call^", "points^"))
        axis.set_xlabel(against)
        axis.set_ylabel("ms")
        axis.grid(True, which="both", alpha=0.3)
        axis.legend(fontsize=9)
    out.suptitle("Cost of an answer, one thread; exponents fitted over the upper half")
    return out


def table() -> Group:
    """Times and fitted exponents; draws `FIGURE`."""
    with threadpool_limits(1):
        lines = measured()
    FIGURE.parent.mkdir(parents=True, exist_ok=True)
    figure(lines).savefig(FIGURE, dpi=120)
    out = Table(title=f"Cost, one thread; drawn in {FIGURE}")
    for name in ("method", "against", "from", "to", "ms at first", "ms at last", "exponent"):
        out.add_column(name, justify="left" if name in ("method", "against") else "right")
    for line in lines:
        out.add_row(
            line.method,
            line.against,
            f"{line.x[0]:g}",
            f"{line.x[-1]:g}",
            f"{1e3 * line.seconds[0]:.3g}",
            f"{1e3 * line.seconds[-1]:.3g}",
            f"{line.exponent:.2f}",
        )
    return Group(out)


def main() -> None:
    """Measure, draw and print."""
    Console(width=150).print(table())


if __name__ == "__main__":
    main()

"""Adaptive maps: edges followed over speed against multi-dimensional bisection and the full grid."""

from __future__ import annotations

import time

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from threadpoolctl import threadpool_limits

from benchmarks.named_charts import Chart, benchmark_chart, two_arcs_chart
from sdm_core.adaptive_map import adaptive_map
from sdm_core.boundary import verdicts

START, LEVELS = (97, 25), 2


def bisected(chart: Chart) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Verdicts on a grid of START·2^LEVELS cells, asked for only where corners of a cell differ.

    Multi-dimensional bisection (Bachrathy and Stépán 2012): cells with a change of verdict and their
    neighbours are halved in both directions; the others keep the verdict of their corners.
    """
    fine = 2**LEVELS
    shape = (START[0] - 1) * fine + 1, (START[1] - 1) * fine + 1
    period = np.linspace(1 / chart.speed_hz.max(), 1 / chart.speed_hz.min(), shape[0])
    ke = np.linspace(chart.ke.min(), chart.ke.max(), shape[1])
    found, asked = np.full(shape, -1.0), 0
    cells = [(i * fine, j * fine) for i in range(START[0] - 1) for j in range(START[1] - 1)]
    step = fine
    while step >= 1:
        corners = sorted({(i + a, j + b) for i, j in cells for a in (0, step) for b in (0, step)})
        new = np.array([c for c in corners if found[c] < 0], dtype=int).reshape(-1, 2)
        if len(new):
            answer = verdicts(chart.blade, chart.contact, 1 / period[new[:, 0]], ke[new[:, 1]])
            found[new[:, 0], new[:, 1]] = np.nan_to_num(answer, nan=0.0)
            asked += len(new)
        mixed = {
            (i, j) for i, j in cells if len({found[i + a, j + b] for a in (0, step) for b in (0, step)}) > 1
        }
        near = {(i + a * step, j + b * step) for i, j in mixed for a in (-1, 0, 1) for b in (-1, 0, 1)}
        for i, j in cells:
            if (i, j) not in near or step == 1:
                block = found[i : i + step + 1, j : j + step + 1]
                block[block < 0] = found[i, j]
        half = step // 2
        cells = [(i + a, j + b) for i, j in cells if (i, j) in near for a in (0, half) for b in (0, half)]
        step = half
    return 1 / period, ke, found, asked


def table() -> Table:
    """Time, questions asked and wrong verdicts of each way to the same map."""
    out = Table(title=f"Maps of {(START[0] - 1) * 2**LEVELS + 1} × {(START[1] - 1) * 2**LEVELS + 1} points")
    for name in ("chart", "way", "s", "asked for", "wrong of all"):
        out.add_column(name, justify="left" if name in ("chart", "way") else "right")
    with threadpool_limits(1):
        for chart in track((benchmark_chart(), two_arcs_chart()), "maps", transient=True):
            start = time.perf_counter()
            speed, ke, found, asked = bisected(chart)
            bisection = time.perf_counter() - start
            start = time.perf_counter()
            ours = adaptive_map(chart.blade, chart.contact, float(speed[-1]), float(speed[0]), float(ke[-1]))
            adaptive = time.perf_counter() - start
            start = time.perf_counter()
            grid = np.meshgrid(speed, ke, indexing="ij")
            every = verdicts(chart.blade, chart.contact, grid[0].ravel(), grid[1].ravel()).reshape(
                found.shape
            )
            full = time.perf_counter() - start
            mine = ours.stable(*grid)
            sure = ~np.isnan(every)
            for way, seconds, number, answer in (
                ("every point", full, f"{every.size} points", every),
                ("multi-dimensional bisection", bisection, f"{asked} points", found),
                ("edges over speed", adaptive, f"{len(ours.boundary.speed_hz)} speeds", mine),
            ):
                wrong = int((answer[sure] != every[sure]).sum())
                out.add_row(chart.name, way, f"{seconds:.3g}", number, str(wrong))
    return out


def main() -> None:
    """Measure and print."""
    Console(width=150).print(table())


if __name__ == "__main__":
    main()

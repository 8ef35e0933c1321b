"""The comparison with peers as a table and a picture."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from rich.table import Table
from threadpoolctl import threadpool_limits

from benchmarks.named_charts import Chart, benchmark_chart, rotor_37_chart, two_arcs_chart
from benchmarks.peers.jitcdde_growth import JitcddeGrowth
from benchmarks.peers.measure import Row, point_by_point, whole_chart
from benchmarks.peers.methods import Method, Multipliers, Textbook
from benchmarks.peers.tdcpy_roots import TdcpyRoots
from benchmarks.peers.truth import Truth, truth

SAMPLE = 400
PICTURE = Path("out/bench/peers.png")
COLUMNS = (
    "",
    "points asked",
    "ms a point",
    "whole chart, s",
    "faster than textbook",
    "error of |μ|: median",
    "worst",
    "verdicts judged",
    "false stable",
    "false unstable",
    "not decided",
)


def table() -> Table:
    """Measure every method on every chart; write the picture; return the table."""
    ours_and_textbook: list[Method] = [Multipliers(), Textbook()]
    everyone: list[Method] = [*ours_and_textbook, TdcpyRoots(), JitcddeGrowth()]
    out = Table(title="rubscreen beside its peers: one process, one thread")
    for i, column in enumerate(COLUMNS):
        out.add_column(column, justify="right" if i else "left", no_wrap=not i)
    rows, notes = [], []
    with threadpool_limits(1):
        for chart, methods in (
            (benchmark_chart(), everyone),
            (two_arcs_chart(), everyone),
            (rotor_37_chart(), ours_and_textbook),
        ):
            known = truth(chart, chart.sample(SAMPLE))
            found = [whole_chart(chart, known), *(point_by_point(chart, m, known) for m in methods)]
            rows += found
            notes.append(_note(chart, known, found))
            out.add_section()
            out.add_row(chart.name, style="bold")
            for row in found:
                out.add_row(*_cells(row, _textbook_seconds(found)))
    draw(rows, PICTURE)
    out.caption = "\n".join([*notes, f"picture: {PICTURE}"])
    return out


def draw(rows: list[Row], path: Path) -> None:
    """Milliseconds a point beside wrong verdicts, method by method."""
    labels = [row.method for row in rows]
    charts = list(dict.fromkeys(row.chart for row in rows))
    # A gap between charts, which are read from the top.
    height = -np.array([i + 0.9 * charts.index(row.chart) for i, row in enumerate(rows)])
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 6.2), sharey=True, layout="constrained")
    ours = ["#1b6ca8" if row.method.startswith("rubscreen") else "#9aa5b1" for row in rows]
    milliseconds = np.array([1e3 * row.seconds for row in rows])
    least = np.nanmin(milliseconds) / 4
    left.barh(height, np.nan_to_num(milliseconds, nan=least), color=ours)
    left.set(xscale="log", xlim=(least, 8 * np.nanmax(milliseconds)), xlabel="ms a point, one thread")
    share = np.array([[row.false_stable, row.false_unstable] for row in rows], dtype=float) / np.array(
        [[max(1, row.judged)] for row in rows]
    )
    right.barh(height, 100 * share[:, 0], color="#c0392b", label="false stable")
    right.barh(height, 100 * share[:, 1], left=100 * share[:, 0], color="#e59866", label="false unstable")
    right.set(
        xlabel="wrong verdicts, % of the points judged", xlim=(0, max(1.0, 135 * share.sum(axis=1).max()))
    )
    right.legend(loc="upper right", frameon=False)
    for row, at, value in zip(rows, height, milliseconds, strict=True):
        wrong = row.false_stable + row.false_unstable
        left.text(
            least * 1.1 if row.cannot else value * 1.15,
            at,
            f"cannot: {row.cannot}" if row.cannot else f"{value:.3g}",
            va="center",
            fontsize=8,
        )
        if not row.cannot:
            edge = 100 * wrong / max(1, row.judged)
            right.text(edge, at, f"  {wrong:,} of {row.judged:,}", va="center", fontsize=8)
    for chart in charts:
        first = max(at for row, at in zip(rows, height, strict=True) if row.chart == chart)
        left.text(least * 1.1, first + 0.75, chart, va="center", weight="bold", fontsize=9)
    left.set_yticks(height, labels)
    left.set_ylim(height.min() - 0.7, 1.3)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(axis="y", length=0)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)
    plt.close(figure)


def _textbook_seconds(rows: list[Row]) -> float:
    return next(row.chart_seconds for row in rows if row.method.startswith("textbook"))


def _cells(row: Row, textbook: float) -> tuple[str, ...]:
    if row.cannot:
        return (row.method, "cannot")
    errors = row.errors if row.errors is not None and len(row.errors) else None
    return (
        row.method,
        f"{row.points:,}",
        f"{1e3 * row.seconds:.3g}",
        _three_digits(row.chart_seconds),
        f"{_three_digits(textbook / row.chart_seconds)}×",
        "" if errors is None else f"{np.median(errors):.1e}",
        "" if errors is None else f"{errors.max():.1e}",
        f"{row.judged:,}",
        f"{row.false_stable:,}",
        f"{row.false_unstable:,}",
        f"{row.undecided:,}",
    )


def _three_digits(value: float) -> str:
    return f"{value:.3g}" if value < 100 else f"{value:,.0f}"


def _note(chart: Chart, known: Truth, rows: list[Row]) -> str:
    """What a reader of the numbers has to know besides."""
    text = (
        f"{chart.name}: count and collocation differ on {known.disagreements} of {len(known.sample)} verdicts"
    )
    unable = [f"{row.method} cannot: {row.cannot}" for row in rows if row.cannot]
    partial = [
        f"{row.method} gives |μ| at {len(row.errors)} of {row.points}"
        for row in rows
        if row.errors is not None and len(row.errors) < row.points
    ]
    compiled = [f"{row.method} {row.preparation:.1f} s before" for row in rows if row.preparation > 0.1]
    return "; ".join([text, *unable, *partial, *compiled])

"""Lobes as a picture, with the paper's axes: Ω/f₁ and K_e."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, MaxNLocator

from service.paper_figures.outline import outlines
from service.paper_figures.paper_figure import LobeFigure
from service.paper_figures.study import PAPER_KE_MAX

DPI = 180
_SIZE = (8.4, 4.9)
_GREY = "0.72"
# Told apart by dash and by lightness, so that a photocopy still shows which is which; each thinner than the
# one before, so that lines that coincide are all seen.
_STYLES: tuple[tuple[str, Any, float], ...] = (
    ("#c8501e", "-", 1.9),
    ("#2a6fbb", (0, (4.5, 1.6)), 1.5),
    ("#3c8d40", (0, (6, 1.6, 1.2, 1.6)), 1.2),
)
_ONE_OF_TWO: tuple[str, Any, float] = ("#c8501e", "-", 1.1)
_LAST: tuple[str, Any, float] = ("black", "-", 0.8)


def lobes_png(figure: LobeFigure) -> bytes:
    """The figure as a PNG file."""
    sheet = Figure(figsize=_SIZE, dpi=DPI, layout="constrained")
    FigureCanvasAgg(sheet)
    axes = sheet.add_subplot()
    _axes(axes, figure)
    key: list[Any] = []
    styles = (_ONE_OF_TWO, _LAST) if len(figure.curves) == 2 else (*_STYLES[: len(figure.curves) - 1], _LAST)
    for lobes, (colour, dash, width) in zip(figure.curves, styles, strict=True):
        found = outlines(lobes, *figure.ratios)
        if figure.shaded:
            for area in found:
                axes.fill(*area.polygon, facecolor=_GREY, edgecolor="none")
        for i, line in enumerate(found):
            (drawn,) = axes.plot(*line.edge, color=colour, ls=dash, lw=width)
            if i == 0:
                drawn.set_label(lobes.label)
                key.append(drawn)
        if not found:
            key.append(Patch(facecolor="none", label=f"{lobes.label}: stable throughout"))
    if figure.shaded:
        key += [
            Patch(facecolor=_GREY, edgecolor="black", lw=0.8, label="unstable"),
            Patch(facecolor="white", edgecolor="black", lw=0.8, label="stable"),
        ]
    for mark in figure.marks:
        fill = {True: "#1f6fd0", False: "#d02020", None: "white"}[mark.stable]
        (point,) = axes.plot(
            mark.ratio, mark.ke, "o", ms=7, mfc=fill, mec="black", mew=0.8, ls="none", zorder=5
        )
        point.set_label(mark.label)
        key.append(point)
    key += _paper_top(axes, figure)
    key += _extrapolated(axes, figure)
    sheet.legend(
        handles=key,
        loc="outside lower center",
        ncols=min(3, len(key)),
        fontsize=9,
        frameon=False,
        handlelength=3.0,
        columnspacing=1.6,
    )
    out = io.BytesIO()
    sheet.savefig(out, format="png", dpi=DPI)
    return out.getvalue()


def shortened(name: str, most: int = 60) -> str:
    """A blade's name, cut where it would not fit on a line, its mathematics left alone."""
    cut = name if len(name) <= most else f"{name[: most - 1]}…"
    return " ".join(cut.replace("$", r"\$").split())


def _axes(axes: Any, figure: LobeFigure) -> None:
    f1 = figure.first_frequency_hz
    axes.set_xlim(*figure.ratios)
    axes.set_ylim(0.0, figure.ke_max)
    axes.set_xlabel(r"$\Omega / f_1$ at rest  [-]", fontsize=11)
    axes.set_ylabel(r"$K_e$ [$\times 10^{4}$ N/m]", fontsize=11)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda ke, _: f"{ke / 1e4:.3g}"))
    axes.xaxis.set_major_locator(MaxNLocator(9))
    above = axes.secondary_xaxis(
        "top", functions=(lambda x: np.asarray(x) * f1, lambda x: np.asarray(x) / f1)
    )
    above.set_xlabel(r"rotor speed $\Omega$ [Hz]", fontsize=10)
    axes.set_title(f"{shortened(figure.blade)}\n{figure.title}", fontsize=10, pad=8)


def _paper_top(axes: Any, figure: LobeFigure) -> list[Any]:
    if figure.ke_max <= PAPER_KE_MAX:
        return []
    line = axes.axhline(PAPER_KE_MAX, color="0.35", lw=1.0, ls=(0, (1, 2)), zorder=1)
    line.set_label("top of the paper's axis")
    return [line]


def _extrapolated(axes: Any, figure: LobeFigure) -> list[Any]:
    if figure.extrapolated_from is None:
        return []
    axes.axvspan(
        figure.extrapolated_from,
        figure.ratios[1],
        facecolor="none",
        edgecolor="0.55",
        hatch="//",
        lw=0.0,
        zorder=0.5,
    )
    return [Patch(facecolor="none", edgecolor="0.55", hatch="//", lw=0.0, label="modal data extrapolated")]

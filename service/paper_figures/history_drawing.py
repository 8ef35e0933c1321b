"""Responses as a picture: displacement over revolutions."""

from __future__ import annotations

import io

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from service.paper_figures.history_figure import HistoryFigure
from service.paper_figures.lobe_drawing import DPI, shortened

_SIZE = (8.4, 4.6)
_COLOURS = {True: "#1f6fd0", False: "#d02020"}  # as the test points of Fig. 5


def histories_png(figure: HistoryFigure) -> bytes:
    """The figure as a PNG file."""
    sheet = Figure(figsize=_SIZE, dpi=DPI, layout="constrained")
    FigureCanvasAgg(sheet)
    sheet.suptitle(f"{shortened(figure.blade)}\n{figure.title}", fontsize=10)
    for axes, panel in zip(
        sheet.subplots(1, len(figure.panels), squeeze=False)[0], figure.panels, strict=True
    ):
        # What grows first, so that what settles is seen before it.
        for history in sorted(panel.histories, key=lambda h: -h.growth_per_revolution):
            colour = _COLOURS[history.stable]
            axes.plot(
                history.revolution, 1e3 * history.displacement, color=colour, lw=0.5, label=history.label
            )
            end = np.abs(history.displacement[-len(history.displacement) // 10 :]).max()
            last = history.revolution[-1]
            envelope = end * np.exp(history.growth_per_revolution * (history.revolution - last))
            for sign in (1.0, -1.0):
                axes.plot(history.revolution, sign * 1e3 * envelope, color="black", lw=0.8, ls="--")
        largest = 1.08e3 * max(np.abs(history.displacement).max() for history in panel.histories)
        axes.set_ylim(-largest, largest)
        axes.set_xlim(0.0, panel.histories[0].revolution[-1])
        axes.set_title(panel.title, fontsize=10)
        axes.set_xlabel("revolutions", fontsize=10)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), fontsize=8.5, frameon=False)
    sheet.axes[0].set_ylabel("displacement of the leading edge [mm]", fontsize=10)
    out = io.BytesIO()
    sheet.savefig(out, format="png", dpi=DPI)
    return out.getvalue()

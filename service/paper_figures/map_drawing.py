"""Maps over rotor speed as pictures."""

from __future__ import annotations

import io

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from service.paper_figures.lobe_drawing import DPI, shortened
from service.paper_figures.map_figure import MapFigure

_SIZE = (8.4, 4.9)


def map_png(figure: MapFigure) -> bytes:
    """The figure as a PNG file."""
    sheet = Figure(figsize=_SIZE, dpi=DPI, layout="constrained")
    FigureCanvasAgg(sheet)
    axes = sheet.add_subplot()
    if figure.decades:
        least = figure.darkest * 10.0**-figure.decades
        norm: Normalize = LogNorm(least, figure.darkest, clip=True)
        shade = np.maximum(figure.shade, least)
    else:
        norm, shade = Normalize(0.0, figure.darkest, clip=True), figure.shade
    drawn = axes.pcolormesh(
        figure.ratio, figure.height, shade, cmap="Greys", norm=norm, shading="nearest", rasterized=True
    )
    bar = sheet.colorbar(drawn, ax=axes, pad=0.015)
    bar.set_label(figure.shade_name, fontsize=10)
    key = []
    for line in figure.lines:
        (made,) = axes.plot(
            line.ratio, line.height, color=line.colour, ls=line.dash, lw=1.3, label=line.label
        )
        key.append(made)
    if figure.extrapolated_from is not None and figure.extrapolated_from < figure.ratio[-1]:
        key.append(
            axes.axvline(
                figure.extrapolated_from,
                color="#2a6fbb",
                lw=1.0,
                ls=":",
                label="right of it: modal data extrapolated",
            )
        )
    axes.set_xlim(figure.ratio[0], figure.ratio[-1])
    axes.set_ylim(figure.height[0], figure.height[-1])
    axes.set_xlabel(r"$\Omega / f_1$ at rest  [-]", fontsize=11)
    axes.set_ylabel(figure.height_name, fontsize=11)
    axes.set_title(f"{shortened(figure.blade)}\n{figure.title}", fontsize=10, pad=8)
    if key:
        sheet.legend(
            handles=key, loc="outside lower center", ncols=min(3, len(key)), fontsize=9, frameon=False
        )
    out = io.BytesIO()
    sheet.savefig(out, format="png", dpi=DPI)
    return out.getvalue()

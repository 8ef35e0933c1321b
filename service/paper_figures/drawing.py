"""A figure as a picture, by its kind."""

from __future__ import annotations

from service.paper_figures.history_drawing import histories_png
from service.paper_figures.history_figure import HistoryFigure
from service.paper_figures.lobe_drawing import lobes_png
from service.paper_figures.map_drawing import map_png
from service.paper_figures.map_figure import MapFigure
from service.paper_figures.paper_figure import LobeFigure, PaperFigure


def figure_png(figure: PaperFigure) -> bytes:
    """The figure as a PNG file."""
    if isinstance(figure, HistoryFigure):
        return histories_png(figure)
    if isinstance(figure, MapFigure):
        return map_png(figure)
    assert isinstance(figure, LobeFigure)
    return lobes_png(figure)

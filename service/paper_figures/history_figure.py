"""Displacements of the tip over revolutions, in panels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from service.paper_figures.paper_figure import PaperFigure


@dataclass(frozen=True)
class History:
    """One response.

    Attributes
    ----------
    label
        Its name in the key.
    stable
        Verdict of the delay equation.
    revolution
        Time in revolutions, rising, shape (m,).
    displacement
        m, shape (m,).
    growth_per_revolution
        ln |μ| of the dominant multiplier: its envelope.
    """

    label: str
    stable: bool
    revolution: np.ndarray
    displacement: np.ndarray
    growth_per_revolution: float


@dataclass(frozen=True)
class Panel:
    """Responses over one pair of axes."""

    title: str
    histories: tuple[History, ...]


@dataclass(frozen=True, kw_only=True)
class HistoryFigure(PaperFigure):
    """Panels side by side."""

    panels: tuple[Panel, ...]

    def _drawn(self) -> dict[str, Any]:
        return {
            "panels": [
                {
                    "title": panel.title,
                    "histories": [
                        {
                            "label": history.label,
                            "stable": history.stable,
                            "growth_per_revolution": history.growth_per_revolution,
                            "largest_each_revolution": [
                                float(np.abs(history.displacement[history.revolution.astype(int) == k]).max())
                                for k in range(int(history.revolution[-1]))
                            ],
                        }
                        for history in panel.histories
                    ],
                }
                for panel in self.panels
            ]
        }

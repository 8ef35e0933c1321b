"""Maps over rotor speed: wear round the casing, amplitudes over frequency."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from service.paper_figures.paper_figure import PaperFigure


@dataclass(frozen=True)
class Line:
    """A line over the map, in its own units; broken where it is not a number."""

    label: str
    ratio: np.ndarray
    height: np.ndarray
    colour: str
    dash: Any = "-"


@dataclass(frozen=True, kw_only=True)
class MapFigure(PaperFigure):
    """Shades over Ω/f₁ and another axis: darker is more.

    Attributes
    ----------
    ratio
        Ω/f₁, rising, shape (m,).
    height
        The other axis, rising, shape (k,).
    shade
        Shape (k, m).
    height_name, shade_name
        Of the axes.
    darkest
        What is black; white is 0, or `decades` below.
    decades
        0 shades evenly, else so many decades below `darkest`.
    lines
        Drawn over it.
    extrapolated_from
        Ω/f₁ beyond which the modal data are extrapolated; None where they are not.
    """

    ratio: np.ndarray
    height: np.ndarray
    shade: np.ndarray
    height_name: str
    shade_name: str
    darkest: float
    decades: float = 0.0
    lines: tuple[Line, ...] = ()
    extrapolated_from: float | None = None
    summary: dict[str, Any] = field(default_factory=dict)

    def _drawn(self) -> dict[str, Any]:
        return {
            "speed_ratio": [float(self.ratio[0]), float(self.ratio[-1])],
            "speeds": len(self.ratio),
            "extrapolated_from_ratio": self.extrapolated_from,
            **self.summary,
        }

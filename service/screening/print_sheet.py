"""What every chart for print shares: its size, line styles, legend under the axes, and the PNG."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

DPI = 300
SIZE = (7.2, 4.9)
# Told apart by dash and by lightness, so that a photocopy still shows which is which.
STYLES: tuple[tuple[str, Any], ...] = (
    ("#000000", "-"),
    ("#c8501e", (0, (5, 1.6))),
    ("#2a6fbb", (0, (1.2, 1.2))),
    ("#5a5a5a", "-."),
)
LINER: dict[str, Any] = {"color": "black", "lw": 1.2, "ls": (0, (6, 2, 1, 2)), "label": "$K_e$ of the liner"}


def scaled_by(factor: float) -> Callable[[Any], Any]:
    """For a second axis in another unit."""
    return lambda values: np.asarray(values) * factor


def legend_below(figure: Figure, key: Sequence[Any], note: str = "") -> None:
    """Under the axes, where it hides nothing; what has no mark to explain is a line above it."""
    # A map's long keys fit in three columns, the names of contacts in four.
    columns = 3 if len(key) > 4 else len(key)
    figure.legend(
        handles=list(key),
        title=note or None,
        title_fontsize=9,
        loc="outside lower center",
        ncols=columns,
        fontsize=9,
        frameon=False,
        handlelength=2.2,
        columnspacing=1.6,
    )


def as_png(figure: Figure) -> bytes:
    """The PNG file."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=DPI)
    return out.getvalue()

"""The verified points on the map they come from, and how far apart the two exact answers are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from sdm_core.blade import Blade
from service.screening.print_sheet import DPI, as_png
from service.verification.comparison import RADIUS_AGREES, Verified
from training.answers import BoundaryAnswers

_MARKS = {
    True: ("o", "white", "stable"),
    False: ("o", "black", "unstable"),
    None: ("s", "0.6", "not decided"),
}
_ENOUGH_FOR_A_LINE = 150
_LEAST = 1e-16  # what is drawn for no difference at all


def verification_png(
    blade: Blade, contact: str, boundary: BoundaryAnswers, ke_max: float, found: Sequence[Verified]
) -> bytes:
    """Left the plane of speed and K_e with the exact boundary and the points, right |μ| by both methods."""
    figure = Figure(figsize=(11.0, 4.9), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    plane, differences = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    figure.suptitle(f"{blade.name}: {contact}", fontsize=11)
    # Speeds asked about, and between them a line only where it can be followed: with arcs it cannot.
    followed = len(boundary.speed_hz) >= _ENOUGH_FOR_A_LINE
    plane.plot(
        boundary.speed_hz,
        boundary.critical_ke,
        color="0.45",
        lw=0.9 if followed else 0.0,
        marker=None if followed else ".",
        ms=4,
        label="exact boundary" if followed else "exact boundary at the speeds asked about",
    )
    for verdict, (mark, fill, name) in _MARKS.items():
        of = [v for v in found if v.exact is verdict]
        if of:
            plane.plot(
                [v.point.speed_hz for v in of],
                [v.point.ke for v in of],
                ls="none",
                marker=mark,
                mfc=fill,
                mec="black",
                ms=5.5,
                label=f"{name}, by the exact core",
            )
    for wrong, mark, size, label in (
        ([v for v in found if not v.agrees], "x", 13, "they differ"),
        ([v for v in found if v.served_wrongly], "D", 11, "served answer is wrong"),
    ):
        if wrong:
            plane.plot(
                [v.point.speed_hz for v in wrong],
                [v.point.ke for v in wrong],
                ls="none",
                marker=mark,
                mfc="none",
                mec="#c8501e",
                mew=2.0,
                ms=size,
                label=label,
            )
    plane.set_ylim(0.0, ke_max)
    low, high = boundary.speed_hz.min(), boundary.speed_hz.max()
    plane.set_xlim(low - 0.01 * (high - low), high + 0.01 * (high - low))
    plane.set_xlabel(r"rotor speed $\Omega$ [Hz]")
    plane.set_ylabel(r"$K_e$ [N/m]")
    plane.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2, fontsize=9, frameon=False)
    kinds = list(dict.fromkeys(v.point.kind for v in found))
    for kind, mark in zip(kinds, "osd^", strict=False):
        of = [v for v in found if v.point.kind == kind and np.isfinite(v.radius_difference)]
        differences.plot(
            [np.log(v.radius_exact) for v in of],
            [max(v.radius_difference, _LEAST) for v in of],
            ls="none",
            marker=mark,
            mfc="none",
            mec="black",
            label=kind,
        )
    differences.axhline(RADIUS_AGREES, color="#c8501e", lw=1.0, ls="--", label="agreement asked for")
    differences.set_yscale("log")
    differences.xaxis.set_major_locator(MaxNLocator(5))
    differences.set_ylim(_LEAST / 3, 10 * RADIUS_AGREES)
    differences.set_xlabel(r"growth per revolution $\ln|\mu|$ [-]")
    differences.set_ylabel(r"relative difference of $|\mu|$ [-]")
    differences.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, fontsize=9, frameon=False)
    return as_png(figure)

"""Wear map: worn profiles side by side over rotor speed, in the manner of [SBL] Figs. 11 and 12."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from service.screening.print_sheet import DPI, as_png, legend_below, scaled_by
from service.simulation.order import SimulationOrder
from service.simulation.outcome import SimulationOutcome
from service.simulation.titles import UNSTABLE, touching

_SHOWN = 99.5  # per cent of the map's points: a few deepest would leave the others white


def wear_map_png(outcome: SimulationOutcome, node: str | None = None) -> bytes:
    """Depth over speed and angle, the deepest at each speed above it, unstable speeds marked.

    Parameters
    ----------
    node
        Contact node; the first where left out.

    Returns
    -------
    The PNG file.
    """
    order, found = outcome.order, outcome.speeds
    wear = found.wear_map(order, node)
    figure = Figure(figsize=(8.6, 6.6), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    deepest, plane = figure.subplots(2, 1, height_ratios=(1.0, 2.6), sharex=True)
    said = f"worn depth under {wear.node}{nowhere_unstable(outcome)}"
    figure.suptitle(f"{order.blade.name}: {touching(order)}\n{said}", fontsize=11)
    depth = wear.worn_m * 1e6
    # The same shades under every node.
    shown = max(float(np.percentile(found.worn_m * 1e6, _SHOWN)), 1e-6)
    mesh = plane.pcolormesh(
        wear.speed_hz,
        wear.angle_rad,
        depth.T,
        cmap="Greys",
        vmin=0.0,
        vmax=shown,
        shading="nearest",
        rasterized=True,
    )
    bar = figure.colorbar(mesh, ax=plane, extend="max" if depth.max() > shown else "neither", pad=0.015)
    bar.set_label("worn depth [µm]")
    plane.set_ylabel("angle round the casing [rad]")
    plane.set_yticks(np.arange(5) * np.pi / 2, ["0", "π/2", "π", "3π/2", "2π"])
    plane.set_ylim(0, 2 * np.pi)
    deepest.plot(wear.speed_hz, wear.deepest_m * 1e6, color="black", lw=0.9)
    deepest.set_ylabel("deepest [µm]")
    deepest.set_ylim(bottom=0.0)
    key: list[Any] = []
    if len(outcome.lobes_hz):
        key.append(mark_unstable(deepest, outcome))
    if wear.worn_through.any():
        at = wear.worn_through
        key += deepest.plot(
            wear.speed_hz[at], wear.deepest_m[at] * 1e6, "kv", ms=5, label="worn through, stopped there"
        )
    if key:
        legend_below(figure, key)
    speed_axes(plane, deepest, order)
    return as_png(figure)


def mark_unstable(axes: Axes, outcome: SimulationOutcome, up_to: float = 1.0) -> Patch:
    """A tint over the speeds at which the exact core calls permanent contact unstable; its key."""
    look: dict[str, Any] = {"facecolor": UNSTABLE, "alpha": 0.35 if up_to == 1.0 else 0.8, "lw": 0}
    for low, high in outcome.lobes_hz:
        axes.axvspan(low, high, ymax=up_to, **look)
    return Patch(**look, label="unstable in permanent contact (exact core)")


def nowhere_unstable(outcome: SimulationOutcome) -> str:
    """For a heading, where there is nothing to mark."""
    if len(outcome.lobes_hz) or outcome.speeds.unstable.any():
        return ""
    return "; permanent contact stable at every speed (exact core)"


def speed_edges(speed_hz: np.ndarray) -> np.ndarray:
    """Half way between speeds, and as far beyond the ends; shape (m + 1,)."""
    middle = 0.5 * (speed_hz[:-1] + speed_hz[1:])
    return np.r_[2 * speed_hz[0] - middle[0], middle, 2 * speed_hz[-1] - middle[-1]]


def speed_axes(lower: Axes, upper: Axes, order: SimulationOrder) -> None:
    """Ω in Hz above, Ω/f₁ below, as on the stability maps."""
    f1 = order.blade.first_frequency_hz
    edges = speed_edges(np.array(order.speed_hz))
    lower.set_xlim(edges[0], edges[-1])
    lower.tick_params(labelbottom=False, labelsize=9, bottom=False)
    below = lower.secondary_xaxis("bottom", functions=(scaled_by(1.0 / f1), scaled_by(f1)))
    below.set_xlabel(r"$\Omega / f_1$ at rest  [-]")
    below.xaxis.set_major_locator(MaxNLocator(8))
    below.tick_params(labelsize=9)
    upper.tick_params(labeltop=True, top=True, labelbottom=False, bottom=upper is not lower, labelsize=9)
    upper.xaxis.set_label_position("top")
    upper.set_xlabel(r"rotor speed $\Omega$ [Hz]")

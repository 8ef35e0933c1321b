"""The liner after a simulation at one speed: its profile round the casing, and the harmonics of that."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from service.screening.print_sheet import DPI, STYLES, as_png
from service.simulation.outcome import SimulationOutcome
from service.simulation.titles import UNSTABLE, heading

_HARMONICS = 60  # beyond the highest that is of interest


def worn_profile_png(outcome: SimulationOutcome) -> bytes:
    """Depth over the angle, unrolled; below it how much each number of lobes has in it.

    Returns
    -------
    The PNG file.
    """
    order, found = outcome.order, outcome.speeds
    figure = Figure(figsize=(9.0, 6.4), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    profile, harmonics = figure.subplots(2, 1, height_ratios=(1.5, 1.0))
    figure.suptitle(heading(outcome), fontsize=11)
    degrees = np.degrees(found.wear_map(order).angle_rad)
    for (colour, dash), node, depth in zip(
        STYLES * len(order.nodes), order.nodes, found.worn_m[0], strict=False
    ):
        profile.plot(degrees, depth * 1e6, color=colour, ls=dash, lw=0.8, label=node)
    profile.set_xlim(0, 360)
    profile.set_xticks(np.arange(0, 361, 45))
    deepest = float(found.worn_m.max()) * 1e6
    bottom = 1.12 * deepest if deepest else 1.0
    left = found.worn_m[0].max(axis=0) * 1e6
    profile.fill_between(degrees, left, bottom, color="0.85", lw=0)  # the liner that is left
    profile.set_ylim(bottom, 0.0)
    profile.set_xlabel("angle round the casing [°]")
    profile.set_ylabel("worn depth [µm]\n(grey: liner that is left)")
    profile.set_title(_counted(outcome), fontsize=10)
    if len(order.nodes) > 1:
        profile.legend(fontsize=8, frameon=False, ncols=min(5, len(order.nodes)), loc="lower right")
    _harmonics(harmonics, outcome)
    for axes in figure.axes:
        axes.tick_params(labelsize=9)
        axes.spines[["top", "right"]].set_visible(False)
    return as_png(figure)


def _counted(outcome: SimulationOutcome) -> str:
    found, order = outcome.speeds, outcome.order
    said = []
    for node, lobes, amplitude in zip(order.nodes, found.lobes[0], found.lobe_amplitude_m[0], strict=True):
        said.append(
            f"{node}: no lobes" if lobes == 0 else f"{node}: {lobes} lobes, ±{amplitude * 1e6:.3g} µm"
        )
    more = f" and {len(said) - 3} nodes more" if len(said) > 3 else ""
    worn = "; worn through" if found.worn_through[0] else ""
    return "; ".join(said[:3]) + more + worn


def _harmonics(axes: Axes, outcome: SimulationOutcome) -> None:
    """Amplitude of each harmonic of the profile round the casing, µm."""
    found, order = outcome.speeds, outcome.order
    turn = np.arange(found.worn_m.shape[2]) / found.worn_m.shape[2]
    spiral = order.casing.feed_per_revolution_m * turn
    chatter = float(found.chatter_hz[0] / order.speed_hz[0])
    most = min(found.worn_m.shape[2] // 2, max(_HARMONICS, int(1.5 * chatter) if chatter == chatter else 0))
    count = np.arange(1, most + 1)
    width = 0.8 / len(order.nodes)
    for j, ((colour, _), depth) in enumerate(zip(STYLES * len(order.nodes), found.worn_m[0], strict=False)):
        amplitude = 2 * np.abs(np.fft.rfft(depth - spiral)) / len(depth) * 1e6
        at = count + (j - (len(order.nodes) - 1) / 2) * width
        axes.bar(at, amplitude[1 : most + 1], width=width, color=colour if len(order.nodes) > 1 else "0.35")
    if chatter == chatter:
        what = "chatter" if found.unstable[0] else "least damped motion"
        axes.axvline(
            chatter, color=UNSTABLE, lw=1.1, ls="--", label=f"{what} by the exact core, {chatter:.1f} Ω"
        )
        axes.legend(fontsize=8, frameon=False, loc="upper right")
    top = 2e6 * float(found.worn_m.max())
    if top > 0:
        axes.set_yscale("log")
        axes.set_ylim(top * 1e-4, top)
    axes.set_xlim(0, most + 1)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=12))
    axes.set_xlabel("lobes round the casing [-]")
    axes.set_ylabel("amplitude [µm]")

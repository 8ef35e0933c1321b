"""Spectrum map: how the tip vibrates over rotor speed, on Campbell's diagram ([SBL] Fig. 14)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter

from sdm_core.time_domain.liner.spectrum_map import SpectrumMap
from service.screening.print_sheet import DPI, as_png, legend_below
from service.simulation.outcome import SimulationOutcome
from service.simulation.titles import UNSTABLE, touching
from service.simulation.wear_map_chart import mark_unstable, nowhere_unstable, speed_axes

_DECADES = 3
_MOST_ORDERS, _MOST_ROWS = 14, 500
_LINE: dict[str, Any] = {"color": "#2a6fbb", "lw": 0.9, "ls": (0, (7, 5))}
_ORDER: dict[str, Any] = {"color": "#2a6fbb", "lw": 0.5, "ls": ":"}


def spectrum_map_png(outcome: SimulationOutcome) -> bytes:
    """Amplitude over speed and frequency, natural frequencies, engine orders, and where chatter is exact.

    Rings mark, at each speed that the exact core calls unstable in permanent contact, the frequency of its
    strongest growing motion.

    Returns
    -------
    The PNG file.
    """
    order, found = outcome.order, outcome.speeds
    spectrum = found.spectrum_map(order)
    figure = Figure(figsize=(8.6, 6.6), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    figure.suptitle(
        f"{order.blade.name}: {touching(order)}\nspectrum of {spectrum.node}{nowhere_unstable(outcome)}",
        fontsize=11,
    )
    frequency, micrometres = _rows(spectrum)
    top = max(10.0 ** np.ceil(np.log10(max(float(micrometres.max()), 1e-9))), 1e-9)
    mesh = axes.pcolormesh(
        spectrum.speed_hz,
        frequency,
        np.log10(np.maximum(micrometres, top * 10**-_DECADES)).T,
        cmap="Greys",
        vmin=np.log10(top) - _DECADES,
        vmax=np.log10(top),
        shading="nearest",
        rasterized=True,
    )
    bar = figure.colorbar(mesh, ax=axes, extend="min", pad=0.015)
    bar.set_label("amplitude [µm]")
    bar.set_ticks((np.log10(top) - np.arange(_DECADES + 1)).tolist())
    bar.formatter = FuncFormatter(lambda value, _: f"{10**value:g}")
    axes.set_ylim(0.0, spectrum.frequency_hz[-1])
    axes.set_ylabel("frequency [Hz]")
    speed_axes(axes, axes, order)
    _campbell(axes, spectrum)
    key: list[Any] = [
        Line2D([], [], **_LINE, label="natural frequencies"),
        Line2D([], [], **_ORDER, label="engine orders"),
    ]
    at = found.unstable & np.isfinite(found.chatter_hz)
    if at.any():
        mark: dict[str, Any] = {"ls": "none", "marker": "o", "mfc": "none", "mec": UNSTABLE, "mew": 1.1}
        axes.plot(found.speed_hz[at], found.chatter_hz[at], ms=5.0, **mark)
        key.append(Line2D([], [], ms=5.0, label="its chatter frequency", **mark))
    if len(outcome.lobes_hz):
        key.insert(2, mark_unstable(axes, outcome, up_to=0.025))
    legend_below(figure, key)
    return as_png(figure)


def _rows(spectrum: SpectrumMap) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and amplitudes, µm, in no more rows than can be seen, each with its largest."""
    together = -(-len(spectrum.frequency_hz) // _MOST_ROWS)
    whole = len(spectrum.frequency_hz) // together * together
    frequency = spectrum.frequency_hz[:whole].reshape(-1, together).mean(axis=1)
    rows = spectrum.amplitude_m[:, :whole].reshape(len(spectrum.speed_hz), -1, together).max(axis=2)
    return frequency, rows * 1e6


def _campbell(axes: Axes, spectrum: SpectrumMap) -> None:
    """Natural frequencies over speed, and engine orders with their numbers at the edge they leave by."""
    for mode, line in enumerate(spectrum.natural_hz.T):
        axes.plot(spectrum.speed_hz, line, **_LINE)
        axes.annotate(
            f"{mode + 1}",
            (spectrum.speed_hz[0], line[0]),
            xytext=(3, 3),
            textcoords="offset points",
            color="#2a6fbb",
            fontsize=9,
        )
    fastest, highest = float(spectrum.speed_hz[-1]), float(spectrum.frequency_hz[-1])
    many = int(highest / fastest)
    every = max(1, -(-many // _MOST_ORDERS))
    for number in range(every, many + 1, every):
        axes.plot(spectrum.speed_hz, number * spectrum.speed_hz, **_ORDER)
        axes.annotate(
            f"EO {number}",
            (fastest, number * fastest),
            xytext=(-2, 2),
            textcoords="offset points",
            ha="right",
            color="#2a6fbb",
            fontsize=7,
        )

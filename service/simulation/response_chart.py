"""The response at one speed: displacement, contact force and energy over the revolutions."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from service.screening.print_sheet import DPI, STYLES, as_png
from service.simulation.order import SimulationOrder
from service.simulation.outcome import SimulationOutcome
from service.simulation.response import Response
from service.simulation.titles import heading

_PLOTTED = 4000  # envelopes of so many instants show all that the eye can


def response_png(outcome: SimulationOutcome) -> bytes:
    """Tip displacement of the contact nodes, their forces, and where the energy is, over revolutions.

    Displacement and force are drawn as bands from the least to the largest value of each of some thousand
    stretches of time, beside them two revolutions about the largest displacement in full.

    Returns
    -------
    The PNG file.
    """
    response, order = outcome.response, outcome.order
    assert response is not None
    figure = Figure(figsize=(10.4, 7.6), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    (moved, near), (force, force_near), (energy, modal) = figure.subplots(
        3, 2, width_ratios=(1.9, 1.0), sharex="col"
    )
    figure.suptitle(heading(outcome), fontsize=11)
    turns = (np.arange(len(response.time_s)) + 1) / int(response.samples_per_revolution)
    part = _about_the_largest(response)
    at = [order.blade.tip_nodes.index(node) for node in order.nodes]
    for (colour, _), i, j in zip(STYLES * len(at), at, range(len(at)), strict=False):
        moved_um = response.displacement_m[:, i] * 1e6
        _band(moved, turns, moved_um, colour, order.nodes[j])
        near.plot(turns[part], moved_um[part], color=colour, lw=0.8)
        _band(force, turns, response.force_n[:, j], colour, order.nodes[j])
        force_near.plot(turns[part], response.force_n[part, j], color=colour, lw=0.8)
    moved.set_ylabel("tip displacement [µm]\n(outward positive)")
    force.set_ylabel("contact force [N]")
    force.set_ylim(bottom=0.0)
    force_near.set_ylim(bottom=0.0)
    near.set_title("two revolutions about the largest displacement", fontsize=9)
    if len(at) > 1:
        moved.legend(fontsize=8, frameon=False, ncols=min(len(at), 5), loc="upper left")
    _account(energy, response)
    _modal(modal, order, response, turns, part)
    for axes in (energy, modal):
        axes.set_xlabel("revolutions [-]")
    energy.set_xlim(0, response.revolutions)
    modal.xaxis.set_major_locator(MaxNLocator(5))
    modal.set_xlim(turns[part][0], turns[part][-1])
    for axes in figure.axes:
        axes.tick_params(labelsize=9)
        axes.spines[["top", "right"]].set_visible(False)
        axes.margins(x=0)
    return as_png(figure)


def _about_the_largest(response: Response) -> slice:
    """Two revolutions of samples, or all where there are fewer."""
    around = int(response.samples_per_revolution)
    peak = int(np.abs(response.displacement_m).max(axis=1).argmax())
    first = min(max(peak - around, 0), max(len(response.time_s) - 2 * around, 0))
    return slice(first, first + 2 * around)


def _band(axes: Axes, turns: np.ndarray, values: np.ndarray, colour: str, label: str) -> None:
    together = max(1, len(values) // _PLOTTED)
    whole = len(values) // together * together
    rows = values[:whole].reshape(-1, together)
    axes.fill_between(
        turns[:whole:together], rows.min(axis=1), rows.max(axis=1), color=colour, lw=0.4, label=label
    )


def _account(axes: Axes, response: Response) -> None:
    """What came in by contact, what damping and friction took, and what the blade holds, mJ."""
    at = np.arange(response.revolutions) + 1
    for (colour, dash), values, label in zip(
        STYLES,
        (response.contact_j, -response.damping_j, -response.friction_j, response.energy_j),
        ("work of contact", "lost to damping", "lost to friction", "energy of the blade"),
        strict=True,
    ):
        if np.any(values):
            axes.plot(at, values * 1e3, color=colour, ls=dash, lw=1.2, label=label)
    axes.set_ylabel("energy account [mJ]")
    if axes.get_lines():
        axes.legend(fontsize=8, frameon=False, loc="upper left")


def _modal(axes: Axes, order: SimulationOrder, response: Response, turns: np.ndarray, part: slice) -> None:
    """Energy of each mode, mJ."""
    energy = response.modal_energy_j[part] * 1e3
    strongest = np.argsort(energy.mean(axis=0))[::-1][: len(STYLES)]
    for (colour, dash), mode in zip(STYLES, sorted(strongest.tolist()), strict=False):
        axes.plot(turns[part], energy[:, mode], color=colour, ls=dash, lw=0.9, label=f"mode {mode + 1}")
    top = float(energy.max())
    if top > 0:
        axes.set_yscale("log")
        axes.set_ylim(top * 1e-4, top * 20)
    axes.set_ylabel("energy by mode [mJ]")
    axes.legend(fontsize=8, frameon=False, ncols=2, loc="upper left")

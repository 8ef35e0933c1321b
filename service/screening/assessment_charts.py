"""Charts of an assessment for print: Campbell diagram, lobes by mode, clearance, uncertain data."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter

from sdm_core.assessment.assessment import Assessment
from sdm_core.assessment.campbell import CampbellDiagram
from sdm_core.assessment.clearance import ClearanceUse
from sdm_core.assessment.mode_kind import ModeKind
from sdm_core.assessment.robust import RobustVerdict
from sdm_core.assessment.robust_band import RobustBand
from sdm_core.boundary import BoundarySolution
from sdm_core.errors import InvalidInput
from service.screening.charts import described
from service.screening.print_sheet import DPI, LINER, SIZE, STYLES, as_png, legend_below, scaled_by

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# One more than charts of contacts need: five modes.
_STYLES = (*STYLES, ("#7a3f9d", (0, (3, 1, 1, 1, 1, 1))))
_WHITE: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.85}
_BAND, _UNSTABLE = "0.82", "0.86"
# Lobes named in the Campbell diagram: the deepest of each of so many modes.
_NAMED_LOBES = 3
_RPM = 60.0


def campbell_png(assessment: Assessment) -> bytes:
    """Campbell diagram with engine orders, and the lobes' deepest speeds over it, darker the deeper.

    Returns
    -------
    The PNG file.
    """
    diagram, title = assessment.campbell, described(assessment.contact)
    figure, axes = _sheet(f"{assessment.blade.name}: Campbell diagram, {title}", diagram.speed_hz)
    low, high = diagram.speed_hz[[0, -1]]
    top = 1.12 * float(diagram.frequency_hz.max())
    axes.set_ylim(0.0, top)
    axes.set_ylabel("frequency [Hz]", fontsize=11)
    for order in diagram.engine_orders:
        axes.plot([low, high], [order * low, order * high], color="0.62", lw=0.6, zorder=1)
    _order_labels(axes, diagram, top)
    names = _mode_names(assessment.kinds, diagram.frequency_hz.shape[1])
    for j, name in enumerate(names):
        axes.plot(diagram.speed_hz, diagram.frequency_hz[:, j], color="black", lw=1.1, zorder=2)
        beside: dict[str, Any] = {
            "xytext": (5, 0),
            "textcoords": "offset points",
            "va": "center",
            "fontsize": 9,
        }
        axes.annotate(name, (high, diagram.frequency_hz[-1, j]), **beside, annotation_clip=False)
    key: list[Any] = [
        Line2D([], [], color="black", lw=1.1, label="natural frequency"),
        Line2D([], [], color="0.62", lw=0.8, label="engine order, numbered"),
    ]
    if diagram.crossings:
        speeds = [c.speed_hz for c in diagram.crossings]
        style: dict[str, Any] = {
            "ls": "none",
            "marker": "o",
            "mfc": "white",
            "mec": "0.35",
            "mew": 0.8,
            "ms": 4.0,
        }
        axes.plot(speeds, [c.frequency_hz for c in diagram.crossings], **style, zorder=3)
        key.append(Line2D([], [], **style, label="resonance"))
    note = "" if diagram.lobe_points else f"no lobe below {assessment.ke_max:,.0f} N/m"
    if diagram.lobe_points:
        key.append(_lobe_points(figure, axes, assessment))
    legend_below(figure, key, note)
    return as_png(figure)


def mode_lobes_png(
    assessment: Assessment, full: BoundarySolution, alone: Mapping[int, BoundarySolution]
) -> bytes:
    """Lobes of each mode alone as lines, over what the whole blade has unstable, grey.

    Parameters
    ----------
    full
        Boundary of the blade at rising speeds.
    alone
        Boundaries of its modes at the same speeds, by number (`mode_boundaries`).
    """
    title = f"{assessment.blade.name}: each mode alone, {described(assessment.contact)}"
    figure, axes = _sheet(title, full.speed_hz)
    _ke_axis(axes, full.ke_max)
    first = np.nan_to_num(full.critical_ke, nan=full.ke_max)
    axes.fill_between(full.speed_hz, first, full.ke_max, color=_UNSTABLE, lw=0, zorder=1)
    key: list[Any] = [Patch(facecolor=_UNSTABLE, edgecolor="black", lw=0.8, label="all modes: unstable")]
    names = _mode_names(assessment.kinds, assessment.blade.mode_count)
    for (mode, solution), (colour, dash) in zip(alone.items(), itertools.cycle(_STYLES), strict=False):
        (line,) = axes.plot(*_flanked(solution), color=colour, ls=dash, lw=1.0, zorder=3)
        line.set_label(f"{names[mode - 1]} alone")
        key.append(line)
    silent = [names[j] for j in range(len(names)) if j + 1 not in alone]
    note = f"no lobe below {full.ke_max:,.0f} N/m: {', '.join(silent)}" if silent else ""
    if assessment.ke_liner is not None and assessment.ke_liner < full.ke_max:
        key.append(axes.axhline(assessment.ke_liner, **LINER))
    legend_below(figure, key, note)
    return as_png(figure)


def clearance_png(use: ClearanceUse, title: str, kinds: tuple[ModeKind, ...] = ()) -> bytes:
    """Running clearance over speed, and the vibration of each mode at which the tip first touches.

    Raises
    ------
    InvalidInput
        Without a cold clearance: there is nothing to draw.
    """
    running, touching = use.running_clearance_m, use.touching_tip_m
    if running is None or touching is None:
        raise InvalidInput(
            "cold_clearance_m", "missing", "give a cold clearance: without one there is no running one"
        )
    figure = Figure(figsize=(SIZE[0], 6.6), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    above, below = figure.subplots(2, 1, sharex=True)
    figure.suptitle(f"{title}: clearance", fontsize=11)
    shown = sorted({0, len(use.nodes) // 2, len(use.nodes) - 1})
    for i, (colour, dash) in zip(shown, _STYLES, strict=False):
        above.plot(use.speed_hz, 1e3 * running[:, i], color=colour, ls=dash, lw=1.2, label=use.nodes[i])
    above.plot(
        use.speed_hz, 1e3 * running.min(axis=1), color="0.55", lw=3.5, alpha=0.5, label="tightest", zorder=1
    )
    above.set_ylabel("running clearance [mm]", fontsize=10)
    least, most = 1e3 * float(running.min()), 1e3 * float(running.max())
    above.set_ylim(min(0.0, 1.1 * least), 1.15 * max(most, 1e-3))
    if least < 0:
        above.axhline(0.0, color="black", lw=0.8)
        above.annotate(
            "cuts into the liner", (0.01, 0.03), xycoords="axes fraction", fontsize=9, style="italic"
        )
    if use.growth_m is None:
        said = "growth of the tip not given: cold clearance"
        above.annotate(said, (0.01, 0.05), xycoords="axes fraction", fontsize=9, style="italic")
    above.legend(loc="upper left", bbox_to_anchor=(0.0, -0.02), ncols=4, fontsize=9, frameon=False)
    _untwist(above, use)
    names = _mode_names(kinds, touching.shape[1])
    rows = use.first_to_touch or ()
    for j, (name, (colour, dash)) in enumerate(zip(names, itertools.cycle(_STYLES), strict=False)):
        where = list(dict.fromkeys(row[j] for row in rows))
        said = f"{name}, at {' then '.join(where[:3])}"
        below.plot(use.speed_hz, 1e3 * touching[:, j].min(axis=1), color=colour, ls=dash, lw=1.2, label=said)
    below.set_ylabel("vibration of the tip that touches,\nhalf peak to peak [mm]", fontsize=10)
    below.set_xlabel(r"rotor speed $\Omega$ [Hz]", fontsize=10)
    below.set_ylim(0.0, None)
    below.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2, fontsize=9, frameon=False)
    for axes in (above, below):
        axes.set_xlim(use.speed_hz[0], use.speed_hz[-1])
        axes.tick_params(labelsize=9)
    return as_png(figure)


def robust_png(
    band: RobustBand,
    title: str,
    nominal: BoundarySolution,
    verdict: RobustVerdict | None = None,
    *,
    ke_liner: float | None = None,
) -> bytes:
    """Nominal boundary, and the band in which uncertain damping leaves the floor of the lobes.

    The lower edge is the least K_e of the family at each speed; the upper one what is left of it with
    damping at its largest. Frequencies move lobes sideways through both.

    Parameters
    ----------
    nominal
        Boundary of the blade as given, at speeds of its own.
    verdict
        Its worst case is marked, and the K_e below which every blade is proven stable drawn across.
    """
    figure, axes = _sheet(f"{title}: uncertain damping and frequencies", band.speed_hz)
    _ke_axis(axes, band.ke_max)
    lowest, damped = (np.nan_to_num(ke, nan=band.ke_max) for ke in (band.lowest, band.lowest_damped))
    axes.fill_between(band.speed_hz, lowest, damped, color=_BAND, lw=0, zorder=1)
    for edge in (band.lowest, band.lowest_damped):
        axes.plot(band.speed_hz, edge, color="0.45", lw=0.8, zorder=2)
    axes.plot(*_flanked(nominal), color="black", lw=0.8, zorder=3)
    key: list[Any] = [
        Line2D([], [], color="black", lw=0.8, label="nominal boundary"),
        Patch(facecolor=_BAND, edgecolor="0.45", lw=0.8, label="floor, least to most damping"),
    ]
    note = "" if verdict is None else _verdict_marks(axes, verdict, key)
    if ke_liner is not None and ke_liner < band.ke_max:
        key.append(axes.axhline(ke_liner, **LINER))
    legend_below(figure, key, note)
    return as_png(figure)


def _verdict_marks(axes: Axes, verdict: RobustVerdict, key: list[Any]) -> str:
    """The worst case and the proven floor; what is said above the legend."""
    top, worst = axes.get_ylim()[1], verdict.worst
    if verdict.guaranteed_ke is not None and verdict.guaranteed_ke < top:
        said = f"proven stable below {verdict.guaranteed_ke:,.0f} N/m"
        key.append(axes.axhline(verdict.guaranteed_ke, color="black", lw=1.0, ls=":", label=said, zorder=2))
    if worst.ke is None or worst.speed_hz is None:
        return f"no K_e below {verdict.ke_max:,.0f} N/m destabilises any blade tried"
    said = f"worst case: {worst.ke:,.0f} N/m at {worst.speed_hz:.1f} Hz"
    (mark,) = axes.plot(
        worst.speed_hz,
        worst.ke - 0.025 * top,
        ls="none",
        marker="^",
        ms=7,
        color="black",
        clip_on=False,
        label=said,
        zorder=5,
    )
    key.append(mark)
    return f"worst case: {worst.described}"


def _lobe_points(figure: Figure, axes: Axes, assessment: Assessment) -> Any:
    """Tips of the lobes, shaded by K_e; the deepest of some modes named."""
    points = assessment.campbell.lobe_points
    ke = np.array([p.tip.ke for p in points])
    order = np.argsort(-ke)  # the deepest on top
    marks = axes.scatter(
        [points[i].tip.speed_hz for i in order],
        [points[i].tip.chatter_hz for i in order],
        c=ke[order],
        cmap="gray",
        vmin=ke.min(),
        vmax=ke.min() + 1.25 * max(ke.max() - ke.min(), 0.05 * ke.min()),
        s=26,
        marker="D",
        edgecolors="black",
        linewidths=0.6,
        zorder=4,
        label="lobe's deepest speed",
    )
    bar = figure.colorbar(marks, ax=axes, pad=0.09, aspect=30)
    bar.set_label("$K_e$ at the lobe's tip [N/m]", fontsize=9)
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    bar.ax.tick_params(labelsize=8)
    named: set[int] = set()
    for point in points:
        if point.mode in named or len(named) == _NAMED_LOBES:
            continue
        named.add(point.mode)
        tip = point.tip
        said = f"{tip.ke:,.0f} N/m at {tip.speed_hz:.1f} Hz, {tip.lobes_per_revolution:.2f} wear lobes"
        left = tip.speed_hz < 0.5 * sum(axes.get_xlim())
        note = axes.annotate(
            said,
            (tip.speed_hz, tip.chatter_hz),
            xytext=(8 if left else -8, 11),
            textcoords="offset points",
            ha="left" if left else "right",
            fontsize=8,
            bbox=_WHITE,
            arrowprops={"arrowstyle": "-", "lw": 0.6},
            zorder=6,
        )
        note.set_in_layout(False)
    return marks


def _order_labels(axes: Axes, diagram: CampbellDiagram, top: float) -> None:
    """Engine orders named where their lines leave the axes, where nothing else is in the way."""
    low, high = diagram.speed_hz[[0, -1]]
    taken, last_top = list(diagram.frequency_hz[-1]), np.inf
    for order in diagram.engine_orders:
        leaves = order * high
        if leaves <= top:
            # A little inside the right edge, clear of the modes' lines and of each other.
            x = high - 0.015 * (high - low)
            if min(abs(order * x - f) for f in taken) < 0.022 * top:
                continue
            taken.append(order * x)
            place, (across, upright) = (x, order * x), ("right", "center")
        else:
            if order * low >= top or last_top - top / order < 0.045 * (high - low):
                continue
            last_top = top / order
            place, (across, upright) = (top / order, 0.995 * top), ("center", "top")
        axes.text(
            *place, f"{order}", ha=across, va=upright, fontsize=7.5, color="0.35", bbox=_WHITE, zorder=2
        )


def _mode_names(kinds: tuple[ModeKind, ...], count: int) -> list[str]:
    """``1F (mode 1)``, or the number alone where modes have no kind."""
    if len(kinds) != count:
        return [f"mode {j + 1}" for j in range(count)]
    return [f"{kind.mode}: {kind.label}" for kind in kinds]


def _untwist(axes: Axes, use: ClearanceUse) -> None:
    """A second axis with the turn of the chord, where it is known."""
    if use.untwist_rad is None:
        return
    turned = axes.twinx()
    turned.plot(use.speed_hz, np.degrees(use.untwist_rad), color="0.35", lw=0.9, ls=(0, (2, 2)))
    turned.set_ylabel("untwist [°], dotted", fontsize=9)
    turned.tick_params(labelsize=8)


def _sheet(title: str, speed_hz: np.ndarray) -> tuple[Figure, Axes]:
    """Axes over rotor speed in Hz below and in rpm above."""
    figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_xlim(float(speed_hz.min()), float(speed_hz.max()))
    axes.set_title(title, fontsize=11, pad=10)
    axes.set_xlabel(r"rotor speed $\Omega$ [Hz]", fontsize=10)
    rpm = axes.secondary_xaxis("top", functions=(scaled_by(_RPM), scaled_by(1 / _RPM)))
    rpm.set_xlabel("[rpm]", fontsize=9)
    rpm.xaxis.set_major_formatter(FuncFormatter(lambda n, _: f"{n:,.0f}"))
    for each in (axes, rpm):
        each.tick_params(labelsize=9, direction="out")
    return figure, axes


def _ke_axis(axes: Axes, ke_max: float) -> None:
    axes.set_ylim(0.0, ke_max)
    axes.set_ylabel("$K_e$ [N/m]", fontsize=11)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda ke, _: f"{ke:,.0f}"))


def _flanked(found: BoundarySolution) -> tuple[np.ndarray, np.ndarray]:
    """First crossings, each flank carried up to where they were looked for."""
    speed, ke = found.speed_hz, found.critical_ke
    leaves = np.flatnonzero(np.isfinite(ke[:-1]) != np.isfinite(ke[1:]))
    middle = 0.5 * (speed[leaves] + speed[leaves + 1])
    return np.insert(speed, leaves + 1, middle), np.insert(ke, leaves + 1, found.ke_max)

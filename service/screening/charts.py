"""Charts for print: stability maps in the manner of [SBL] Fig. 5, boundaries by contact as in Fig. 10."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, MaxNLocator

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from service.screening.print_sheet import DPI, LINER, SIZE, STYLES, as_png, legend_below, scaled_by
from training.answers import EXACT, BoundaryAnswers, MapAnswers

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from sdm_core.lobe_tips import CriticalSpeed
    from service.screening.screen import ScreeningReport

_UNSTABLE, _UNDECIDED = "0.70", "0.40"
# Light enough for black lines to show, and darker than what it covers, in colour or in grey.
_VERIFIED = (0.10, 0.35, 0.70, 0.28)

_WHITE: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}


def map_png(
    blade: Blade,
    contact: ContactConfiguration,
    answers: MapAnswers,
    boundary: BoundaryAnswers | None = None,
    *,
    ke_liner: float | None = None,
    worst: CriticalSpeed | None = None,
) -> bytes:
    """Stability map: grey unstable, white stable, speed against K_e ([SBL] Fig. 5).

    Parameters
    ----------
    answers
        Verdicts on evenly spaced speeds and stiffnesses. Points the exact core answered are dotted,
        unless it answered all of them.
    boundary
        Drawn as a line: solid where the exact core answered, dashed where the surrogate did.
    ke_liner
        N/m, drawn across.
    worst
        Marked from below by a triangle.

    Returns
    -------
    The PNG file.
    """
    figure, axes = _sheet(blade, f"{blade.name}: {described(contact)}", answers.speed_hz, answers.ke[-1])
    speed, ke = answers.speed_hz, answers.ke
    shade = np.where(np.isnan(answers.stable), 2, np.where(answers.stable > 0, 0, 1))
    axes.pcolormesh(
        speed,
        ke,
        shade,
        cmap=ListedColormap(["white", _UNSTABLE, _UNDECIDED]),
        vmin=0,
        vmax=2,
        shading="nearest",
    )
    key: list[Patch | Line2D] = [
        Patch(facecolor="white", edgecolor="black", linewidth=0.8, label="stable"),
        Patch(facecolor=_UNSTABLE, edgecolor="black", linewidth=0.8, label="unstable"),
    ]
    if (shade == 2).any():
        key.append(Patch(facecolor=_UNDECIDED, edgecolor="black", linewidth=0.8, label="not decided"))
    verified, notes = _verified(axes, answers)
    key += verified
    if boundary is not None:
        outline, more = _outline(axes, boundary)
        key, notes = key + outline, notes + more
    if ke_liner is not None:
        key.append(_liner(axes, ke_liner))
    if worst is not None:
        key.append(_pointer(axes, worst))
    legend_below(figure, key, "; ".join(notes))
    return as_png(figure)


def boundaries_png(
    blade: Blade,
    boundaries: Mapping[str, BoundaryAnswers],
    *,
    ke_max: float | None = None,
    ke_liner: float | None = None,
) -> bytes:
    """First crossings of one blade under several contacts, by name ([SBL] Fig. 10).

    Parameters
    ----------
    ke_max
        Top of the chart, N/m; None is the largest K_e of the boundaries.
    """
    first = next(iter(boundaries.values()))
    top = ke_max or max(boundary.ke_max for boundary in boundaries.values())
    what = next(iter(boundaries)) if len(boundaries) == 1 else "boundary by contact location"
    figure, axes = _sheet(blade, f"{blade.name}: {what}", first.speed_hz, top)
    key: list[Patch | Line2D] = []
    for (name, boundary), (colour, dash) in zip(boundaries.items(), itertools.cycle(STYLES), strict=False):
        none = "" if _reaches(boundary, top) else f" (none below {top:,.0f} N/m)"
        (line,) = axes.plot(
            *_flanked(boundary),
            color=colour,
            ls=dash,
            lw=1.2,
            label=f"{name}{none}",
        )
        key.append(line)
    if ke_liner is not None:
        key.append(_liner(axes, ke_liner))
    axes.text(0.012, 0.03, "stable below each line", transform=axes.transAxes, fontsize=9, style="italic")
    legend_below(figure, key)
    return as_png(figure)


def ranking_png(report: ScreeningReport) -> bytes:
    """Smallest destabilising K_e of each blade and contact, safest at the top."""
    rows = report.results
    figure = Figure(figsize=(SIZE[0], 1.5 + 0.42 * len(rows)), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    for i, row in enumerate(rows):
        ke = row.ke_max if row.worst is None else row.worst.ke
        fill: dict[str, Any] = {"color": "0.68"} if row.worst else {"color": "white", "hatch": "//"}
        axes.barh(i, ke, height=0.62, edgecolor="black", lw=0.8, **fill)
        said = (
            f"none below {ke:,.0f}" if row.worst is None else f"{ke:,.0f} at {row.worst.speed_rpm:,.0f} rpm"
        )
        beside: dict[str, Any] = {"xytext": (5, 0), "textcoords": "offset points", "va": "center"}
        axes.annotate(said, (ke, i), **beside, fontsize=9, bbox=_WHITE, zorder=4)  # over the liner's line
    axes.set_yticks(range(len(rows)), [f"{row.blade.name}, {row.contact_name}" for row in rows])
    axes.invert_yaxis()
    axes.set_xlim(0, 1.42 * max(row.ke_max if row.worst is None else row.worst.ke for row in rows))
    axes.set_xlabel("smallest destabilising $K_e$ over the operating range [N/m]")
    axes.set_title("Ranking, safest first", fontsize=11)
    axes.spines[["top", "right"]].set_visible(False)
    if (ke_liner := rows[0].ke_liner) is not None:
        axes.axvline(ke_liner, **LINER)
        axes.legend(loc="lower right", fontsize=9, frameon=False)
    return as_png(figure)


def described(contact: ContactConfiguration) -> str:
    """The contact in words, short enough for a title."""
    touching = {node: weight for node, weight in contact.weights.items() if weight > 0}
    if len(touching) > 4:
        where = f"contact at {len(touching)} nodes"
    else:
        where = "contact at " + " and ".join(n if w == 1 else f"{n} (× {w:g})" for n, w in touching.items())
    if contact.permanent:
        return f"permanent {where}"
    if contact.engagement is not None:
        low, high = contact.engagement.extremes
        span = f"{low:.0%}" if contact.engagement.harmonics == 0 else f"{low:.0%} to {high:.0%}"
        return f"{where}, engaged by {span} round the casing"
    assert contact.arcs is not None
    if len(contact.arcs) > 3:
        return f"{where}, {len(contact.arcs)} arcs, {contact.engaged_fraction:.0%} of the turn"
    return f"{where}, arcs " + ", ".join(f"{a:.3g}–{b:.3g}" for a, b in contact.arcs)


def _sheet(blade: Blade, title: str, speed_hz: np.ndarray, ke_max: float) -> tuple[Figure, Axes]:
    """Axes with Ω/f₁ below, Ω in Hz above, and K_e with its power of ten."""
    figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    f1 = blade.first_frequency_hz
    axes.set_xlim(speed_hz.min(), speed_hz.max())
    axes.set_ylim(0.0, ke_max)
    axes.set_title(title, fontsize=11, pad=10)
    axes.xaxis.tick_top()
    axes.xaxis.set_label_position("top")
    axes.set_xlabel(r"rotor speed $\Omega$ [Hz]", fontsize=10)
    power = int(np.floor(np.log10(ke_max)))
    unit = "N/m" if -2 < power < 3 else rf"$\times 10^{{{power}}}$ N/m"
    scale = 1.0 if -2 < power < 3 else 10.0**-power
    axes.set_ylabel(rf"$K_e$ [{unit}]", fontsize=11)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda ke, _: f"{ke * scale:.3g}"))
    below = axes.secondary_xaxis("bottom", functions=(scaled_by(1.0 / f1), scaled_by(f1)))
    below.set_xlabel(r"$\Omega / f_1$ at rest  [-]", fontsize=11)
    below.xaxis.set_major_locator(MaxNLocator(8))
    for each in (axes, below):
        each.tick_params(labelsize=10, direction="out")
    return figure, axes


def _verified(axes: Axes, answers: MapAnswers) -> tuple[list[Patch | Line2D], list[str]]:
    """A tint on the points the exact core answered; its key, or a note where one of them answered all."""
    exact = answers.source == EXACT
    if exact.all() or not exact.any():
        return [], [f"every point of the map answered by the {'exact core' if exact.all() else 'surrogate'}"]
    tint = np.ma.masked_where(~exact, np.ones(exact.shape))
    axes.pcolormesh(answers.speed_hz, answers.ke, tint, cmap=ListedColormap([_VERIFIED]), shading="nearest")
    said = f"verified exactly ({answers.exact_share:.1%})"
    return [Patch(facecolor=_VERIFIED, edgecolor="black", lw=0.8, label=said)], []


def _liner(axes: Axes, ke_liner: float) -> Line2D:
    return axes.axhline(ke_liner, **LINER)


def _pointer(axes: Axes, worst: CriticalSpeed) -> Line2D:
    """A triangle just under the deepest lobe's tip."""
    below = worst.ke - 0.025 * axes.get_ylim()[1]
    said = f"least: {worst.ke:,.0f} N/m at {worst.speed_hz:.1f} Hz"
    (mark,) = axes.plot(
        worst.speed_hz, below, ls="none", marker="^", ms=7, color="black", clip_on=False, label=said, zorder=5
    )
    return mark


def _outline(axes: Axes, boundary: BoundaryAnswers) -> tuple[list[Patch | Line2D], list[str]]:
    """Edges of the unstable intervals where they are known, else the first crossing; key and notes."""
    exact = boundary.source == EXACT
    top = axes.get_ylim()[1]
    axes.add_collection(LineCollection(list(_edges(boundary)), colors="black", linewidths=0.8))
    # Up to the exact neighbours, so that the line has no gaps.
    inner = exact & np.r_[exact[1:], True] & np.r_[True, exact[:-1]]
    guessed = np.where(inner, np.nan, boundary.critical_ke)
    (dashed,) = axes.plot(boundary.speed_hz, guessed, color="black", lw=0.9, ls="--")
    dashed.set_label("surrogate's boundary")
    drawn = boundary.critical_ke <= top
    if not drawn.any():
        by = "the exact core" if exact.all() else "the surrogate" if not exact.any() else "both"
        return [], [f"boundary: none below {top:,.0f} N/m, by {by}"]
    key: list[Patch | Line2D] = []
    if (drawn & inner).any():
        said = "exact boundary" if exact[drawn].all() else "boundary"
        key.append(Line2D([], [], color="black", lw=0.9, label=said))
    if (guessed <= top).any():
        key.append(dashed)
    return key, []


def _edges(boundary: BoundaryAnswers) -> Iterator[np.ndarray]:
    """Lines from each edge of an unstable interval to the edge it overlaps with at the next speed."""
    for i in range(len(boundary.speed_hz) - 1):
        here, there = boundary.unstable_ke[i], boundary.unstable_ke[i + 1]
        if here is None or there is None:
            continue
        a, b = boundary.speed_hz[i], boundary.speed_hz[i + 1]
        for low, high in here if not there else there if not here else ():
            # The flank leaves the chart between these two speeds.
            edge, middle = (a, 0.5 * (a + b)) if here else (b, 0.5 * (a + b))
            if high >= boundary.ke_max:
                yield np.array([(edge, low), (middle, high)])
        for low, high in here:
            for low_next, high_next in there:
                if low_next <= high and low <= high_next:
                    yield np.array([(a, low), (b, low_next)])
                    if min(high, high_next) < boundary.ke_max:
                        yield np.array([(a, high), (b, high_next)])


def _flanked(boundary: BoundaryAnswers) -> tuple[np.ndarray, np.ndarray]:
    """The first crossings, each flank carried up to where they were looked for.

    A flank that leaves the range of K_e between two speeds does so half way between them.
    """
    speed, ke = boundary.speed_hz, boundary.critical_ke
    leaves = np.flatnonzero(np.isfinite(ke[:-1]) != np.isfinite(ke[1:]))
    middle = 0.5 * (speed[leaves] + speed[leaves + 1])
    return np.insert(speed, leaves + 1, middle), np.insert(ke, leaves + 1, boundary.ke_max)


def _reaches(boundary: BoundaryAnswers, top: float) -> bool:
    return bool((boundary.critical_ke <= top).any())

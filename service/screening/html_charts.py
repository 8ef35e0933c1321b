"""Charts of a screening for the HTML report: maps, boundaries by contact, and blades side by side."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from service.screening.html_axes import Chart, round_steps, svg_text
from service.screening.screen import ScreeningReport, ScreeningResult
from training.answers import EXACT, BoundaryAnswers

_WHITE, _GREY, _DARK = (255, 255, 255), (178, 178, 178), (102, 102, 102)
# The tint of what the exact core verified, over white and over grey.
_TINT_STABLE, _TINT_UNSTABLE = (214, 226, 243), (150, 163, 183)
_PALETTE = (_WHITE, _GREY, _DARK, _TINT_STABLE, _TINT_UNSTABLE)
_LINES = (("#000000", ""), ("#c8501e", "6 2.5"), ("#2a6fbb", "2 2"), ("#5a5a5a", "8 2 2 2"))
_MARKS = ("circle", "triangle", "square", "diamond")
# Rows of blades in one drawing: more would not fit on a page.
BLADES_A_CHART = 40
_LONGEST_NAME = 30


def map_svg(row: ScreeningResult) -> str:
    """Stability map of one blade and contact: grey unstable, tinted where the exact core verified."""
    chart = _chart(row, row.contact_name)
    answers = row.map
    shade = np.where(np.isnan(answers.stable), 2, np.where(answers.stable > 0, 0, 1))
    exact = answers.source == EXACT
    some = bool(exact.any() and not exact.all())
    if some:
        shade = np.where(exact & (shade < 2), shade + 3, shade)
    chart.raster(shade, _PALETTE)
    _first_crossings(chart, row.boundary)
    chart.key("unstable", fill="#b2b2b2")
    if some:
        chart.key(f"verified ({answers.exact_share:.1%})", fill="#d6e2f3")
    if (shade == 2).any():
        chart.key("not decided", fill="#666666")
    if row.ke_liner is not None:
        chart.level(row.ke_liner)
    if row.worst is not None:
        chart.pointer(row.worst.speed_hz, row.worst.ke)
    return chart.svg


def boundaries_svg(rows: Sequence[ScreeningResult]) -> str:
    """First crossings of one blade under each contact."""
    chart = _chart(rows[0], "boundary by contact")
    for row, (colour, dash) in zip(rows, itertools.cycle(_LINES), strict=False):
        _first_crossings(chart, row.boundary, colour=colour, dash=dash)
        none = "" if row.worst is not None else " (none)"
        chart.key(f"{shortened(row.contact_name, 18)}{none}", colour=colour, dash=dash)
    if rows[0].ke_liner is not None:
        chart.level(rows[0].ke_liner)
    return chart.svg


def overview_svgs(report: ScreeningReport) -> list[str]:
    """Smallest destabilising K_e of every blade, a mark a contact, the safest blade on top.

    A blade ranks by its worst contact.
    """
    blades = safest_first(report)
    contacts = sorted({row.contact_name for row in report.results})
    parts = [blades[i : i + BLADES_A_CHART] for i in range(0, len(blades), BLADES_A_CHART)]
    return [_overview(part, contacts) for part in parts]


def safest_first(report: ScreeningReport) -> list[list[ScreeningResult]]:
    """The results of each blade, blades in the order of their worst contact."""
    by_blade: dict[int, list[ScreeningResult]] = {}
    for row in report.results:
        by_blade.setdefault(id(row.blade), []).append(row)
    place = {id(row): i for i, row in enumerate(report.results)}
    return sorted(by_blade.values(), key=lambda rows: max(place[id(row)] for row in rows))


def shortened(text: str, most: int = _LONGEST_NAME) -> str:
    """Text cut to a length that fits.

    Examples
    --------
    >>> shortened("a-long-name", 6)
    'a-lon…'
    """
    return text if len(text) <= most else f"{text[: most - 1]}…"


def _chart(row: ScreeningResult, title: str) -> Chart:
    return Chart(shortened(title, 48), row.speed_range_hz, row.ke_max, row.blade.first_frequency_hz)


def _first_crossings(
    chart: Chart, boundary: BoundaryAnswers, *, colour: str = "#000", dash: str = ""
) -> None:
    """The first crossings, flanks carried up half way to the next speed that has none."""
    speed, ke = boundary.speed_hz, boundary.critical_ke
    leaves = np.flatnonzero(np.isfinite(ke[:-1]) != np.isfinite(ke[1:]))
    middle = 0.5 * (speed[leaves] + speed[leaves + 1])
    chart.line(
        np.insert(speed, leaves + 1, middle),
        np.insert(ke, leaves + 1, boundary.ke_max),
        colour=colour,
        dash=dash,
    )


def _overview(blades: Sequence[Sequence[ScreeningResult]], contacts: Sequence[str]) -> str:
    left, wide, row_height, top = 210.0, 560.0, 18.0, 44.0
    ke_max = max(row.ke_max for rows in blades for row in rows)
    bottom = top + row_height * len(blades)

    def x(ke: float) -> float:
        return left + wide * ke / ke_max

    out = [
        f'<svg viewBox="0 0 {left + wide + 30:g} {bottom + 42:g}" role="img" '
        'aria-label="smallest destabilising K_e of each blade" font-family="DejaVu Sans, Arial, sans-serif">'
    ]
    for i, name in enumerate(contacts):
        across, down = left + (i % 4) * 140, 12 + 14 * (i // 4)
        out.append(_mark(i, across, down) + _said(shortened(name, 16), across + 9, down + 4, "start"))
    for ke in round_steps(0.0, ke_max, 6):
        out.append(f'<path d="M{x(ke):.1f} {top}V{bottom + 4}" stroke="#ddd"/>')
        out.append(_said(f"{ke:,.0f}", x(ke), bottom + 17, "middle"))
    out.append(
        _said("smallest destabilising K_e [N/m]; hollow: none up to there", left, bottom + 34, "start")
    )
    liner = blades[0][0].ke_liner
    if liner is not None:
        out.append(
            f'<path d="M{x(liner):.1f} {top - 6}V{bottom}" stroke="#000" stroke-dasharray="7 3 1.5 3"/>'
        )
        out.append(_said("liner", x(liner) + 4, top - 3, "start"))
    for i, rows in enumerate(blades):
        y = top + row_height * (i + 0.5)
        out.append(_said(shortened(rows[0].blade.name), left - 12, y + 4, "end"))
        out.append(f'<path d="M{left} {y:.1f}h{wide}" stroke="#eee"/>')
        for row in rows:
            at = row.ke_max if row.worst is None else row.worst.ke
            out.append(_mark(contacts.index(row.contact_name), x(at), y, hollow=row.worst is None))
    return "".join([*out, "</svg>"])


def _mark(contact: int, x: float, y: float, *, hollow: bool = False) -> str:
    colour = _LINES[contact % len(_LINES)][0]
    paint = f'fill="{"#fff" if hollow else colour}" stroke="{colour}" stroke-width="1.3"'
    match _MARKS[contact % len(_MARKS)]:
        case "circle":
            return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" {paint}/>'
        case "triangle":
            return f'<path d="M{x:.1f} {y - 4.5:.1f}l4.5 8.5h-9z" {paint}/>'
        case "square":
            return f'<rect x="{x - 3.8:.1f}" y="{y - 3.8:.1f}" width="7.6" height="7.6" {paint}/>'
        case _:
            return f'<path d="M{x:.1f} {y - 5:.1f}l5 5-5 5-5-5z" {paint}/>'


def _said(text: str, x: float, y: float, anchor: str) -> str:
    return svg_text(text, x, y, size=11, anchor=anchor)

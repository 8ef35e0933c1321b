"""A screening as one page for reading and printing: ranking first, then every blade on a sheet of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from html import escape
from typing import Any

import numpy as np

from sdm_core.blade import Blade
from sdm_core.version import __version__
from service.screening.batch import ScreenedBatch
from service.screening.charts import described
from service.screening.html_charts import boundaries_svg, map_svg, overview_svgs, safest_first
from service.screening.html_page import Markup, element, page, table
from service.screening.html_ranking import NOT_SCREENED, count, ranking, set_ke, summary, verdict
from service.screening.screen import ScreeningResult
from training.answers import CertificateUsed
from training.contact_class import in_words

_TITLE = "Screening for rub-induced instability"
# On a sheet; report.json has all that were found.
TIPS_SHOWN = 4


def html_report(
    batch: ScreenedBatch,
    *,
    policy: str,
    card: Mapping[str, Any] | None,
    made: datetime,
    safer_left_out: int = 0,
) -> str:
    """The whole page, pictures within it; no scripts, and nothing fetched from anywhere.

    Parameters
    ----------
    policy
        Who answered the maps.
    card
        Card of the surrogate in use; None where none is known.
    made
        When the screening was made.
    safer_left_out
        Blades of the screening that are not in `batch`, each safer than all that are.
    """
    anchors = {id(blade): f"blade-{i}" for i, blade in enumerate(batch.blades, 1)}
    blades = safest_first(batch.report)
    body = [
        element("h1", _TITLE),
        *([_left_out(len(blades), safer_left_out)] if safer_left_out else []),
        f"<p>{summary(batch, blades)}</p>",
        ranking(batch.report, blades, anchors),
        element("h2", "Blades side by side"),
        *overview_svgs(batch.report),
        _failures(batch),
        _screened(batch, policy, card, made),
    ]
    sources = {id(blade): source for blade, source in zip(batch.blades, batch.sources, strict=True)}
    body += [_sheet(rows, sources[id(rows[0].blade)], anchors[id(rows[0].blade)]) for rows in blades]
    foot = f"rubscreen {__version__}, {_date(made)}"
    return page(_TITLE, "\n".join((*body, element("p", foot, cls="foot"))))


def certificate(card: Mapping[str, Any], policy: str, used: CertificateUsed | None = None) -> str:
    """What a model's card says of its mistakes, in a line, and the bound its answers were given under.

    A card of another age may say less.
    """
    said = []
    for contact, evaluation in card.get("evaluation", {}).items():
        found = evaluation.get("alone" if policy == "surrogate" else "auto", {})
        if "false_stable" in found:
            said.append(
                f"in {in_words(contact)}, on {found['points']:,} independent points of "
                f"{evaluation.get('distribution', 'its domain')}, "
                f"{found['false_stable']} of {found['answered_stable']:,} answers “stable” were wrong and "
                f"{found['false_unstable']} of {found['answered_unstable']:,} “unstable”, "
                f"{found['exact_share']:.1%} being verified by the exact core"
            )
    if used is not None:
        said.append(
            f"the share of unstable designs among those called stable is below {used.alpha:g} "
            f"with {used.confidence:.0%} confidence on {used.distribution}"
        )
    return "; ".join(said) or "its card names no error rates"


def _left_out(shown: int, left_out: int) -> str:
    said = (
        f"The {count(shown, 'blade')} with the smallest K_e of {shown + left_out:,} screened; the other "
        f"{left_out:,} are safer, and in the table of results only. What follows is about those {shown}."
    )
    return f"<p><b>{set_ke(escape(said))}</b></p>"


def _failures(batch: ScreenedBatch) -> str:
    out = []
    if batch.failures:
        out.append(element("h2", "Not screened", id=NOT_SCREENED))
        rows = [(failure.source, failure.reason) for failure in batch.failures]
        out.append(table(("file", "reason"), rows, long=(0, 1)))
    if batch.ignored:
        names = ", ".join(batch.ignored[:20]) + (" …" if len(batch.ignored) > 20 else "")
        out.append(
            element("p", f"{count(len(batch.ignored), 'entry')} ignored, not *.json: {names}", cls="note")
        )
    return "".join(out)


def _screened(batch: ScreenedBatch, policy: str, card: Mapping[str, Any] | None, made: datetime) -> str:
    results, blades = batch.report.results, batch.blades
    first = results[0]
    contacts = {row.contact_name: described(row.contact) for row in results}
    lows, highs = zip(*(row.speed_range_hz for row in results), strict=True)
    damping = np.concatenate([blade.damping_ratio for blade in blades])
    liner = "none given" if first.ke_liner is None else f"{first.ke_liner:,.0f} N/m"
    rows: list[tuple[str, str]] = [
        ("blades", f"{len(blades)} screened, {len(batch.failures)} not"),
        ("contacts", "; ".join(f"{name}: {words}" for name, words in contacts.items())),
        ("rotor speeds", _span(min(lows), min(highs), max(lows), max(highs))),
        ("K_e", f"0 to {first.ke_max:,.0f} N/m; of the liner: {liner}"),
        ("damping ratio", _range(damping.min(), damping.max())),
        ("amplitudes", ", ".join(sorted({blade.direction.replace("_", "-") for blade in blades}))),
        ("smallest K_e", f"by the exact core at the tips of the lobes: {batch.report.solver}"),
        ("maps", _who_answers(policy, batch.report.model)),
    ]
    if batch.report.model is not None:
        used = next((row.map.certificate for row in results if row.map.certificate is not None), None)
        said = certificate(card or {}, policy, used) if card or used else "card not known"
        rows.append(("surrogate", f"{batch.report.model}: {said}"))
    rows.append(("made", f"{_date(made)} by rubscreen {__version__}"))
    marked = [
        (Markup(f'<span class="w">{set_ke(escape(name))}</span>'), Markup(set_ke(escape(text))))
        for name, text in rows
    ]
    return element("h2", "What was screened") + table(("", ""), marked)


def _who_answers(policy: str, model: str | None) -> str:
    if policy == "exact" or model is None:
        return "every point by the exact core"
    if policy == "surrogate":
        return "every point by the surrogate"
    return "by the surrogate, verified by the exact core wherever the surrogate may be wrong (tinted)"


def _sheet(rows: Sequence[ScreeningResult], source: str, anchor: str) -> str:
    """One blade: what it is, its charts, its deepest lobes."""
    blade = rows[0].blade
    ordered = sorted(rows, key=lambda row: row.contact_name)
    charts = [map_svg(row) for row in ordered]
    if len(rows) > 1:
        charts.append(boundaries_svg(ordered))
    return (
        f'<section class="sheet" id="{anchor}">{element("h2", blade.name)}'
        f'<p class="note">{escape(_about(blade, source, rows[0]))}</p>'
        f'<div class="across">{"".join(f"<div>{chart}</div>" for chart in charts)}</div>'
        f"{_lobes(ordered)}</section>"
    )


def _about(blade: Blade, source: str, row: ScreeningResult) -> str:
    states = blade.speed_range_hz
    low, high = row.speed_range_hz
    said = [
        f"{source}: {count(blade.mode_count, 'mode')}, "
        + ", ".join(f"{f:.0f}" for f in blade.states[0].frequency_hz)
        + " Hz"
        + (" at every speed (one state)" if states is None else _at(states[0]))
        + f"; damping ratio {_range(blade.damping_ratio.min(), blade.damping_ratio.max())}",
        f"screened from {low:.4g} to {high:.4g} Hz ({60 * low:,.0f} to {60 * high:,.0f} rpm)",
    ]
    if blade.design_speed_hz is not None:
        said.append(f"design speed {60 * blade.design_speed_hz:,.0f} rpm")
    return "; ".join(said)


def _at(speed_hz: float) -> str:
    return " at rest" if speed_hz == 0 else f" at {60 * speed_hz:,.0f} rpm"


def _lobes(rows: Sequence[ScreeningResult]) -> str:
    lines = []
    for row in rows:
        if not row.critical_speeds:
            lines.append((row.contact_name, f"none up to {row.ke_max:,.0f}", *[""] * 5, verdict(row)))
        for i, tip in enumerate(row.critical_speeds[:TIPS_SHOWN]):
            lines.append(
                (
                    row.contact_name if i == 0 else "",
                    f"{tip.ke:,.0f}{'' if tip.proven else ' (not proven)'}",
                    f"{tip.speed_hz:.2f}",
                    f"{tip.speed_rpm:,.0f}",
                    f"{tip.speed_ratio:.4f}",
                    f"{tip.chatter_hz:.1f}",
                    f"{tip.lobes_per_revolution:.2f}",
                    verdict(row) if i == 0 else "",
                )
            )
    headings = ["contact", "K_e [N/m]", "Ω [Hz]", "rpm", "Ω/f₁", "chatter [Hz]", "wear lobes", "verdict"]
    if rows[0].ke_liner is None:
        headings, lines = headings[:-1], [line[:-1] for line in lines]
    made = table(headings, lines, numbers=range(1, 7))
    return element("h3", "Deepest lobes, by the exact core") + made.replace("K_e", "K<sub>e</sub>", 1)


def _span(lowest: float, least_end: float, highest_start: float, highest: float) -> str:
    if lowest == highest_start and least_end == highest:
        return f"{lowest:.4g} to {highest:.4g} Hz"
    begin, end = f"{lowest:.4g}–{highest_start:.4g} Hz", f"{least_end:.4g}–{highest:.4g} Hz"
    return f"of each blade's own range: from {begin} to {end}"


def _range(low: float, high: float) -> str:
    return f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"


def _date(made: datetime) -> str:
    return made.strftime("%Y-%m-%d %H:%M %Z").strip()

"""The ranking of an HTML report: by blade and contact, or by blade where that would be many pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

from service.screening.batch import ScreenedBatch
from service.screening.html_page import Markup, table
from service.screening.screen import STABLE, UNDECIDED, UNSTABLE, ScreeningReport, ScreeningResult

# Rows that fit on a page, and contacts whose columns do.
MOST_ROWS, MOST_CONTACTS = 40, 5
NOT_SCREENED = "not-screened"
_VERDICT = {STABLE: "stable", UNSTABLE: "unstable", UNDECIDED: "not decided"}


def summary(batch: ScreenedBatch, blades: Sequence[Sequence[ScreeningResult]]) -> str:
    """What to take away, in a few sentences."""
    results = batch.report.results
    said = [f"{count(len(blades), 'blade')} screened."]
    if (liner := results[0].ke_liner) is not None:
        kept = sum(all(row.verdict == STABLE for row in rows) for rows in blades)
        failed = sum(any(row.verdict == UNSTABLE for row in rows) for rows in blades)
        unsure = len(blades) - kept - failed
        undecided = f", {unsure} not decided" if unsure else ""
        said.append(
            f"With a liner of K_e = {liner:,.0f} N/m, {kept} stable under every contact, {failed} unstable "
            f"under some{undecided}."
        )
    if (worst := results[-1].worst) is not None:
        said.append(
            f"Least K_e of all: {worst.ke:,.0f} N/m, {results[-1].blade.name} with contact "
            f"{results[-1].contact_name} at {worst.speed_rpm:,.0f} rpm."
        )
    text = set_ke(escape(" ".join(said)))
    if not batch.failures:
        return text
    many = count(len(batch.failures), "blade")
    return f'{text} <a href="#{NOT_SCREENED}"><b>{many} could not be screened.</b></a>'


def ranking(
    report: ScreeningReport, blades: Sequence[Sequence[ScreeningResult]], anchors: Mapping[int, str]
) -> str:
    """Safest first.

    Parameters
    ----------
    blades
        The results blade by blade, safest first.
    anchors
        Where each blade's sheet is, by its `id`.
    """
    contacts = list(dict.fromkeys(row.contact_name for row in report.results))
    if len(report.results) > MOST_ROWS and 1 < len(contacts) <= MOST_CONTACTS:
        return _by_blade(blades, sorted(contacts), anchors)
    return _by_contact(report, anchors)


def verdict(row: ScreeningResult) -> Markup:
    """Against the liner, with the margin; heavy where it is not stable, empty without a liner."""
    if row.verdict is None:
        return Markup("")
    margin = "" if row.margin is None else f" {row.margin:+.0%}"
    said = f"{_VERDICT[row.verdict]}{margin}"
    return Markup(f'<span class="w">{said}</span>' if row.verdict == STABLE else f'<b class="w">{said}</b>')


def count(many: int, what: str) -> str:
    """A number of things.

    Examples
    --------
    >>> count(1, "blade"), count(3, "entry")
    ('1 blade', '3 entries')
    """
    plural = f"{what[:-1]}ies" if what.endswith("y") else f"{what}s"
    return f"{many:,} {what if many == 1 else plural}"


def set_ke(escaped: str) -> str:
    """K_e as it is printed."""
    return escaped.replace("K_e", "K<sub>e</sub>")


def _by_contact(report: ScreeningReport, anchors: Mapping[int, str]) -> str:
    rows = [
        (str(i), _link(row, anchors), row.contact_name, *_where(row), *_shares(row), verdict(row))
        for i, row in enumerate(report.results, 1)
    ]
    headings = ["", "blade", "contact", "K_e [N/m]", "at rpm", "Ω/f₁"]
    headings += ["chatter [Hz]", "wear lobes", "unstable", "verified", "verdict"]
    return _titled("Ranking, safest first", headings, rows, numbers=(0, *range(3, 10)), long=(1, 2))


def _by_blade(
    blades: Sequence[Sequence[ScreeningResult]], contacts: Sequence[str], anchors: Mapping[int, str]
) -> str:
    """One row a blade: its K_e under each contact, and where the worst of them is."""
    lines = []
    for i, rows in enumerate(blades, 1):
        by_name = {row.contact_name: row for row in rows}
        each = [_least(by_name[name]) if name in by_name else "" for name in contacts]
        last = rows[-1]  # ranked: the worst contact
        lines.append(
            (str(i), _link(last, anchors), *each, last.contact_name, *_where(last)[1:], verdict(last))
        )
    headings = ["", "blade", *(f"K_e {name}" for name in contacts), "worst", "at rpm", "Ω/f₁"]
    headings += ["chatter [Hz]", "wear lobes", "verdict"]
    first = 2 + len(contacts)
    numbers = (0, *range(2, first), *range(first + 1, first + 5))
    return _titled("Ranking by the worst contact, safest first; K_e in N/m", headings, lines, numbers, (1,))


def _titled(
    title: str,
    headings: Sequence[str],
    rows: Sequence[Sequence[str]],
    numbers: Sequence[int],
    long: Sequence[int],
) -> str:
    if not any(row[-1] for row in rows):  # no liner: no verdict
        headings, rows = headings[:-1], [row[:-1] for row in rows]
    heads = [Markup(set_ke(escape(heading))) for heading in headings]
    made = table(heads, rows, numbers=numbers, long=long)
    return f"<h2>{set_ke(escape(title))}</h2>{made}"


def _link(row: ScreeningResult, anchors: Mapping[int, str]) -> Markup:
    return Markup(f'<a href="#{anchors[id(row.blade)]}">{escape(row.blade.name)}</a>')


def _least(row: ScreeningResult) -> str:
    if row.worst is None:
        return f"> {row.ke_max:,.0f}"
    return f"{row.worst.ke:,.0f}{'' if row.worst.proven else ' (not proven)'}"


def _where(row: ScreeningResult) -> tuple[str, ...]:
    """K_e, rpm, Ω/f₁, chatter frequency and wear lobes of the deepest lobe."""
    if (worst := row.worst) is None:
        return _least(row), "–", "–", "–", "–"
    return (
        _least(row),
        f"{worst.speed_rpm:,.0f}",
        f"{worst.speed_ratio:.3f}",
        f"{worst.chatter_hz:.1f}",
        f"{worst.lobes_per_revolution:.1f}",
    )


def _shares(row: ScreeningResult) -> tuple[str, str]:
    return f"{row.unstable_share:.1%}", f"{row.verified_share:.1%}"

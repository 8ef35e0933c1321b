"""The figures on one page, each beside what agrees with the paper and what does not."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from html import escape

from sdm_core.version import __version__
from service.paper_figures.all_figures import BladeFigures
from service.paper_figures.paper_figure import PaperFigure
from service.screening.html_page import Markup, element, page, picture, table

TITLE = "Figures of Salvat, Batailly and Legrand (2013), drawn for two other blades"
INTRODUCTION = (
    "The paper's blade is not public, so its figures cannot be redrawn: what can be compared is what they "
    "say. Every line below follows from the numbers of the figure beside it; those are in figures.json. "
    "Boundaries are the exact ones of the delay equation, except where Fig. 7 draws the paper's method. "
    "Fig. 6 integrates that equation in time, Figs. 11, 12 and 14 a blade against a liner of plastic bars. "
    "Speeds are drawn from Ω/f₁ = 0.05, below which lobes cannot be told apart. Figures 5, 9 and 10 keep "
    "all modes of the blade, the paper two. Where modal data end before Ω/f₁ = 0.45 they are extrapolated "
    "in Ω² and hatched; what is said leaves that out."
)


def paper_page(blades: Sequence[BladeFigures], pictures: Sequence[Sequence[bytes]], made: datetime) -> str:
    """The page as HTML, pictures embedded.

    Parameters
    ----------
    pictures
        PNG of each figure of each blade.
    made
        When, for the page's foot.
    """
    body = [element("h1", TITLE), element("p", INTRODUCTION), _overview(blades)]
    for of_blade, drawn in zip(blades, pictures, strict=True):
        body.append(element("h2", of_blade.study.blade.name))
        body += [f"<p>{_text(said)}</p>" for said in of_blade.about]
        body += [_figure(figure, png) for figure, png in zip(of_blade.figures, drawn, strict=True)]
    body.append(
        element("p", f"rubscreen {__version__}, {made.strftime('%Y-%m-%d %H:%M %Z').strip()}", cls="foot")
    )
    return page(TITLE, "\n".join(body))


def overview_rows(blades: Sequence[BladeFigures]) -> tuple[list[str], list[tuple[str, ...]]]:
    """Names of the blades; a row a statement: figure, what the paper says, the verdict on each blade."""
    verdicts: dict[tuple[int, str], dict[str, str]] = {}
    for of_blade in blades:
        for figure in of_blade.figures:
            for claim in figure.claims:
                row = verdicts.setdefault((figure.number, claim.paper), {})
                row[figure.blade] = claim.verdict
    names = list(dict.fromkeys(of_blade.study.blade.name for of_blade in blades))
    return names, [
        (f"Fig. {number}", paper, *(found.get(name, "") for name in names))
        for (number, paper), found in sorted(verdicts.items(), key=lambda item: item[0][0])
    ]


def _overview(blades: Sequence[BladeFigures]) -> str:
    names, rows = overview_rows(blades)
    set_rows = [(number, _text(paper), *verdicts) for number, paper, *verdicts in rows]
    return table(("figure", "the paper says", *names), set_rows)


def _figure(figure: PaperFigure, png: bytes) -> str:
    name = f"Fig. {figure.number}: {figure.title}"
    beside = [
        element("h3", name),
        f"<p><b>Agrees with the paper.</b> {_text(figure.agrees)}</p>",
        f"<p><b>Does not.</b> {_text(figure.differs)}</p>",
    ]
    if figure.notes:
        beside.append(f'<p class="note">Drawn: {_text("; ".join(figure.notes))}.</p>')
    return (
        f'<section class="beside"><div>{picture(png, f"{name}, {figure.blade}")}</div>'
        f"<div>{''.join(beside)}</div></section>"
    )


def _text(said: str) -> Markup:
    """Escaped, K_e set as it is printed."""
    return Markup(escape(said).replace("K_e", "K<sub>e</sub>"))

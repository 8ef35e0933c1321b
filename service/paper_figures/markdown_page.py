"""The figures as a page of the documentation: Markdown with pictures beside it."""

from __future__ import annotations

from collections.abc import Sequence

from service.paper_figures.all_figures import BladeFigures
from service.paper_figures.page import INTRODUCTION, TITLE, overview_rows
from service.paper_figures.paper_figure import PaperFigure


def markdown_page(blades: Sequence[BladeFigures], pictures: Sequence[Sequence[str]], command: str) -> str:
    """The page.

    Parameters
    ----------
    pictures
        File name of each figure of each blade, beside the page.
    command
        That builds it.
    """
    names, rows = overview_rows(blades)
    lines = [
        f"# {TITLE}",
        "",
        INTRODUCTION,
        "",
        f"Built by `{command}`; the numbers are in [figures.json](figures.json).",
        "",
        "| figure | the paper says | " + " | ".join(names) + " |",
        "|" + "---|" * (2 + len(names)),
        *("| " + " | ".join(cell.replace("|", r"\|") for cell in row) + " |" for row in rows),
        "",
    ]
    for of_blade, files in zip(blades, pictures, strict=True):
        lines += [f"## {of_blade.study.blade.name}", ""]
        for said in of_blade.about:
            lines += [_plain(said), ""]
        for figure, file in zip(of_blade.figures, files, strict=True):
            lines += _figure(figure, file)
    return "\n".join(lines).rstrip() + "\n"


def _figure(figure: PaperFigure, file: str) -> list[str]:
    name = f"Fig. {figure.number}: {figure.title}"
    lines = [f"### {name}, {figure.blade}", "", f"![{name}]({file})", ""]
    for claim in figure.claims:
        lines.append(
            f"- The paper: {_plain(claim.paper)}. **{claim.verdict.capitalize()}**: {_plain(claim.here)}."
        )
    lines.append("")
    if figure.notes:
        lines += [f"*Drawn: {_plain('; '.join(figure.notes))}.*", ""]
    return lines


def _plain(said: str) -> str:
    """Text whose signs Markdown would take for its own."""
    for sign in "*_|<":
        said = said.replace(sign, f"\\{sign}")
    return said

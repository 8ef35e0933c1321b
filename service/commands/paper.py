"""`rubscreen paper`: the paper's figures for the shipped blades, and what agrees with it."""

from __future__ import annotations

from typing import Annotated, Any

import typer


def run(
    out: Annotated[
        str,
        typer.Option(metavar="FOLDER", help="Where index.html, figures.json and the pictures go."),
    ] = "out/paper",
    direction: Annotated[
        str | None,
        typer.Option(
            metavar="radial",
            help="Amplitudes to draw: radial, as the paper does. Left out: each blade's own, casing-normal.",
            show_default=False,
        ),
    ] = None,
    markdown: Annotated[
        bool, typer.Option("--markdown", help="Write index.md, as in docs/paper, instead of index.html.")
    ] = False,
) -> None:
    """Draw Figs. 5 to 14 of Salvat et al. for two real blades, and say what agrees.

    Example: rubscreen paper --out out/paper, then open out/paper/index.html
    """
    import time
    from datetime import UTC, datetime

    from sdm_core.version import __version__
    from service.commands.outputs import check_writable, progress_bar, terminal, write_bytes, write_json
    from service.paper_figures.all_figures import all_figures, example_studies
    from service.paper_figures.drawing import figure_png
    from service.paper_figures.markdown_page import markdown_page
    from service.paper_figures.page import paper_page
    from service.screening.report_files import file_name

    page = f"{out}/index.{'md' if markdown else 'html'}"
    check_writable(out=page)
    studies = example_studies(direction)
    made, began = datetime.now(UTC), time.perf_counter()
    with progress_bar("paper") as progress:
        blades = list(all_figures(studies, progress))
    pictures = [[figure_png(figure) for figure in of_blade.figures] for of_blade in blades]

    console = terminal()
    figures: list[dict[str, Any]] = []
    for of_blade, drawn in zip(blades, pictures, strict=True):
        name = of_blade.study.blade.name
        console.print(f"[bold]{name}[/bold]")
        for figure, png in zip(of_blade.figures, drawn, strict=True):
            path = f"{out}/{file_name(name)}_fig_{figure.number:02d}.png"
            write_bytes("--out", path, png)
            figures.append({**figure.to_dict(), "picture": path.rpartition("/")[2]})
            held = sum(claim.holds is True for claim in figure.claims)
            console.print(f"  Fig. {figure.number}: {held} of {len(figure.claims)} statements hold")
    document = {
        "schema": "rubscreen/paper-figures/1",
        "version": __version__,
        "made": made.isoformat(timespec="seconds"),
        "blades": [{"blade": b.study.blade.name, "about": list(b.about)} for b in blades],
        "figures": figures,
    }
    write_json(f"{out}/figures.json", document)
    if markdown:
        files = [
            [str(figure["picture"]) for figure in figures if figure["blade"] == b.study.blade.name]
            for b in blades
        ]
        text = markdown_page(blades, files, f"rubscreen paper --markdown --out {out}")
    else:
        text = paper_page(blades, pictures, made)
    write_bytes("--out", page, text.encode())
    spent = time.perf_counter() - began
    console.print(f"wrote {len(figures)} figures, figures.json and {page} in {spent:.0f} s")

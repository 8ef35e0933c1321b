"""`rubscreen screen`: rank blades and contacts by the K_e that destabilises them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.commands.options import (
    CONTACT,
    OUTPUT,
    AlphaOption,
    ArcsOption,
    EngagementOption,
    JsonOption,
    KeMaxOption,
    LinerOption,
    ModelsOption,
    Policy,
    PolicyOption,
    SpeedOption,
    UrlOption,
)

if TYPE_CHECKING:
    from rich.table import Table

    from sdm_core.blade import Blade
    from sdm_core.errors import RubscreenError
    from service.answerer import Answerer
    from service.commands.blade_batch import LoadedBlades
    from service.screening.batch import ContactsOf, Failure, ScreenedBatch
    from service.speeds import SpeedRange


def run(
    blades: Annotated[
        list[str],
        typer.Argument(
            metavar="BLADE...",
            help="Blade files, folders of them (*.json), or shipped examples: nasa_rotor_37, "
            "generic_compressor_blade.",
            show_default=False,
        ),
    ],
    speed: SpeedOption = None,
    ke_max: KeMaxOption = 2.5e4,
    ke_liner: LinerOption = None,
    grid: Annotated[
        str | None,
        typer.Option(
            metavar="SPEEDSxSTIFFNESSES",
            help="Points of each map. Left out: 100x100, or 50x50 with an engagement.",
            show_default=False,
        ),
    ] = None,
    nodes: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LE[,TE...]",
            help="Tip nodes of one contact; repeat for more. Left out: leading edge, trailing edge, both.",
            rich_help_panel=CONTACT,
            show_default=False,
        ),
    ] = None,
    weights: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LE=1[,TE=0.5...]|chord",
            help="Nodes and weights of one contact, or chord: all tip nodes, by quadrature along it; "
            "repeat for more.",
            rich_help_panel=CONTACT,
            show_default=False,
        ),
    ] = None,
    arcs: ArcsOption = None,
    engagement: EngagementOption = None,
    policy: PolicyOption = Policy.auto,
    alpha: AlphaOption = None,
    url: UrlOption = None,
    models: ModelsOption = None,
    json: JsonOption = None,
    html: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="Write a report for reading and printing: one page, pictures within it.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        str | None,
        typer.Option(
            metavar="FOLDER",
            help="Write report.json and every chart into a folder.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
) -> None:
    """Smallest destabilising K_e of every blade and contact over the speed range, and where.

    Of several blades, those that cannot be read or screened are listed with the reason, the rest ranked; the
    exit code is 0 as long as one was screened.

    Example: rubscreen screen blades/ nasa_rotor_37 --ke-liner 9000 --html report.html
    """
    from service.commands.blade_batch import blade_paths, load_blades
    from service.commands.inputs import answerer_from, check_stiffnesses, contacts_from, grid_from
    from service.commands.outputs import check_writable, console_beside, progress_bar, write_json
    from service.commands.tables import ranking_table
    from service.screening.batch import ScreenedBatch, screen_each
    from service.speeds import SpeedRange

    paths = blade_paths(blades)
    report_path = None if out is None else f"{out}/report.json"
    check_writable(inputs=paths.files, json=json, html=html, out=report_path)
    contacts = contacts_from(nodes or (), weights or (), arcs, engagement)
    speed_range = None if speed is None else SpeedRange.parse(speed, "--speed")
    shape = None if grid is None else grid_from(grid)
    check_stiffnesses(ke_max, ke_liner)
    with progress_bar("reading") as progress:
        loaded = load_blades(paths, progress)
    fit, unfit = _checked(loaded, contacts, speed_range, ke_max, here=url is None, alone=paths.alone)
    if not fit:
        raise _none_left((*loaded.failures, *unfit))
    answerer = answerer_from(url, models, policy.value)

    with progress_bar("screening") as progress:
        report, kept, failed = screen_each(
            fit,
            contacts,
            answerer,
            alone=paths.alone,
            speed_range=speed_range,
            ke_max=ke_max,
            ke_liner=ke_liner,
            map_shape=shape,
            policy=policy.value,
            alpha=alpha,
            progress=progress,
        )
    failures = (*loaded.failures, *unfit, *failed)
    if report is None:
        raise _none_left(failures)
    batch = ScreenedBatch(
        report, tuple(b for b, _ in kept), tuple(s for _, s in kept), failures, loaded.ignored
    )

    console = console_beside(json)
    console.print(ranking_table(report))
    console.print(
        "[dim]K_e: the smallest that destabilises, by the exact core at the tip of the deepest lobe; "
        "unstable, verified: share of the map that is unstable, and that the exact core answered; "
        f"model {report.model}, solver {report.solver}[/dim]"
    )
    if failures:
        console.print(_failure_table(failures))
    if json:
        write_json(json, batch.to_dict(), indent=True)
    if html:
        from datetime import UTC, datetime

        from service.commands.outputs import write_bytes
        from service.screening.html_report import html_report

        text = html_report(batch, policy=policy.value, card=_card(answerer), made=datetime.now(UTC))
        write_bytes("--html", html, text.encode())
        console.print(f"[dim]wrote {html}[/dim]")
    if out:
        from service.screening.report_files import write_report

        with progress_bar("charts") as progress:
            written = write_report(out, report, document=batch.to_dict(), progress=progress)
        for path in written:
            console.print(f"[dim]wrote {path}[/dim]")
    for line in _what_was_left_out(batch):
        typer.echo(line, err=True)


def _checked(
    loaded: LoadedBlades,
    contacts: ContactsOf,
    speed_range: SpeedRange | None,
    ke_max: float,
    *,
    here: bool,
    alone: bool,
) -> tuple[list[tuple[Blade, str]], tuple[Failure, ...]]:
    """Blades that can be screened as asked, with their sources, and those that cannot, before any work."""
    from sdm_core.errors import RubscreenError
    from service.commands.inputs import check_work
    from service.screening.batch import Failure
    from service.speeds import operating_range

    fit, unfit = [], []
    for blade, source in loaded.with_sources:
        try:
            speeds = operating_range(blade) if speed_range is None else speed_range.for_blade(blade)
            for contact in contacts(blade).values():
                check_work(blade, contact, speeds, ke_max, here=here, every_lobe=True)
        except RubscreenError as error:
            if alone:
                raise
            unfit.append(Failure.of(source, error))
        else:
            fit.append((blade, source))
    return fit, tuple(unfit)


def _none_left(failures: Sequence[Failure]) -> RubscreenError:
    from sdm_core.errors import RubscreenError

    named = "; ".join(f"{failure.source}: {failure.reason}" for failure in failures[:3])
    more = f"; and {len(failures) - 3} more" if len(failures) > 3 else ""
    return RubscreenError(f"none of the {len(failures)} blades could be screened: {named}{more}")


def _failure_table(failures: Sequence[Failure]) -> Table:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    table = Table(
        title="Not screened", title_justify="left", title_style="bold", box=SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    table.add_column("file", overflow="fold")
    table.add_column("reason", overflow="fold")
    for failure in failures:
        # As Text: a name may hold what rich takes for a style.
        table.add_row(Text(failure.source), Text(failure.reason))
    return table


def _what_was_left_out(batch: ScreenedBatch) -> list[str]:
    """Lines for stderr."""
    lines = []
    if batch.failures:
        total = len(batch.blades) + len(batch.failures)
        names = _some([failure.source for failure in batch.failures])
        lines.append(f"rubscreen: {len(batch.failures)} of {total} blades could not be screened: {names}")
    if batch.ignored:
        many = "entry" if len(batch.ignored) == 1 else "entries"
        lines.append(f"rubscreen: {len(batch.ignored)} {many} ignored, not *.json: {_some(batch.ignored)}")
    return lines


def _some(names: Sequence[str], most: int = 8) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(" ".join(name.split()) for name in names[:most]) + more


def _card(answerer: Answerer) -> dict[str, Any] | None:
    """What the model in use says of itself; None where none is, or the service does not tell."""
    from sdm_core.errors import RubscreenError
    from service.client import Client
    from training.screening import Screener

    if isinstance(answerer, Screener):
        return answerer.model.card if answerer.model else None
    if not isinstance(answerer, Client):
        return None
    try:
        return next((entry["card"] for entry in answerer.models() if entry["active"]), None)
    except (RubscreenError, KeyError, TypeError):
        return None

"""`rubscreen screen`: rank blades and contacts by the K_e that destabilises them."""

from __future__ import annotations

from typing import Annotated

import typer

from service.commands.options import (
    CONTACT,
    OUTPUT,
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


def run(
    blades: Annotated[
        list[str],
        typer.Argument(
            metavar="BLADE...",
            help="Blade files, or shipped examples: nasa_rotor_37, generic_compressor_blade.",
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
            help="Points of each map. Left out: 100x100, or 50x50 with arcs or an engagement.",
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
            metavar="LE=1[,TE=0.5...]",
            help="Nodes and weights of one contact; repeat for more.",
            rich_help_panel=CONTACT,
            show_default=False,
        ),
    ] = None,
    arcs: ArcsOption = None,
    engagement: EngagementOption = None,
    policy: PolicyOption = Policy.auto,
    url: UrlOption = None,
    models: ModelsOption = None,
    json: JsonOption = None,
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

    Example: rubscreen screen nasa_rotor_37 generic_compressor_blade --ke-liner 9000
    """
    from service.commands.inputs import (
        answerer_from,
        blade_from,
        check_stiffnesses,
        check_work,
        contacts_from,
        grid_from,
    )
    from service.commands.outputs import check_writable, console_beside, progress_bar, write_json
    from service.commands.tables import ranking_table
    from service.screening.screen import default_contacts, screen
    from service.speeds import SpeedRange, operating_range

    report_path = None if out is None else f"{out}/report.json"
    check_writable(inputs=blades, json=json, out=report_path)
    chosen = [blade_from(text) for text in blades]
    contacts = contacts_from(nodes or (), weights or (), arcs, engagement, chosen)
    speed_range = None if speed is None else SpeedRange.parse(speed, "--speed")
    shape = None if grid is None else grid_from(grid)
    check_stiffnesses(ke_max, ke_liner)
    for each in chosen:
        speeds = operating_range(each) if speed_range is None else speed_range.for_blade(each)
        for contact in (contacts or default_contacts(each)).values():
            check_work(each, contact, speeds, ke_max, here=url is None, every_lobe=True)
    answerer = answerer_from(url, models, policy.value)

    with progress_bar("screening") as progress:
        report = screen(
            chosen,
            contacts,
            answerer,
            speed_range=speed_range,
            ke_max=ke_max,
            ke_liner=ke_liner,
            map_shape=shape,
            policy=policy.value,
            progress=progress,
        )

    console = console_beside(json)
    console.print(ranking_table(report))
    console.print(
        "[dim]K_e: the smallest that destabilises, by the exact core at the tip of the deepest lobe; "
        "unstable, verified: share of the map that is unstable, and that the exact core answered; "
        f"model {report.model}, solver {report.solver}[/dim]"
    )
    if json:
        write_json(json, report.to_dict(), indent=True)
    if out:
        from service.screening.report_files import write_report

        for path in write_report(out, report):
            console.print(f"[dim]wrote {path}[/dim]")

"""`rubscreen assess`: what a rubbing expert asks of one blade."""

from __future__ import annotations

from typing import Annotated

import typer

from service.commands.options import (
    OUTPUT,
    ArcsOption,
    BladeArgument,
    EngagementOption,
    JsonOption,
    LinerOption,
    NodesOption,
    SpeedOption,
    WeightsOption,
)


def run(
    blade: BladeArgument,
    speed: SpeedOption = None,
    ke_liner: LinerOption = None,
    ke_max: Annotated[
        float | None,
        typer.Option(metavar="N/m", help="Largest K_e looked at; left out: 25,000.", show_default=False),
    ] = None,
    clearance: Annotated[
        float | None,
        typer.Option(metavar="mm", help="Cold clearance over the tip.", show_default=False),
    ] = None,
    point: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SPEED[=SHARE]",
            help="Operating point, e.g. 16000rpm=0.6 for 60 % of the running time; as often as needed.",
            show_default=False,
        ),
    ] = None,
    robust: Annotated[bool, typer.Option(help="Worst case of damping × 0.5 to 2, frequencies ± 3 %.")] = True,
    nodes: NodesOption = None,
    weights: WeightsOption = None,
    arcs: ArcsOption = None,
    engagement: EngagementOption = None,
    json: JsonOption = None,
    out: Annotated[
        str | None,
        typer.Option(
            "--out",
            metavar="FOLDER",
            help="Write assessment.json and its charts.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
) -> None:
    """Campbell diagram, modes and their lobes, edges, clearance, margins, worst case of uncertain data.

    Example: rubscreen assess nasa_rotor_37 --ke-liner 9000 --point 17189rpm=0.7 --out out/rotor37
    """
    from pathlib import Path

    from sdm_core.assessment import assess
    from sdm_core.validation import number
    from service.commands.assess_tables import edges_table, modes_table, said_of
    from service.commands.inputs import (
        CHORD,
        blade_from,
        check_work,
        contact_from,
        operating_points,
        speeds_from,
    )
    from service.commands.outputs import (
        check_writable,
        console_beside,
        progress_bar,
        write_bytes,
        write_json,
    )
    from service.screening.assessment_files import assessment_charts

    report = None if out is None else str(Path(out) / "assessment.json")
    check_writable(inputs=[blade], json=json, out=report)
    if clearance is not None:
        number("--clearance", clearance, 0.0, 1e3, "mm")
    chosen = blade_from(blade)
    contact = contact_from(nodes, weights, arcs, engagement, chosen)
    span = speeds_from(speed, chosen)
    points = operating_points(point or (), chosen)
    check_work(chosen, contact, span, ke_max or 2.5e4, here=True, every_lobe=True)
    with progress_bar(chosen.name) as show:
        found = assess(
            chosen,
            contact,
            span,
            ke_liner=ke_liner,
            ke_max=ke_max,
            cold_clearance_m=None if clearance is None else 1e-3 * clearance,
            points=points,
            robust=robust,
            progress=lambda what, done, total: show(done, total, what),
        )
    console = console_beside(json)
    console.print(modes_table(found))
    beside = edges_table(found)
    if beside is not None:
        console.print(beside)
    for line in said_of(found):
        console.print(line, highlight=False)
    if weights == CHORD:
        from sdm_core.contact_weights import chord_weights

        console.print(chord_weights(chosen).described(ke_liner or found.ke_max), highlight=False)
    if json:
        write_json(json, found.to_dict(), indent=True)
    if out is not None and report is not None:
        write_json(report, found.to_dict(), indent=True)
        for name, picture in assessment_charts(found).items():
            write_bytes("--out", Path(out) / name, picture)
        console.print(f"written to {out}")

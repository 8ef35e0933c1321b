"""`rubscreen simulate`: a blade cuts into its liner in time, at one rotor speed or at many."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from service.commands.options import (
    CONTACT,
    OUTPUT,
    BladeArgument,
    JsonOption,
    NodesOption,
    NpzOption,
)

LINER, CASING, METHOD = "Liner", "Casing", "Method"


def _option(flag: str, unit: str, text: str, panel: str) -> Any:
    return typer.Option(flag, metavar=unit, help=text, rich_help_panel=panel, show_default=False)


Number = float | None


def run(
    blade: BladeArgument,
    speed: Annotated[
        str | None,
        typer.Option(
            metavar="SPEED or LOW:HIGH",
            help="One rotor speed (250Hz, 15000rpm, 0.28ratio) for its response, or a range "
            "(0.05:0.33ratio) for wear and spectrum maps. Left out: the design speed.",
            show_default=False,
        ),
    ] = None,
    count: Annotated[
        int | None,
        typer.Option(
            "--speeds", metavar="N", help="How many speeds of a range. Left out: 200.", show_default=False
        ),
    ] = None,
    revolutions: Annotated[int, typer.Option(metavar="N", help="At each speed.")] = 50,
    nodes: NodesOption = None,
    friction: Annotated[
        Number, _option("--friction", "MU", "Coulomb friction of the tip; left out: none.", CONTACT)
    ] = None,
    rotation: Annotated[
        int | None,
        typer.Option(
            metavar="1|-1",
            help="With --friction, and needed then: 1 where the blade turns towards positive tangential, -1 "
            "where it turns the other way.",
            rich_help_panel=CONTACT,
            show_default=False,
        ),
    ] = None,
    ke_liner: Annotated[
        Number,
        _option(
            "--ke-liner", "N/m", "K_e with which each contact node cuts the liner. Left out: 10,000.", LINER
        ),
    ] = None,
    youngs_modulus: Annotated[Number, _option("--youngs-modulus", "Pa", "Left out: 1.8e9.", LINER)] = None,
    yield_stress: Annotated[Number, _option("--yield-stress", "Pa", "Left out: 15e6.", LINER)] = None,
    plastic_modulus: Annotated[
        Number, _option("--plastic-modulus", "Pa", "Instead of --ke-liner.", LINER)
    ] = None,
    thickness: Annotated[Number, _option("--thickness", "m", "Left out: 5e-3.", LINER)] = None,
    axial_width: Annotated[
        Number, _option("--axial-width", "m", "That a contact node rubs. Left out: 3.4e-3.", LINER)
    ] = None,
    contact_length: Annotated[
        Number,
        _option("--contact-length", "m", "Along the circumference (tip thickness). Left out: 1e-3.", LINER),
    ] = None,
    clearance: Annotated[
        str | None,
        _option("--clearance", "m[,m...]", "One number or one a contact node. Left out: 1e-4.", CASING),
    ] = None,
    ovalisation: Annotated[
        Number, _option("--ovalisation", "m", "Amplitude; 0 for a round casing. Left out: 2e-4.", CASING)
    ] = None,
    lobes: Annotated[int | None, _option("--lobes", "M", "Of the ovalisation. Left out: 2.", CASING)] = None,
    growing: Annotated[
        Number,
        _option("--ovalisation-revolutions", "N", "Over which it grows. Left out: 5.", CASING),
    ] = None,
    feed: Annotated[
        Number, _option("--feed", "m", "What the casing closes in by each revolution. Left out: 0.", CASING)
    ] = None,
    radius: Annotated[
        Number, _option("--radius", "m", "Of the casing. Left out: the blade's tip radius.", CASING)
    ] = None,
    cells: Annotated[
        int, typer.Option(metavar="N", help="Angular cells of the casing.", rich_help_panel=METHOD)
    ] = 8000,
    threads: Annotated[int | None, _option("--threads", "N", "Left out: one a core.", METHOD)] = None,
    json: JsonOption = None,
    npz: NpzOption = None,
    png: Annotated[
        str | None,
        typer.Option(
            "--png",
            metavar="FOLDER",
            help="Write charts into it: response.png and worn_profile.png of one speed; wear_map.png "
            "(one a contact node) and spectrum_map.png of a range.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
) -> None:
    """Integrate a blade's rub in time: what the tip does, what is left of the liner.

    A liner worn through ends the simulation of that speed; of a single one with status 1.

    Examples: rubscreen simulate nasa_rotor_37 --speed 250Hz --png out/250;
    rubscreen simulate nasa_rotor_37 --speed 0.1:0.33ratio --speeds 200 --npz maps.npz --png out/maps
    """
    from service.commands.inputs import blade_from
    from service.commands.outputs import (
        check_writable,
        console_beside,
        progress_bar,
        write_bytes,
        write_json,
    )
    from service.commands.simulation_inputs import casing_from, friction_from, liner_from, named, order_from
    from service.commands.simulation_tables import simulation_lines
    from service.simulation.charts import chart_files, chart_names

    chosen = blade_from(blade)
    liner = liner_from(
        ke=ke_liner,
        youngs_modulus_pa=youngs_modulus,
        yield_stress_pa=yield_stress,
        plastic_modulus_pa=plastic_modulus,
        thickness_m=thickness,
        axial_width_m=axial_width,
        contact_length_m=contact_length,
    )
    casing = casing_from(
        clearance,
        ovalisation_m=ovalisation,
        lobes=lobes,
        ovalisation_revolutions=growing,
        feed_per_revolution_m=feed,
        radius_m=radius,
    )
    with named():
        rubbed = friction_from(friction, rotation)
        order = order_from(chosen, speed, count, nodes, revolutions, liner, casing, rubbed, cells)
    charts = {} if png is None else {name: f"{png}/{name}" for name in chart_names(order)}
    check_writable(inputs=[blade], json=json, npz=npz)
    for path in charts.values():
        check_writable(inputs=[blade], png=path)

    from service.simulation.outcome import simulated

    with named(), progress_bar("simulating") as progress:
        what = "revolutions" if order.single else "speeds"
        outcome = simulated(order, threads, lambda done, of: progress(done, of, what))
    console = console_beside(json)
    for line in simulation_lines(outcome):
        console.print(line)
    if json:
        write_json(json, outcome.to_dict())
    if npz:
        write_bytes("--npz", npz, outcome.to_npz())
    for name, content in chart_files(outcome) if png is not None else ():
        write_bytes("--png", charts[name], content)
    if order.single and outcome.speeds.worn_through[0]:
        raise typer.Exit(1)

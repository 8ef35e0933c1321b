"""`rubscreen blade`: blade files made from profiles or other programs' matrices, checked and shown."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from service.commands.options import (
    OUTPUT,
    BladeArgument,
    JsonOption,
    KeMaxOption,
    NodesOption,
    SpeedOption,
    WeightsOption,
)

app = typer.Typer(
    no_args_is_help=True,
    help="Make blade files from profiles or from what other programs export; check and show them.",
)

ProfileArgument = Annotated[
    str, typer.Argument(metavar="PROFILE", help="Profile file (rubscreen/profile/1, JSON).")
]
OutOption = Annotated[
    str | None,
    typer.Option(
        "--out",
        "-o",
        metavar="FILE",
        help="Blade file to write; left out: the input's name with .blade.json.",
        rich_help_panel=OUTPUT,
        show_default=False,
    ),
]


@app.command()
def build(
    profile: ProfileArgument,
    out: OutOption = None,
    reduced: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="Reduced model to write too: .npz, .mat, .op4, .mtx, ... by its ending.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    deck: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="CalculiX/Abaqus input deck of the same mesh at the design speed, for a second opinion.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    verify: Annotated[
        bool, typer.Option(help="Compare the reduced with the full model between its speeds.")
    ] = True,
) -> None:
    """Mesh a profile, spin it up, reduce it, and write its blade file.

    Example: rubscreen blade build fan.json --reduced fan.npz
    """
    from sdm_core.blade import write_blade
    from sdm_core.blade.build import build_blade
    from sdm_core.blade.profile import read_profile
    from service.commands.blade_tables import about_blade, about_build, modes_table
    from service.commands.outputs import check_writable, progress_bar, terminal, write_bytes

    target = out or str(Path(profile).with_suffix("")) + ".blade.json"
    check_writable(inputs=[profile], out=target, reduced=reduced, deck=deck)
    chosen = read_profile(profile)
    with progress_bar(chosen.name) as show:
        made = build_blade(
            chosen, verify=verify, progress=lambda done, what: show(round(100 * done), 100, what)
        )
    write_blade(made.blade, target)
    if reduced is not None:
        from sdm_core.blade.exchange import write_model

        write_model(made.reduced, reduced)
    if deck is not None:
        from sdm_core.blade.build import solid_model
        from sdm_core.blade.finite_elements.calculix_deck import calculix_deck

        text = calculix_deck(solid_model(chosen), chosen.design_speed_hz, chosen.modes)
        write_bytes("--deck", deck, text.encode())
    console = terminal()
    console.print(modes_table(made.blade))
    for line in (*about_blade(made.blade), *about_build(made)):
        console.print(line)
    console.print(f"written to {target}")


@app.command()
def show(blade: BladeArgument, json: JsonOption = None) -> None:
    """Frequencies, tip amplitudes and what else a blade file knows.

    Example: rubscreen blade show nasa_rotor_37
    """
    from sdm_core.blade import blade_to_dict
    from service.commands.blade_tables import about_blade, modes_table
    from service.commands.inputs import blade_from
    from service.commands.outputs import check_writable, console_beside, write_json

    check_writable(inputs=[blade], json=json)
    chosen = blade_from(blade)
    console = console_beside(json)
    console.print(modes_table(chosen))
    for line in about_blade(chosen):
        console.print(line)
    if json:
        write_json(json, blade_to_dict(chosen), indent=True)


@app.command()
def sensitivities(
    profile: ProfileArgument,
    speed: SpeedOption = None,
    ke_max: KeMaxOption = 2.5e4,
    nodes: NodesOption = None,
    weights: WeightsOption = None,
    json: JsonOption = None,
) -> None:
    """How lean, sweep, stagger, thickness and chord move the least critical K_e.

    The blade is built four times for each, its deepest lobe followed. Example:
    rubscreen blade sensitivities fan.json --nodes LE,TE
    """
    from sdm_core.assessment import shape_sensitivities
    from sdm_core.assessment.plain_data import plain
    from sdm_core.blade.build import build_blade
    from sdm_core.blade.profile import read_profile
    from sdm_core.blade.profile.shape_change import STEPS, ShapeChange
    from service.commands.assess_tables import sensitivities_table
    from service.commands.inputs import contact_from, speeds_from
    from service.commands.outputs import check_writable, console_beside, progress_bar, write_json

    check_writable(inputs=[profile], json=json)
    chosen = read_profile(profile)
    with progress_bar(chosen.name) as show:
        show(0, 1, "nominal blade")
        nominal = build_blade(chosen).blade
        span = speeds_from(speed, nominal)
        found = shape_sensitivities(
            lambda values: (
                build_blade(ShapeChange.from_mapping(values).of_profile(chosen), verify=False).blade
            ),
            ShapeChange.nominal(),
            STEPS,
            contact_from(nodes, weights, None, None, nominal),
            span,
            ke_max,
            progress=lambda done, total: show(done, total, "blades built"),
        )
    console = console_beside(json)
    console.print(sensitivities_table(found))
    if found.tip is not None and any(abs(found.speed_hz / end - 1) < 1e-6 for end in span):
        console.print("at an end of the range of speeds, where frequencies move the flank of the lobe too")
    if json:
        write_json(json, plain(found), indent=True)

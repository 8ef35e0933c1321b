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
FilesArgument = Annotated[
    list[str],
    typer.Argument(metavar="FILES...", help="One or more files; SPEED_HZ=FILE for modal data at speeds."),
]
FormatOption = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Format, where the ending does not say.", show_default=False),
]
ModalOption = Annotated[
    bool | None,
    typer.Option(
        "--modal/--matrices", help="What the files hold, where it cannot be told.", show_default=False
    ),
]
StiffnessOption = Annotated[
    str | None,
    typer.Option(
        metavar="K|0=K0,200=K1", help="Name of the stiffness, or one a rotor speed.", show_default=False
    ),
]
MassOption = Annotated[str | None, typer.Option(metavar="M", help="Name of the mass.", show_default=False)]
UnitsOption = Annotated[str, typer.Option(metavar="SI|mm-t-s", help="Of the files; never guessed.")]
AxisOption = Annotated[
    str | None, typer.Option(metavar="X,Y,Z", help="Rotation axis, through the origin.", show_default=False)
]
NormalisedOption = Annotated[
    bool, typer.Option("--mass-normalised", help="Modes without modal masses are mass-normalised.")
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


@app.command("import")
def import_(
    files: FilesArgument,
    out: OutOption = None,
    tip: Annotated[
        str | None,
        typer.Option(
            metavar="101,105,...", help="Contact nodes, leading to trailing edge.", show_default=False
        ),
    ] = None,
    names: Annotated[
        str | None,
        typer.Option(metavar="LE,MID,TE", help="Their names; left out: LE, N2, ... TE.", show_default=False),
    ] = None,
    direction: Annotated[
        str,
        typer.Option(
            metavar="casing_normal|radial|R,T,A",
            help="Contact direction, or its radial, tangential, axial parts.",
        ),
    ] = "casing_normal",
    casing_slope: Annotated[
        float | None,
        typer.Option(metavar="dr/dz", help="Of the casing; left out: of the tip.", show_default=False),
    ] = None,
    damping: Annotated[
        float | None, typer.Option(metavar="RATIO", help="Modal damping ratio.", show_default=False)
    ] = None,
    modes: Annotated[int, typer.Option(metavar="N", help="Modes to keep, of matrices.")] = 5,
    design_speed: Annotated[
        float | None, typer.Option(metavar="Hz", help="Design speed.", show_default=False)
    ] = None,
    name: Annotated[
        str | None, typer.Option(metavar="TEXT", help="Of the blade.", show_default=False)
    ] = None,
    format: FormatOption = None,
    modal: ModalOption = None,
    stiffness: StiffnessOption = None,
    mass: MassOption = None,
    units: UnitsOption = "SI",
    axis: AxisOption = None,
    mass_normalised: NormalisedOption = False,
) -> None:
    """A blade file from another program's matrices or modal data.

    Nastran OP4 and DMIG, universal files (55), MATLAB, Matrix Market, CalculiX matrix storage, CSV, npz.
    Companion tables say what a format has no place for: node,component and node,x_m,y_m,z_m. Examples:
    rubscreen blade import job.sti job.inp --tip 101,105,109 --damping 1e-3;
    rubscreen blade import 0=rest.uff 250=fast.uff --damping 1e-3
    """
    from sdm_core.blade import write_blade
    from service.commands.blade_import import ImportChoices, imported
    from service.commands.blade_tables import about_blade, modes_table
    from service.commands.outputs import check_writable, terminal

    first = files[0].partition("=")[2] or files[0]
    target = out or str(Path(first).with_suffix("")) + ".blade.json"
    check_writable(inputs=[text.partition("=")[2] or text for text in files], out=target)
    choices = ImportChoices(
        format, modal, stiffness, mass, units, axis, tip, names, direction, casing_slope, modes, damping,
        design_speed, name, mass_normalised,
    )  # fmt: skip
    found = imported(files, choices, blade_wanted=True)
    assert found.blade is not None
    write_blade(found.blade, target)
    console = terminal()
    console.print(modes_table(found.blade))
    for line in (*about_blade(found.blade), *found.findings.lines()):
        console.print(line, highlight=False)
    console.print(f"written to {target}")


@app.command()
def check(
    files: FilesArgument,
    tip: Annotated[
        str | None, typer.Option(metavar="101,105,...", help="Contact nodes.", show_default=False)
    ] = None,
    format: FormatOption = None,
    modal: ModalOption = None,
    stiffness: StiffnessOption = None,
    mass: MassOption = None,
    units: UnitsOption = "SI",
    axis: AxisOption = None,
    mass_normalised: NormalisedOption = False,
    damping: Annotated[
        float | None, typer.Option(metavar="RATIO", help="Of modal data without.", show_default=False)
    ] = None,
) -> None:
    """Check a blade file, matrices or modal data, and say what was found; exit code 1 with warnings.

    Example: rubscreen blade check my_blade.json
    """
    from service.commands.blade_import import ImportChoices, imported
    from service.commands.outputs import terminal

    choices = ImportChoices(
        format, modal, stiffness, mass, units, axis, tip, damping=damping, mass_normalised=mass_normalised
    )
    # Blade files stand each for itself; files of other programs belong together.
    alone = all(Path(text).suffix == ".json" or not Path(text).suffix for text in files)
    console, warnings = terminal(), 0
    for group in [[text] for text in files] if alone else [files]:
        if len(files) > len(group):
            console.print(f"{group[0]}:")
        found = imported(group, choices, blade_wanted=False)
        for line in found.findings.lines():
            console.print(line, highlight=False)
        warnings += len(found.findings.warnings)
    if warnings:
        console.print(f"{warnings} warnings")
        raise typer.Exit(1)
    console.print("nothing suspicious")


@app.command()
def export(
    blade: BladeArgument,
    out: Annotated[str, typer.Argument(metavar="FILE", help="npz, mat, uff, csv or json by its ending.")],
    format: FormatOption = None,
) -> None:
    """A blade file as npz, MATLAB, universal file or CSV.

    Example: rubscreen blade export nasa_rotor_37 rotor37.mat
    """
    from sdm_core.blade.exchange import export_blade
    from service.commands.inputs import blade_from
    from service.commands.outputs import check_writable, terminal

    check_writable(inputs=[blade], out=out)
    written = export_blade(blade_from(blade), out, format=format)
    console = terminal()
    for path in written.paths:
        console.print(f"written to {path}")
    for what in written.left_out:
        console.print(f"left out: {what}")
    if written.digits < 16:
        console.print(f"numbers keep {written.digits} digits in this format")


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

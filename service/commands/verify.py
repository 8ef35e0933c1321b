"""`rubscreen verify`: points of one blade's map, by the exact core, the surrogate and integration in time."""

from __future__ import annotations

from typing import Annotated

import typer

from service.commands.options import (
    ArcsOption,
    BladeArgument,
    EngagementOption,
    JsonOption,
    KeMaxOption,
    ModelsOption,
    NodesOption,
    PngOption,
    SpeedOption,
    WeightsOption,
)


def run(
    blade: BladeArgument,
    speed: SpeedOption = None,
    points: Annotated[
        int, typer.Option("--points", metavar="N", help="How many points, 4 to 1000.", min=4, max=1000)
    ] = 24,
    ke_max: KeMaxOption = 2.5e4,
    nodes: NodesOption = None,
    weights: WeightsOption = None,
    arcs: ArcsOption = None,
    engagement: EngagementOption = None,
    seed: Annotated[int, typer.Option(metavar="N", help="Of the choice of points.", min=0)] = 0,
    models: ModelsOption = None,
    json: JsonOption = None,
    png: PngOption = None,
) -> None:
    """Hold the exact core and the surrogate to an integration of the equation of motion in time.

    Points lie on both sides of the boundary, at lobe tips, at the lowest speeds and anywhere. Ends with
    status 1 where exact core and integration differ, or a served verdict is not the exact one.

    Example: rubscreen verify nasa_rotor_37 --nodes LE --png verified.png
    """
    from sdm_core.lobe_tips import lobe_grid
    from service.commands.inputs import (
        answerer_from,
        blade_from,
        check_stiffnesses,
        check_work,
        contact_from,
        speeds_from,
    )
    from service.commands.outputs import (
        check_writable,
        console_beside,
        progress_bar,
        write_bytes,
        write_json,
    )
    from service.commands.tables import verification_table
    from service.screening.charts import described
    from service.screening.sweep import cut_off, searched, through_tips
    from service.speeds import evenly_spaced
    from service.verification.comparison import compared
    from service.verification.points import chosen_points

    check_writable(inputs=[blade], json=json, png=png)
    chosen = blade_from(blade)
    contact = contact_from(nodes, weights, arcs, engagement, chosen)
    low, high = speeds_from(speed, chosen)
    check_stiffnesses(ke_max, None)
    check_work(chosen, contact, (low, high), ke_max, here=True, every_lobe=True)
    even = evenly_spaced(low, high, 64)
    grid = lobe_grid(chosen, contact, even, ke_max) if contact.permanent else even
    answerer = answerer_from(None, models, "auto")
    with progress_bar("exact boundary") as progress:
        wide, tips = searched(answerer, chosen, contact, grid, ke_max, "exact", progress)
    boundary = cut_off(wide, ke_max)
    with progress_bar("integrating in time") as progress:
        found = compared(
            answerer, chosen, contact, chosen_points(boundary, tips, ke_max, points, seed), progress
        )

    console = console_beside(json)
    console.print(verification_table(f"{chosen.name}: {described(contact)}", found))
    agree, wrong = sum(v.agrees for v in found), sum(v.served_wrongly for v in found)
    largest = max((v.radius_difference for v in found if v.witness is not None), default=float("nan"))
    console.print(
        f"exact core and integration agree on {agree} of {len(found)} points, |μ| to {largest:.1e}; "
        f"policy auto answers {len(found) - wrong} of {len(found)} as the exact core does"
    )
    for v in found:
        if v.unanswered:
            console.print(f"not integrated at {v.point.speed_hz:.3f} Hz: {v.unanswered}")
    if json:
        head = {"blade": chosen.name, "contact": contact.to_dict(), "ke_max": ke_max, "seed": seed}
        write_json(json, {**head, "points": [v.to_dict() for v in found]})
    if png:
        from service.verification.picture import verification_png

        line = through_tips(answerer, chosen, contact, wide, tips)
        write_bytes("--png", png, verification_png(chosen, described(contact), line, ke_max, found))
    if agree < len(found) or wrong:
        raise typer.Exit(1)

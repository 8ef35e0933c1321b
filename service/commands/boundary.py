"""`rubscreen boundary`: from which K_e on one blade is unstable, speed by speed."""

from __future__ import annotations

from typing import Annotated

import typer

from service.commands.options import (
    AlphaOption,
    ArcsOption,
    BladeArgument,
    EngagementOption,
    JsonOption,
    KeMaxOption,
    LinerOption,
    ModelsOption,
    NodesOption,
    PngOption,
    Policy,
    PolicyOption,
    SpeedOption,
    UrlOption,
    WeightsOption,
)


def run(
    blade: BladeArgument,
    speed: SpeedOption = None,
    count: Annotated[
        int | None,
        typer.Option(
            "--speeds",
            metavar="N",
            help="How many speeds, evenly spaced. Left out: 8 on every lobe.",
            show_default=False,
        ),
    ] = None,
    ke_max: KeMaxOption = 2.5e4,
    ke_liner: LinerOption = None,
    nodes: NodesOption = None,
    weights: WeightsOption = None,
    arcs: ArcsOption = None,
    engagement: EngagementOption = None,
    policy: PolicyOption = Policy.auto,
    alpha: AlphaOption = None,
    url: UrlOption = None,
    models: ModelsOption = None,
    json: JsonOption = None,
    png: PngOption = None,
) -> None:
    """First crossing in K_e at each speed, and the tips of the deepest lobes by the exact core.

    Example: rubscreen boundary nasa_rotor_37 --nodes TE --speed 0.1:0.3ratio --json -
    """
    from dataclasses import asdict

    from sdm_core.lobe_tips import lobe_grid
    from service.commands.inputs import (
        answerer_from,
        blade_from,
        check_stiffnesses,
        check_work,
        contact_from,
        speed_count,
        speeds_from,
    )
    from service.commands.outputs import (
        check_writable,
        console_beside,
        progress_bar,
        write_bytes,
        write_json,
    )
    from service.commands.tables import critical_speeds_table, under
    from service.rest.replies import boundary_to_dict
    from service.screening.sweep import cut_off, searched, through_tips
    from service.speeds import evenly_spaced

    check_writable(inputs=[blade], json=json, png=png)
    chosen = blade_from(blade)
    contact = contact_from(nodes, weights, arcs, engagement, chosen)
    low, high = speeds_from(speed, chosen)
    check_stiffnesses(ke_max, ke_liner)
    even = evenly_spaced(low, high, 200 if count is None else speed_count(count))
    check_work(chosen, contact, (low, high), ke_max, here=url is None, every_lobe=count is None)
    grid = lobe_grid(chosen, contact, even, ke_max) if count is None else even
    answerer = answerer_from(url, models, policy.value)

    with progress_bar("boundary") as progress:
        wide, tips = searched(answerer, chosen, contact, grid, ke_max, policy.value, progress, alpha)
    answers = cut_off(wide, ke_max)

    console = console_beside(json)
    if tips:
        console.print(
            critical_speeds_table(f"{chosen.name}: tips of the deepest lobes, by the exact core", tips)
        )
    else:
        console.print(f"{chosen.name}: none below {ke_max:g} N/m from {low:.4g} to {high:.4g} Hz")
    console.print(
        f"[dim]{len(grid)} speeds, {answers.exact_share:.1%} answered by the exact core, "
        f"model {answers.model}{under(answers.certificate)}, solver {answers.solver}[/dim]"
    )
    if json:
        head = {"blade": chosen.name, "contact": contact.to_dict(), "ke_max": ke_max, "speed_hz": grid}
        tail = {"critical_speeds": [asdict(tip) for tip in tips]}
        write_json(json, {**head, **boundary_to_dict(answers), **tail})
    if png:
        from service.screening.charts import boundaries_png, described

        line = through_tips(answerer, chosen, contact, wide, tips)
        chart = boundaries_png(chosen, {described(contact): line}, ke_max=ke_max, ke_liner=ke_liner)
        write_bytes("--png", png, chart)

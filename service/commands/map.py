"""`rubscreen map`: where in the plane of speed and K_e one blade is stable."""

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
    NpzOption,
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
    ke_max: KeMaxOption = 2.5e4,
    ke_liner: LinerOption = None,
    grid: Annotated[
        str | None,
        typer.Option(
            metavar="SPEEDSxSTIFFNESSES",
            help="Points of the map. Left out: 200x200, or 50x50 with an engagement, "
            "which the exact core answers.",
            show_default=False,
        ),
    ] = None,
    nodes: NodesOption = None,
    weights: WeightsOption = None,
    arcs: ArcsOption = None,
    engagement: EngagementOption = None,
    policy: PolicyOption = Policy.auto,
    alpha: AlphaOption = None,
    url: UrlOption = None,
    models: ModelsOption = None,
    json: JsonOption = None,
    npz: NpzOption = None,
    png: PngOption = None,
) -> None:
    """Stability map of one blade over speed and cutting stiffness K_e.

    Example: rubscreen map nasa_rotor_37 --nodes LE --png map.png
    """
    import time

    import numpy as np

    from service.commands.inputs import (
        answerer_from,
        blade_from,
        check_stiffnesses,
        check_work,
        contact_from,
        grid_from,
        speeds_from,
    )
    from service.commands.outputs import (
        check_writable,
        console_beside,
        write_bytes,
        write_json,
    )
    from service.commands.tables import under
    from service.rest.replies import map_to_dict, map_to_npz
    from service.speeds import evenly_spaced

    check_writable(inputs=[blade], json=json, npz=npz, png=png)
    chosen = blade_from(blade)
    contact = contact_from(nodes, weights, arcs, engagement, chosen)
    low, high = speeds_from(speed, chosen)
    shape = grid_from(grid or ("50x50" if contact.smooth else "200x200"))
    check_stiffnesses(ke_max, ke_liner)
    lined = png is not None and contact.permanent
    check_work(chosen, contact, (low, high), ke_max, here=url is None, every_lobe=lined)
    answerer = answerer_from(url, models, policy.value)

    began = time.perf_counter()
    grid_hz, grid_ke = evenly_spaced(low, high, shape[0]), np.linspace(0.0, ke_max, shape[1])
    answers = answerer.map(chosen, contact, grid_hz, grid_ke, policy.value, alpha=alpha)
    seconds = time.perf_counter() - began

    console = console_beside(json)
    console.print(
        f"{chosen.name}: {answers.stable.size:,} points in {seconds:.2f} s, "
        f"{answers.unstable_share:.1%} unstable, {answers.exact_share:.1%} answered by the exact core"
    )
    console.print(
        f"[dim]model {answers.model}{under(answers.certificate)}, solver {answers.solver}, "
        f"{low:.4g} to {high:.4g} Hz[/dim]"
    )
    if json:
        write_json(json, {"blade": chosen.name, "contact": contact.to_dict(), **map_to_dict(answers)})
    if npz:
        write_bytes("--npz", npz, map_to_npz(answers))
    if png:
        from sdm_core.lobe_tips import SEARCH_MARGIN, lobe_grid
        from sdm_core.validation import KE_LIMIT
        from service.screening.charts import map_png

        # With arcs an exact line takes minutes, and the map is exact anyway.
        line = None
        if contact.permanent:
            drawn_by = "surrogate" if policy is Policy.surrogate else "exact"
            fine_hz = lobe_grid(chosen, contact, answers.speed_hz, ke_max)
            line = answerer.boundary(
                chosen, contact, fine_hz, min(SEARCH_MARGIN * ke_max, KE_LIMIT), drawn_by
            )
        write_bytes("--png", png, map_png(chosen, contact, answers, line, ke_liner=ke_liner))

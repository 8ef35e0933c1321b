"""`rubscreen sensitivities`: what moves the critical K_e of one blade at a rotor speed."""

from __future__ import annotations

from typing import Annotated

import typer

from service.commands.options import (
    AlphaOption,
    ArcsOption,
    BladeArgument,
    JsonOption,
    KeMaxOption,
    ModelsOption,
    NodesOption,
    Policy,
    PolicyOption,
    UrlOption,
    WeightsOption,
)


def run(
    blade: BladeArgument,
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SPEED",
            help="Rotor speed in Hz, rpm or ratio, e.g. 16000rpm; may be repeated. Left out: design speed.",
            show_default=False,
        ),
    ] = None,
    ke_max: KeMaxOption = 2.5e4,
    nodes: NodesOption = None,
    weights: WeightsOption = None,
    arcs: ArcsOption = None,
    policy: PolicyOption = Policy.auto,
    alpha: AlphaOption = None,
    url: UrlOption = None,
    models: ModelsOption = None,
    json: JsonOption = None,
) -> None:
    """What moves the critical K_e at a rotor speed: frequencies, damping, amplitudes, weights, arcs.

    The ten parameters that move it most; --json has all. Example:
    rubscreen sensitivities nasa_rotor_37 --at 14460rpm
    """
    import numpy as np

    from service.commands.inputs import (
        answerer_from,
        blade_from,
        check_stiffnesses,
        check_work,
        contact_from,
        speeds_at,
    )
    from service.commands.outputs import check_writable, console_beside, write_json
    from service.commands.tables import influences_table, under
    from service.rest.replies import sensitivities_to_dict

    check_writable(inputs=[blade], json=json)
    chosen = blade_from(blade)
    contact = contact_from(nodes, weights, arcs, None, chosen)
    speed = np.array(speeds_at(at or [], chosen))
    check_stiffnesses(ke_max, None)
    span = (float(speed.min()), float(speed.max()))
    check_work(chosen, contact, span, ke_max, here=url is None, every_lobe=False, option="--at")
    answerer = answerer_from(url, models, policy.value)
    found = answerer.sensitivities(chosen, contact, speed, ke_max, policy.value, alpha)

    console = console_beside(json)
    for i, hertz in enumerate(found.speed_hz):
        where = f"{chosen.name} at {hertz:.4g} Hz ({60 * hertz:,.0f} rpm)"
        if np.isnan(found.critical_ke[i]):
            console.print(f"{where}: none below {ke_max:g} N/m")
            continue
        influences = found.influences(i)
        if influences is None:
            console.print(f"{where}: K_e {found.critical_ke[i]:,.1f} N/m, which has no derivatives there")
            continue
        title = f"{where}: K_e {found.critical_ke[i]:,.1f} N/m, {found.source[i]} ({found.reason[i]})"
        console.print(influences_table(title, influences))
    console.print(f"[dim]model {found.model}{under(found.certificate)}, solver {found.solver}[/dim]")
    if json:
        head = {"blade": chosen.name, "contact": contact.to_dict(), "ke_max": ke_max, "speed_hz": speed}
        write_json(json, {**head, **sensitivities_to_dict(found)})

"""`rubscreen demo`: the whole path once, from service to ranking."""

from __future__ import annotations

from typing import Annotated

import typer


def run(
    out: Annotated[
        str, typer.Option(metavar="FOLDER", help="Where report.json and the charts go.")
    ] = "out/demo",
    grid: Annotated[str, typer.Option(metavar="SPEEDSxSTIFFNESSES", help="Points of each map.")] = "200x200",
    ke_liner: Annotated[
        float, typer.Option(metavar="N/m", help="K_e of the liner to judge against.")
    ] = 9000.0,
) -> None:
    """Start the service, screen two real blades through it, write charts, and stop it."""
    from service.commands.inputs import check_stiffnesses, grid_from
    from service.commands.outputs import check_writable
    from service.demo import demonstrate
    from service.screening.screen import KE_MAX

    check_writable(out=f"{out}/report.json")
    check_stiffnesses(KE_MAX, ke_liner)
    demonstrate(out, map_shape=grid_from(grid), ke_liner=ke_liner)

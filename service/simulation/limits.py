"""What is too much to simulate."""

from __future__ import annotations

import numpy as np

from sdm_core.lobe_tips import lobe_grid
from service.settings import Settings
from service.simulation.order import SimulationOrder
from service.sizes import TooLarge, check_reach


def check_reachable(order: SimulationOrder, settings: Settings) -> None:
    """Refuse blades and speeds of which the exact core cannot be asked, and what memory does not hold.

    Raises
    ------
    TooLarge, TooMuchWork, OutOfSpeedRange
        Naming the field.
    """
    speed = np.array(order.speed_hz)
    check_reach(order.blade, order.contact, speed, "liner.ke", order.ke, settings)
    if not order.single:
        lobe_grid(order.blade, order.contact, speed, order.ke)
    most = settings.max_simulation_values
    if order.kept_values > most:
        found = f"{order.revolutions}, {order.kept_values} numbers to keep of one speed"
        remedy = f"give at most {order.revolutions * most // order.kept_values} (max_simulation_values)"
        raise TooLarge("revolutions", found, remedy)


def check_size(order: SimulationOrder, settings: Settings) -> None:
    """Refuse more than the service simulates in one job.

    Raises
    ------
    TooLarge
        Naming the field, its value and the remedy.
    """
    if order.revolutions > settings.max_simulation_revolutions:
        remedy = f"give at most {settings.max_simulation_revolutions}"
        raise TooLarge("revolutions", order.revolutions, remedy)
    steps, most = order.steps, settings.max_simulation_steps
    if steps > most:
        remedy = f"give at most {most}: fewer speeds, revolutions or cells, or several simulations"
        raise TooLarge("speeds x revolutions x cells x steps a cell", steps, remedy)

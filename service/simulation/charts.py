"""The charts of a simulation, by the names of their files."""

from __future__ import annotations

from collections.abc import Iterator

from service.simulation.order import SimulationOrder
from service.simulation.outcome import SimulationOutcome

RESPONSE, WORN_PROFILE, WEAR_MAP, SPECTRUM_MAP = (
    "response.png",
    "worn_profile.png",
    "wear_map.png",
    "spectrum_map.png",
)


def chart_names(order: SimulationOrder) -> list[str]:
    """Those that an order has: of one speed the response, of many the maps, one wear map a contact node."""
    if order.single:
        return [RESPONSE, WORN_PROFILE]
    if len(order.nodes) == 1:
        return [WEAR_MAP, SPECTRUM_MAP]
    return [*(f"wear_map_{i + 1}.png" for i in range(len(order.nodes))), SPECTRUM_MAP]


def chart_files(outcome: SimulationOutcome) -> Iterator[tuple[str, bytes]]:
    """(name, PNG) of each of them."""
    from service.simulation.response_chart import response_png
    from service.simulation.spectrum_map_chart import spectrum_map_png
    from service.simulation.wear_map_chart import wear_map_png
    from service.simulation.worn_profile_chart import worn_profile_png

    names = chart_names(outcome.order)
    if outcome.order.single:
        yield names[0], response_png(outcome)
        yield names[1], worn_profile_png(outcome)
        return
    for name, node in zip(names, outcome.order.nodes, strict=False):
        yield name, wear_map_png(outcome, node)
    yield names[-1], spectrum_map_png(outcome)

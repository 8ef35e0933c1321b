"""What stands over the charts of a simulation."""

from __future__ import annotations

from service.simulation.order import SimulationOrder
from service.simulation.outcome import SimulationOutcome

UNSTABLE = "#c8501e"
"""Of what the exact core calls unstable, on every chart of a simulation."""


def heading(outcome: SimulationOutcome) -> str:
    """Blade, speed and contact of one speed, and the exact core's verdict."""
    order, found = outcome.order, outcome.speeds
    speed = order.speed_hz[0]
    ratio = speed / order.blade.first_frequency_hz
    verdict = {0.0: "unstable", 1.0: "stable"}.get(float(found.stable[0]), "not decided")
    growth, chatter = found.growth_per_revolution[0], found.chatter_hz[0]
    return (
        f"{order.blade.name} at {speed:.5g} Hz (Ω/f₁ = {ratio:.3f}): {touching(order)}\n"
        f"permanent contact by the exact core: {verdict}, ln|μ| = {growth:+.2g} a revolution, "
        f"at {chatter:,.0f} Hz = {chatter / speed:.1f} Ω"
    )


def touching(order: SimulationOrder) -> str:
    """Where it touches, how stiffly it cuts, and for how long."""
    where = " and ".join(order.nodes) if len(order.nodes) < 4 else f"{len(order.nodes)} nodes"
    return f"contact at {where}, $K_e$ = {order.ke:,.0f} N/m, {order.revolutions} revolutions"

"""What `rubscreen simulate` says on the terminal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.table import Table

from sdm_core.time_domain.liner.speed_sweep import SPECTRUM_REVOLUTIONS
from service.simulation.order import SimulationOrder
from service.simulation.outcome import SimulationOutcome
from service.simulation.response import Response

_NOTICED = 0.1  # of the damping ratio: what the length of the cells may add to it unsaid


def simulation_lines(outcome: SimulationOutcome) -> Iterator[str | Table]:
    """A table of one speed, a few lines on many; then what was taken for liner and casing, and warnings."""
    order, found = outcome.order, outcome.speeds
    if outcome.response is not None:
        yield _of_one(outcome, outcome.response)
    else:
        yield from _of_many(outcome)
    yield f"[dim]{taken(order)}[/dim]"
    if found.worn_through.any():
        thickness = order.liner.thickness_m * 1e3
        where = ", ".join(f"{hz:.5g}" for hz in found.speed_hz[found.worn_through][:8])
        yield f"the liner of {thickness:g} mm was worn through, and the simulation stopped, at {where} Hz"
    share = float((found.cell_damping_ratio / np.maximum(order.blade.damping_ratio, 1e-12)).max())
    if share > _NOTICED:
        yield (
            f"cells this long add up to {share:.0%} to the damping of a mode in kept contact: "
            "more --cells make it less"
        )


def taken(order: SimulationOrder) -> str:
    """Liner and casing, those constants too that were not given."""
    liner, casing, radius = order.rub.liner, order.casing, order.casing.radius_round(order.blade)
    clearance = np.atleast_1d(casing.clearance_m) * 1e6
    oval = (
        "round"
        if casing.ovalisation_m == 0
        else f"pressed oval by {casing.ovalisation_m * 1e6:g} µm ({casing.lobes} lobes, within "
        f"{casing.ovalisation_revolutions:g} revolutions)"
    )
    moduli = (liner.youngs_modulus_pa, liner.yield_stress_pa, liner.plastic_modulus_pa)
    young, stress, plastic = (f"{pascals / 1e6:.4g} MPa" for pascals in moduli)
    rubbed = f"{order.liner.axial_width_m * 1e3:g} × {order.liner.contact_length_m * 1e3:g} mm"
    friction, rubbing = order.friction, "none"
    if friction is not None:
        towards = "towards" if friction.rotation == 1 else "against"
        rubbing = f"{friction.coefficient:g}, turning {towards} positive tangential"
    return (
        f"liner: K_e {order.ke:,.0f} N/m, {liner.thickness_m * 1e3:g} mm thick, rubbed {rubbed} a node "
        f"(E {young}, yield stress {stress}, plastic modulus {plastic}); "
        f"casing: radius {radius:.4g} m, {oval}, clearance {', '.join(f'{c:g}' for c in clearance)} µm, "
        f"feed {casing.feed_per_revolution_m * 1e6:g} µm a revolution; "
        f"friction {rubbing}; damping of the blade file; {order.cells} cells"
    )


def _of_one(outcome: SimulationOutcome, response: Response) -> Table:
    order, found = outcome.order, outcome.speeds
    speed = order.speed_hz[0]
    ratio = speed / order.blade.first_frequency_hz
    table = Table(
        title=f"{order.blade.name}, {', '.join(order.nodes)} at {speed:.5g} Hz ({speed * 60:,.0f} rpm, "
        f"ratio {ratio:.3f}), {response.revolutions} revolutions",
        show_header=False,
    )
    table.add_column()
    table.add_column()
    at = int(found.peak_m[0].argmax())
    table.add_row(
        "peak tip displacement", f"{found.peak_m[0, at] * 1e6:,.1f} µm at {order.blade.tip_nodes[at]}"
    )
    for j, node in enumerate(order.nodes):
        count, oval = int(found.lobes[0, j]), order.casing.lobes if order.casing.ovalisation_m else 0
        multiple = f", a multiple of the casing's {oval}" if oval and count and count % oval == 0 else ""
        table.add_row(
            f"worn under {node}",
            f"{found.worn_m[0, j].max() * 1e6:,.1f} µm at most; {count} wear lobes, "
            f"±{found.lobe_amplitude_m[0, j] * 1e6:,.2f} µm{multiple}",
        )
    table.add_row("removed", f"{response_volume(outcome) * 1e9:,.4g} mm³")
    table.add_row("largest contact force", f"{found.force_peak_n[0].max():,.1f} N")
    last = min(response.revolutions, SPECTRUM_REVOLUTIONS)
    strongest = order.frequency_hz[found.spectrum_m[0].argmax()]
    table.add_row(
        "strongest frequency", f"{strongest:,.1f} Hz = {strongest / speed:.2f} Ω, last {last} revolutions"
    )
    account = {name: value * 1e3 for name, value in response.account().items()}
    table.add_row(
        "energy account",
        f"{account['work_of_contact_j']:,.4g} mJ by contact, {account['work_of_damping_j']:,.4g} by damping, "
        f"{account['work_of_friction_j']:,.4g} by friction, {account['energy_j']:,.4g} left; "
        f"imbalance {found.energy_imbalance[0]:.0e}",
    )
    verdict = {0.0: "unstable", 1.0: "stable"}.get(float(found.stable[0]), "not decided")
    table.add_row(
        "exact core, permanent contact",
        f"{verdict}, ln|μ| = {found.growth_per_revolution[0]:+.3g} a revolution, "
        f"{'chatter' if verdict == 'unstable' else 'least damped'} at "
        f"{found.chatter_hz[0]:,.1f} Hz = {found.chatter_hz[0] / speed:.2f} Ω",
    )
    return table


def response_volume(outcome: SimulationOutcome) -> float:
    """Removed in the end, m³."""
    return float(np.nanmax(outcome.speeds.worn_volume_m3[0]))


def _of_many(outcome: SimulationOutcome) -> Iterator[str]:
    order, found = outcome.order, outcome.speeds
    depth = found.worn_m.max(axis=(1, 2)) * 1e6
    speed, worst = found.speed_hz, int(depth.argmax())
    yield (
        f"{order.blade.name}, {', '.join(order.nodes)}: {len(speed)} speeds from {speed[0]:.5g} to "
        f"{speed[-1]:.5g} Hz, {order.revolutions} revolutions each"
    )
    yield (
        f"deepest wear {depth[worst]:,.0f} µm at {speed[worst]:.5g} Hz (median {np.median(depth):,.0f} µm), "
        f"largest tip displacement {found.peak_m.max() * 1e6:,.0f} µm"
    )
    inside = found.unstable
    share = np.diff(outcome.lobes_hz, axis=1).sum() / (speed[-1] - speed[0])
    intervals = f"{len(outcome.lobes_hz)} intervals of speed, {share:.1%} of the range"
    yield f"exact core, permanent contact: unstable in {intervals}"
    if inside.any() and not inside.all():
        within, beside = np.median(depth[inside]), np.median(depth[~inside])
        yield (
            f"median wear {within:,.0f} µm at the {inside.sum()} simulated speeds in them, "
            f"{beside:,.0f} µm at the others"
        )

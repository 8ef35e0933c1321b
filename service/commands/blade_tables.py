"""Blades and how they were built, as tables for the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

if TYPE_CHECKING:
    from sdm_core.blade import Blade
    from sdm_core.blade.build import BladeBuild


def modes_table(blade: Blade) -> Table:
    """Frequencies at each speed, and amplitudes of the first speed at both edges."""
    table = Table(title=f"{blade.name}: modes", title_justify="left", title_style="bold", box=SIMPLE_HEAD)
    table.add_column("mode", justify="right")
    table.add_column("damping", justify="right")
    for state in blade.states:
        rpm = f" ({60 * state.speed_hz:,.0f} rpm)" if state.speed_hz else ""
        table.add_column(f"Hz at {state.speed_hz:.5g} Hz{rpm}", justify="right")
    for node in _edges(blade):
        table.add_column(f"{node} [kg^-1/2]", justify="right")
    for j in range(blade.mode_count):
        amplitudes = blade.states[0].mode_shape[j]
        table.add_row(
            str(j + 1),
            f"{blade.damping_ratio[j]:.2g}",
            *(f"{state.frequency_hz[j]:.2f}" for state in blade.states),
            *(f"{amplitudes[blade.tip_nodes.index(node)]:+.3f}" for node in _edges(blade)),
        )
    return table


def about_blade(blade: Blade) -> Iterator[str]:
    """Lines on the tip, the contact direction, and what rotation does to the tip."""
    yield (
        f"{len(blade.tip_nodes)} tip nodes, {blade.tip_nodes[0]} to {blade.tip_nodes[-1]}, amplitudes "
        + {
            "casing_normal": "normal to the casing",
            "radial": "radial",
            "given": "in the direction given",
        }[blade.direction]
    )
    if blade.mass_kg is not None:
        yield f"mass {blade.mass_kg:.5g} kg"
    for state in blade.states:
        said = []
        if state.tip_growth_m is not None and state.speed_hz:
            low, high = 1e6 * float(state.tip_growth_m.min()), 1e6 * float(state.tip_growth_m.max())
            said.append(f"the tip moves {low:+.1f} to {high:+.1f} µm towards the casing")
        if state.untwist_rad is not None and state.speed_hz:
            said.append(f"untwists by {np.degrees(state.untwist_rad):+.3f}°")
        if said:
            yield f"at {state.speed_hz:.5g} Hz " + " and ".join(said)


def about_build(build: BladeBuild) -> Iterator[str]:
    """Lines on mesh, reduction and its error."""
    yield (
        f"mesh of {build.mesh_nodes:,} nodes ({build.full_size:,} degrees of freedom), reduced to "
        f"{build.reduced_size}, in {build.seconds:.1f} s"
    )
    if build.check is None:
        yield "reduced model not compared with the full one"
        return
    worst = int(np.argmax(np.abs(build.check.frequency_error)))
    yield (
        f"against the full model at {build.check.speed_hz:.5g} Hz, between the states: frequencies within "
        f"{100 * abs(build.check.frequency_error[worst]):.2g} % (mode {worst + 1}), tip shapes within "
        f"{100 * build.check.shape_error.max():.2g} %"
    )


def _edges(blade: Blade) -> list[str]:
    ends = [blade.tip_nodes[0], blade.tip_nodes[-1]]
    return ends if ends[0] != ends[1] else ends[:1]

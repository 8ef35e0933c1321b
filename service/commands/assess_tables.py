"""An assessment as tables and lines for the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

if TYPE_CHECKING:
    from sdm_core.assessment import Assessment
    from sdm_core.assessment.margins import Margins
    from sdm_core.assessment.robust import RobustVerdict
    from sdm_core.assessment.shape_gradient import ShapeSensitivities
    from sdm_core.lobe_tips import CriticalSpeed


def modes_table(found: Assessment) -> Table:
    """Each mode: what it is, and its lobes alone."""
    table = _table("Modes, each alone")
    headings = ("mode", "kind", "Hz at rest", "least K_e [N/m]", "at rpm", "wear lobes", "owns of all lobes")
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "kind" else "right")
    for i, mode in enumerate(found.modes):
        kind = found.kinds[i] if found.kinds else None
        name = "" if kind is None else f"{kind.label} {kind.kind}".strip()
        owned = sum(owner.mode == mode.mode for owner in found.owners)
        deepest = mode.tips[0] if mode.tips else None
        hz = float(found.blade.states[0].frequency_hz[mode.mode - 1])
        table.add_row(
            str(mode.mode), name, f"{hz:.1f}", *_tip(deepest, found.ke_max), f"{owned} of {len(found.owners)}"
        )
    return table


def edges_table(found: Assessment) -> Table | None:
    """Each tip node rubbing alone."""
    if found.edges is None:
        return None
    table = _table("Each tip node alone")
    for heading in ("node", "least K_e [N/m]", "at rpm", "wear lobes", "mode"):
        table.add_column(heading, justify="left" if heading == "node" else "right")
    for node in found.edges.nodes:
        mode = "-" if node.mode is None else str(node.mode)
        table.add_row(node.node, *_tip(node.tip, node.searched_ke), mode)
    return table


def said_of(found: Assessment) -> Iterator[str]:
    """Worst lobe, margins, robust verdict, clearance, and what could not be told."""
    low, high = found.speed_range_hz
    worst = found.worst
    span = f"{low:.4g} to {high:.4g} Hz ({60 * low:,.0f} to {60 * high:,.0f} rpm)"
    if worst is None:
        yield f"Stable below {found.ke_max:,.0f} N/m over {span}"
    else:
        yield (
            f"Deepest of {len(found.tips)} lobes over {span}: {worst.ke:,.0f} N/m at "
            f"{worst.speed_rpm:,.0f} rpm, chatter {worst.chatter_hz:.1f} Hz, "
            f"{worst.lobes_per_revolution:.1f} wear lobes, mode {found.owners[0].mode}"
        )
    if found.edges is not None and found.edges.safer is not None:
        yield f"Safer edge: {found.edges.safer}"
    if found.margins is not None:
        yield from _margins(found.margins)
    for verdict, where in (
        (found.robust_range, "over the range"),
        (found.robust_points, "at the operating points"),
    ):
        if verdict is not None:
            yield f"Uncertain data {where}: {_robust(verdict)}"
    yield from _clearance(found)
    for what in found.missing:
        yield f"Note: {what}"


def sensitivities_table(found: ShapeSensitivities) -> Table:
    """Derivatives of the critical K_e to the shape."""
    table = _table(
        f"Critical K_e {found.ke:,.0f} N/m at {found.speed_hz:.2f} Hz, by shape (same lobe followed)"
    )
    for heading in ("shape", "dK_e per unit", "±", "by 1 % or 1°", "through ω", "through shapes"):
        table.add_column(heading, justify="left" if heading == "shape" else "right")
    for each in found.parameters:
        unit = 1.0 if each.parameter.endswith("_deg") else 0.01
        name = each.parameter.replace("_deg", " [°]") if unit == 1.0 else f"{each.parameter} [×]"
        table.add_row(
            name,
            f"{each.derivative:+,.4g}",
            f"{each.error_estimate:.1g}",
            f"{100 * unit * each.derivative / found.ke:+.2f} %",
            f"{each.by_frequency:+,.3g}",
            f"{each.by_mode_shape:+,.3g}",
        )
    return table


def _margins(margins: Margins) -> Iterator[str]:
    sign = "at least " if margins.worst is None else ""
    yield f"Against the liner's {margins.ke_liner:,.0f} N/m: margin in K_e {sign}{margins.margin_ke:+.0%}"
    if margins.unstable:
        spans = ", ".join(f"{i.low_hz:.2f}–{i.high_hz:.2f}" for i in margins.unstable[:6])
        more = "" if len(margins.unstable) <= 6 else f" and {len(margins.unstable) - 6} more"
        yield (
            f"  unstable at {spans} Hz{more}: {margins.unstable_speed_share:.1%} of the range; "
            f"{margins.low_end_hz:.2f} Hz from its lower and {margins.high_end_hz:.2f} Hz from its upper end"
        )
    for each in margins.points:
        state = {True: "stable", False: "UNSTABLE", None: "not decided"}[each.stable]
        near = "" if each.margin_hz is None else f", {abs(each.margin_hz):.2f} Hz from the nearest edge"
        yield (
            f"  {each.point.name} ({each.point.speed_hz:.4g} Hz, share {each.point.share:.3g}): {state}, "
            f"K_e margin {each.margin_ke:+.0%}{near}"
        )
    if margins.unstable_time_share is not None:
        yield f"  share of the running time unstable: {margins.unstable_time_share:.1%}"


def _robust(verdict: RobustVerdict) -> str:
    return verdict.described


def _clearance(found: Assessment) -> Iterator[str]:
    use = found.clearance
    if use.growth_m is not None:
        fast = 1e6 * use.growth_m[-1]
        turn = "" if use.untwist_rad is None else f", untwist {np.degrees(use.untwist_rad[-1]):+.3f}°"
        yield (
            f"Clearance: at {use.speed_hz[-1]:.4g} Hz rotation takes {fast[0]:+.0f} µm at {use.nodes[0]}, "
            f"{fast[-1]:+.0f} µm at {use.nodes[-1]}{turn}"
        )
    per_tip = use.contact_per_tip[-1]
    ratios = ", ".join(f"mode {j + 1}: {np.abs(row).max():.2f}" for j, row in enumerate(per_tip))
    yield f"  clearance taken per mm of tip vibration, mm: {ratios}"
    if use.running_clearance_m is not None and use.tightest is not None:
        running = 1e6 * use.running_clearance_m[-1]
        yield f"  running clearance {running.min():.0f} µm, least at {use.tightest[-1]}"


def _tip(tip: CriticalSpeed | None, searched: float) -> tuple[str, str, str]:
    if tip is None:
        return f"> {searched:,.0f}", "-", "-"
    return f"{tip.ke:,.0f}", f"{tip.speed_rpm:,.0f}", f"{tip.lobes_per_revolution:.1f}"


def _table(title: str) -> Table:
    return Table(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))

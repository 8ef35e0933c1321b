"""Results as tables for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD
from rich.table import Table

from service.screening.screen import UNSTABLE

if TYPE_CHECKING:
    from sdm_core.blade_sensitivity import Influence
    from sdm_core.lobe_tips import CriticalSpeed
    from service.screening.screen import ScreeningReport
    from service.verification.comparison import Verified
    from training.answers import CertificateUsed


def critical_speeds_table(title: str, tips: Sequence[CriticalSpeed]) -> Table:
    """Tips of lobes, smallest K_e first."""
    table = Table(title=title, title_justify="left", title_style="bold")
    for heading in ("K_e [N/m]", "speed [Hz]", "rpm", "ratio", "chatter [Hz]", "wear lobes"):
        table.add_column(heading, justify="right")
    for tip in tips:
        table.add_row(
            f"{tip.ke:,.1f}" if tip.proven else f"{tip.ke:,.1f} (not proven)",
            f"{tip.speed_hz:.3f}",
            f"{tip.speed_rpm:,.1f}",
            f"{tip.speed_ratio:.4f}",
            f"{tip.chatter_hz:.2f}",
            f"{tip.lobes_per_revolution:.2f}",
        )
    return table


def influences_table(title: str, influences: Sequence[Influence], most: int = 10) -> Table:
    """The parameters that move a critical K_e most, by what one per cent of each does."""
    table = Table(title=title, title_justify="left", title_style="bold")
    table.add_column("parameter")
    for heading in ("value", "dK_e per unit [N/m]", "d ln K_e/d ln p"):
        table.add_column(heading, justify="right")
    for each in sorted(influences, key=lambda influence: -abs(influence.relative))[:most]:
        table.add_row(
            each.parameter,
            f"{each.value:.6g} {each.unit}".strip(),
            f"{each.derivative:+,.4g}",
            f"{each.relative:+.4g}" + (" per revolution" if each.unit == "revolutions" else ""),
        )
    return table


def verification_table(title: str, found: Sequence[Verified]) -> Table:
    """What exact core, integration in time and surrogate say of each point."""
    table = Table(
        title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    table.add_column("point")
    for heading in ("speed [Hz]", "K_e [N/m]"):
        table.add_column(heading, justify="right")
    for heading in ("exact", "in time", "surrogate", "served"):
        table.add_column(heading)
    for heading in ("|μ| exact", "differs by", "chatter [Hz]"):
        table.add_column(heading, justify="right")
    said = {True: "stable", False: "unstable", None: "–"}
    for v in found:
        beside = ", also " + ", ".join(f"{hz:.1f}" for _, hz in v.nearly_equal) if v.nearly_equal else ""
        table.add_row(
            v.point.kind,
            f"{v.point.speed_hz:.3f}",
            f"{v.point.ke:,.1f}",
            said[v.exact],
            said[v.witness] if v.agrees else f"[bold red]{said[v.witness]}[/bold red]",
            said[v.surrogate],
            f"[bold red]{said[v.served]}[/bold red]" if v.served_wrongly else v.source,
            f"{v.radius_exact:.8f}",
            f"{v.radius_difference:.1e}",
            f"{v.chatter_exact_hz:.2f}{beside}",
        )
    return table


def under(certificate: CertificateUsed | None) -> str:
    """What to say behind the name of a model: the rate it keeps, and where; nothing where it keeps none."""
    if certificate is None:
        return ""
    return (
        f" (false stable below {certificate.alpha:g} on {certificate.distribution} "
        f"with {certificate.confidence:.0%} confidence)"
    )


def ranking_table(report: ScreeningReport) -> Table:
    """One row a blade and contact, safest first; about 90 characters wide."""
    judged = any(row.verdict for row in report.results)
    table = Table(
        title="Ranking, safest first",
        title_justify="left",
        title_style="bold",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    table.add_column("blade", overflow="fold")
    table.add_column("contact", overflow="fold")
    for heading in ("K_e [N/m]", "at rpm", "chatter [Hz]", "lobes", "unstable", "verified"):
        table.add_column(heading, justify="right")
    if judged:
        table.add_column("verdict", no_wrap=True)
    for row in report.results:
        worst = row.worst
        where = (f"> {row.ke_max:,.0f}", "-", "-", "-")
        if worst is not None:
            proven = "" if worst.proven else " (not proven)"
            where = (
                f"{worst.ke:,.0f}{proven}",
                f"{worst.speed_rpm:,.0f}",
                f"{worst.chatter_hz:.1f}",
                f"{worst.lobes_per_revolution:.1f}",
            )
        shares = (f"{row.unstable_share:.1%}", f"{row.verified_share:.1%}")
        verdict = () if not judged else (_verdict(row.verdict, row.margin),)
        table.add_row(row.blade.name, row.contact_name, *where, *shares, *verdict)
    return table


def _verdict(verdict: str | None, margin: float | None) -> str:
    word = "unstable" if verdict == UNSTABLE else f"{verdict}"
    return word if margin is None else f"{word} {margin:+.0%}"

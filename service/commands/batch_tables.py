"""The ranking of a batch, and what became of it, at the terminal and in files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from service.commands.batch_files import as_typed
from service.commands.outputs import console_beside, write_bytes, write_json

if TYPE_CHECKING:
    from service.client import Client, ScreeningResults, ScreeningRow
    from service.screening.batch import Failure

# Rows shown of a longer ranking, at either end of it; files have all of them.
_EACH_END = 25
_NAME_WIDTH = 24


def show_results(
    client: Client,
    found: ScreeningResults,
    *,
    json: str | None,
    csv: str | None,
    parquet: str | None,
    html: str | None = None,
    failures: Sequence[Failure] = (),
) -> None:
    """Print the ranking, and write the files that were asked for."""
    console = console_beside(json)
    if found.rows:
        console.print(ranking_table(found.rows))
    if not found.complete:
        console.print("[dim]not every blade of the job is there: ranks are of those that are[/dim]")
    lost = [(failure.source, failure.reason) for failure in failures]
    lost += [(as_typed(blade.source), blade.reason) for blade in found.not_screened]
    if lost:
        console.print(_lost_table(lost))
    if json:
        document = found.to_dict()
        if failures:
            document["not_sent"] = [failure.to_dict() for failure in failures]
        write_json(json, document, indent=True)
    if csv:
        write_bytes("--csv", csv, found.to_csv())
        console.print(f"[dim]wrote {csv}[/dim]")
    if parquet:
        write_bytes("--parquet", parquet, found.parquet)
        console.print(f"[dim]wrote {parquet}[/dim]")
    if html:
        write_bytes("--html", html, client.screening_report(found.job))
        console.print(f"[dim]wrote {html}[/dim]")


def ranking_table(rows: Sequence[ScreeningRow]) -> Table:
    """The ranking, safest first; of a long one its two ends."""
    judged = any(row.verdict is not None for row in rows)
    asked = any(row.meets_criteria is not None for row in rows)
    table = Table(
        title="Ranking, safest first",
        title_justify="left",
        title_style="bold",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    table.add_column("", justify="right")
    longest = max((len(row.blade) for row in rows), default=0)
    table.add_column("blade", overflow="fold", min_width=min(longest, _NAME_WIDTH))
    table.add_column("contact", overflow="fold")
    for heading in ("K_e [N/m]", "at rpm", "chatter [Hz]", "lobes", "unstable", "verified"):
        table.add_column(heading, justify="right")
    if judged:
        table.add_column("verdict", no_wrap=True)
    if asked:
        table.add_column("criteria", no_wrap=True)
    for i, row in enumerate(rows):
        left_out = len(rows) - 2 * _EACH_END
        if left_out > 0 and i == _EACH_END:
            table.add_row("", f"... {left_out:,} more ...", *[""] * (7 + judged + asked))
        if left_out > 0 and _EACH_END <= i < len(rows) - _EACH_END:
            continue
        judgement = [_verdict(row)] if judged else []
        criteria = [_criteria(row)] if asked else []
        shares = ("-" if x is None else f"{x:.1%}" for x in (row.unstable_share, row.verified_share))
        # As Text: a name may hold what rich takes for a style.
        name, contact = Text(row.blade), Text(row.contact_name)
        table.add_row(str(row.rank), name, contact, *_where(row), *shares, *judgement, *criteria)
    return table


def _where(row: ScreeningRow) -> tuple[str, str, str, str]:
    unsure = "" if row.proven else " (not proven)"
    if row.smallest_unstable_ke is None:
        return f"> {row.ke_max:,.0f}{unsure}", "-", "-", "-"
    numbers = ((row.speed_rpm, ",.0f"), (row.chatter_hz, ".1f"), (row.wear_lobes, ".1f"))
    rpm, chatter, lobes = ("-" if x is None else format(x, form) for x, form in numbers)
    return f"{row.smallest_unstable_ke:,.0f}{unsure}", rpm, chatter, lobes


def _verdict(row: ScreeningRow) -> str:
    word = (row.verdict or "-").partition(" at ")[0]
    return word if row.margin is None else f"{word} {row.margin:+.0%}"


def _criteria(row: ScreeningRow) -> str:
    if row.meets_criteria is None:
        return "-"
    return "met" if row.meets_criteria else "missed " + ", ".join(row.criteria_missed or ())


def _lost_table(lost: Sequence[tuple[str, str]]) -> Table:
    table = Table(
        title="Not screened", title_justify="left", title_style="bold", box=SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    table.add_column("file", overflow="fold")
    table.add_column("reason", overflow="fold")
    for source, reason in lost[: 2 * _EACH_END]:
        table.add_row(Text(source), Text(reason))
    if len(lost) > 2 * _EACH_END:
        table.add_row(f"... {len(lost) - 2 * _EACH_END:,} more ...", "")
    return table

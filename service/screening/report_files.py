"""A screening as files: report.json and its charts."""

from __future__ import annotations

from pathlib import Path

from service.commands.outputs import write_bytes, write_json
from service.screening.charts import boundaries_png, map_png, ranking_png
from service.screening.screen import ScreeningReport


def write_report(folder: str | Path, report: ScreeningReport) -> list[Path]:
    """report.json, ranking.png, a map for each blade and contact, the boundaries of each blade.

    Returns
    -------
    The files written.
    """
    folder = Path(folder)
    charts = {"ranking.png": ranking_png(report)}
    blades = list({id(row.blade): row.blade for row in report.results}.values())
    stems = [file_name(blade.name) for blade in blades]
    for i, blade in enumerate(blades):
        stem = stems[i] if stems.count(stems[i]) == 1 else f"{stems[i]}_{i + 1}"
        rows = sorted((row for row in report.results if row.blade is blade), key=lambda row: row.contact_name)
        for row in rows:
            charts[f"{stem}_{file_name(row.contact_name)}_map.png"] = map_png(
                blade, row.contact, row.map, row.boundary, ke_liner=row.ke_liner, worst=row.worst
            )
        curves = {row.contact_name: row.boundary for row in rows}
        charts[f"{stem}_boundaries.png"] = boundaries_png(
            blade, curves, ke_max=rows[0].ke_max, ke_liner=rows[0].ke_liner
        )
    write_json(str(folder / "report.json"), report.to_dict(), indent=True)
    for name, content in charts.items():
        write_bytes("--out", folder / name, content)
    return [folder / name for name in ("report.json", *charts)]


def file_name(text: str) -> str:
    """`text` with whatever a file name should not hold replaced.

    Examples
    --------
    >>> file_name("rotor 37/LE=1,TE=0.5")
    'rotor-37-LE-1-TE-0.5'
    """
    return "".join(c if c.isalnum() or c in "._-" else "-" for c in text).strip(".-") or "unnamed"

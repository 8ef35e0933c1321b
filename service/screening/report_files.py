"""A screening as files: report.json and its charts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from service.commands.outputs import write_bytes, write_json
from service.screening.charts import boundaries_png, map_png, ranking_png
from service.screening.screen import ScreeningReport
from service.screening.sweep import Progress


def write_report(
    folder: str | Path,
    report: ScreeningReport,
    *,
    document: dict[str, Any] | None = None,
    progress: Progress | None = None,
) -> list[Path]:
    """report.json, ranking.png, a map for each blade and contact, the boundaries of each blade.

    Parameters
    ----------
    document
        Content of report.json; None is the report's own.
    progress
        Called with (blades drawn, their number, what is next).

    Returns
    -------
    The files written.
    """
    folder = Path(folder)
    blades = list({id(row.blade): row.blade for row in report.results}.values())
    stems = [file_name(blade.name) for blade in blades]
    write_json(str(folder / "report.json"), report.to_dict() if document is None else document, indent=True)
    written = [folder / "report.json"]

    def write(name: str, chart: bytes) -> None:
        write_bytes("--out", folder / name, chart)
        written.append(folder / name)

    write("ranking.png", ranking_png(report))
    for i, blade in enumerate(blades):
        if progress is not None:
            progress(i, len(blades), blade.name)
        stem = stems[i] if stems.count(stems[i]) == 1 else f"{stems[i]}_{i + 1}"
        rows = sorted((row for row in report.results if row.blade is blade), key=lambda row: row.contact_name)
        for row in rows:
            chart = map_png(blade, row.contact, row.map, row.boundary, ke_liner=row.ke_liner, worst=row.worst)
            write(f"{stem}_{file_name(row.contact_name)}_map.png", chart)
        curves = {row.contact_name: row.boundary for row in rows}
        write(
            f"{stem}_boundaries.png",
            boundaries_png(blade, curves, ke_max=rows[0].ke_max, ke_liner=rows[0].ke_liner),
        )
    return written


def file_name(text: str) -> str:
    """`text` with whatever a file name should not hold replaced.

    Examples
    --------
    >>> file_name("rotor 37/LE=1,TE=0.5")
    'rotor-37-LE-1-TE-0.5'
    """
    return "".join(c if c.isalnum() or c in "._-" else "-" for c in text).strip(".-") or "unnamed"

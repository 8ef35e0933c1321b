"""Charts and report of a screening job, made of its stored chunks when they are asked for."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime
from typing import Any

from service.jobs.chunk_store import ChunkStore
from service.jobs.errors import NotScreened
from service.jobs.job_folder import JobFolder
from service.jobs.screening.chunk_content import ChunkContent, ScreenedBlade
from service.jobs.screening.rankings import Ranking
from service.jobs.screening.request import ScreeningRequest
from service.screening.batch import Failure, ScreenedBatch
from service.screening.screen import ScreeningReport, ScreeningResult, risk

# Sheets of a report: more than anybody leafs through, and a few MB of page.
MOST_SHEETS = 200


def screened_blade(folder: JobFolder, index: int) -> ScreenedBlade:
    """The results of one blade.

    Raises
    ------
    NotScreened
        When there are none, or not yet.
    DamagedFile
    """
    request = ScreeningRequest.from_dict(folder.request())
    store = ChunkStore(folder.chunks)
    number = index // request.blades_per_chunk
    if number in store.numbers():
        content = ChunkContent.from_bytes(store.read(number), blade_index=index)
        if content.screened:
            return content.screened[0]
        for blade in content.unscreened:
            if blade.index == index:
                raise NotScreened("blade_index", str(index), f"{blade.source}: {blade.reason}")
    raise NotScreened("blade_index", str(index), "give one of the results; it may not be computed yet")


def contact_result(blade: ScreenedBlade, contact_name: str) -> ScreeningResult:
    """The result under one contact.

    Raises
    ------
    NotScreened
        When the contact was not asked for.
    """
    for result in blade.results:
        if result.contact_name == contact_name:
            return result
    names = ", ".join(result.contact_name for result in blade.results)
    raise NotScreened("contact", contact_name, f"give one of {names}")


def map_chart(result: ScreeningResult) -> bytes:
    """The stability map, PNG."""
    from service.screening.charts import map_png

    return map_png(
        result.blade,
        result.contact,
        result.map,
        result.boundary,
        ke_liner=result.ke_liner,
        worst=result.worst,
    )


def boundaries_chart(blade: ScreenedBlade) -> bytes:
    """First crossings under every contact, PNG."""
    from service.screening.charts import boundaries_png

    first = blade.results[0]
    curves = {result.contact_name: result.boundary for result in blade.results}
    return boundaries_png(blade.blade, curves, ke_max=first.ke_max, ke_liner=first.ke_liner)


def report(
    folder: JobFolder, ranking: Ranking, *, sheets: int, card: dict[str, Any] | None, made: datetime
) -> bytes:
    """The HTML report on the riskiest blades of a job.

    Raises
    ------
    NotScreened
        While there are no results.
    """
    from service.screening.html_report import html_report

    request = ScreeningRequest.from_dict(folder.request())
    riskiest = dict.fromkeys(reversed(ranking.columns(["blade_index"])["blade_index"].to_pylist()))
    if not riskiest:
        raise NotScreened("job", folder.path.name, "there are no results yet, or no blade could be screened")
    chosen = sorted(list(riskiest)[:sheets])
    blades = list(_blades(folder, request, chosen))
    rows = tuple(sorted((result for blade in blades for result in blade.results), key=risk))
    batch = ScreenedBatch(
        ScreeningReport(rows, rows[0].map.model, rows[0].boundary.solver),
        tuple(blade.blade for blade in blades),
        tuple(blade.source for blade in blades),
        tuple(Failure(blade.source, blade.reason) for blade in ranking.unscreened),
    )
    left_out = len(riskiest) - len(blades)
    page = html_report(batch, policy=request.policy, card=card, made=made, safer_left_out=left_out)
    return page.encode()


def _blades(folder: JobFolder, request: ScreeningRequest, indices: Iterable[int]) -> Iterable[ScreenedBlade]:
    store = ChunkStore(folder.chunks)
    chunks: dict[int, list[int]] = {}
    for index in indices:
        chunks.setdefault(index // request.blades_per_chunk, []).append(index)
    for number, wanted in sorted(chunks.items()):
        content = store.read(number)
        for index in wanted:
            yield from ChunkContent.from_bytes(content, blade_index=index).screened

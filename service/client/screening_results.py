"""The outcome of a screening: its ranking as rows, as a table, as files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urlencode

from sdm_core.contact import ContactConfiguration
from sdm_core.errors import DamagedFile
from sdm_core.lobe_tips import CriticalSpeed
from service.client.conversations import one
from service.client.job_conversations import SCREENINGS, job_path
from service.client.message import Conversation, Message
from service.client.problem import ServiceProblem
from service.rest.job_schemas import ResultsReply

if TYPE_CHECKING:
    import pyarrow as pa

PARQUET, HTML, PNG = "application/vnd.apache.parquet", "text/html", "image/png"


@dataclass(frozen=True)
class ScreeningRow:
    """One blade under one contact.

    Attributes
    ----------
    rank
        1 is the safest.
    blade_index, source, blade
        Its place in the order, from 0, where it came from, and its name.
    smallest_unstable_ke
        N/m; None where there is none up to `ke_max`.
    speed_hz, speed_rpm, speed_ratio, chatter_hz, wear_lobes, error_estimate
        Where that K_e destabilises it, as of `critical_speeds`; None where there is none.
    proven
        Whether the exact core proved it.
    verdict, margin
        Against `ke_liner`; None without one.
    meets_criteria, criteria_missed
        None where none were asked.
    unstable_share, verified_share
        Of the map: unstable, and answered by the exact core.
    critical_speeds
        Tips of the deepest lobes, smallest K_e first.
    """

    rank: int
    blade_index: int
    source: str
    blade: str
    contact_name: str
    contact: ContactConfiguration
    smallest_unstable_ke: float | None
    speed_hz: float | None
    speed_rpm: float | None
    speed_ratio: float | None
    chatter_hz: float | None
    wear_lobes: float | None
    error_estimate: float | None
    proven: bool
    verdict: str | None
    margin: float | None
    meets_criteria: bool | None
    criteria_missed: tuple[str, ...] | None
    unstable_share: float | None
    verified_share: float | None
    speed_range_hz: tuple[float, float]
    ke_max: float
    ke_liner: float | None
    model: str | None
    solver: str
    critical_speeds: tuple[CriticalSpeed, ...]

    @classmethod
    def of(cls, row: Mapping[str, Any]) -> ScreeningRow:
        """From an object of the wire."""
        missed, (low, high) = row["criteria_missed"], row["speed_range_hz"]
        tips = tuple(
            CriticalSpeed(**{name: math.nan if value is None else value for name, value in tip.items()})
            for tip in row["critical_speeds"]
        )
        read = {
            "contact": ContactConfiguration.from_dict(row["contact"]),
            "criteria_missed": None if missed is None else tuple(missed),
            "speed_range_hz": (low, high),
            "critical_speeds": tips,
        }
        return cls(**{**row, **read})


@dataclass(frozen=True)
class NotScreened:
    """A blade that could not be screened, and why in a line."""

    index: int
    source: str
    name: str
    reason: str


@dataclass(frozen=True)
class ScreeningResults:
    """The ranking of a screening, safest first.

    Attributes
    ----------
    job
        The screening's id.
    complete
        False where the job is not over, or was cancelled or failed: ranks are of what was there.
    parquet
        The table as the service sent it.
    """

    job: str
    complete: bool
    parquet: bytes = field(repr=False)

    @cached_property
    def table(self) -> pa.Table:
        """One row a blade and contact, as a pyarrow table; `table.to_pandas()` for pandas."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        return pq.read_table(pa.BufferReader(self.parquet))

    @cached_property
    def rows(self) -> tuple[ScreeningRow, ...]:
        """One a blade and contact."""
        from service.jobs.screening.results import to_rows

        return tuple(ScreeningRow.of(row) for row in to_rows(self.table))

    @cached_property
    def not_screened(self) -> tuple[NotScreened, ...]:
        """Blades that could not be, in the order of the request."""
        from service.jobs.screening.results import unscreened_of

        return tuple(NotScreened(**vars(blade)) for blade in unscreened_of(self.table.schema))

    def to_dict(self) -> dict[str, Any]:
        """As JSON, rows as the service writes them."""
        from service.jobs.screening.results import to_rows

        return {
            "job": self.job,
            "complete": self.complete,
            "results": to_rows(self.table),
            "not_screened": [vars(blade) for blade in self.not_screened],
        }

    def to_csv(self, path: str | Path | None = None) -> bytes:
        """The table as CSV, as the service writes it; into a file too where one is named."""
        from service.jobs.screening.results import to_csv

        content = to_csv(self.table)
        if path is not None:
            Path(path).write_bytes(content)
        return content

    def to_parquet(self, path: str | Path) -> None:
        """Write the table as the service sent it."""
        Path(path).write_bytes(self.parquet)


def results(
    job_id: str, contact: str | None, verdict: str | None, meets_criteria: bool | None
) -> Conversation[ScreeningResults]:
    """``GET /v1/screenings/{id}/results``, whole: pages of a job under way could overlap."""
    query: dict[str, str] = {}
    for name, value in (("contact", contact), ("verdict", verdict)):
        if value is not None:
            query[name] = value
    if meets_criteria is not None:
        query["meets_criteria"] = "true" if meets_criteria else "false"
    path = f"{job_path(SCREENINGS, job_id)}/results"
    # First: what is complete before the table is asked for is so in the table.
    first = yield from one(Message.get(f"{path}?{urlencode({**query, 'limit': '1'})}"), ResultsReply)
    reply = yield Message("GET", f"{path}?{urlencode(query)}", accept=PARQUET)
    found = ScreeningResults(first.job, first.complete, reply.content)
    try:
        _ = found.rows, found.not_screened
    except (DamagedFile, OSError, ValueError, KeyError, TypeError):
        raise ServiceProblem.foreign(reply) from None
    return found


def report(job_id: str, sheets: int | None) -> Conversation[bytes]:
    """``GET /v1/screenings/{id}/report``, HTML."""
    query = "" if sheets is None else f"?sheets={sheets:d}"
    reply = yield Message("GET", f"{job_path(SCREENINGS, job_id)}/report{query}", accept=HTML)
    return reply.content


def map_picture(job_id: str, index: int, contact: str) -> Conversation[bytes]:
    """``GET /v1/screenings/{id}/blades/{index}/map.png``."""
    path = f"{job_path(SCREENINGS, job_id)}/blades/{index:d}/map.png?contact={quote(contact, safe='')}"
    reply = yield Message("GET", path, accept=PNG)
    return reply.content


def boundaries_picture(job_id: str, index: int) -> Conversation[bytes]:
    """``GET /v1/screenings/{id}/blades/{index}/boundaries.png``."""
    reply = yield Message(
        "GET", f"{job_path(SCREENINGS, job_id)}/blades/{index:d}/boundaries.png", accept=PNG
    )
    return reply.content

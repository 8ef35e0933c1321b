"""The ranking of a screening as a table: safest first, one row a blade and contact."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from sdm_core.errors import DamagedFile
from service.jobs.durable_files import write_durably
from service.jobs.job_folder import JobFolder
from service.jobs.screening.chunk_content import UnscreenedBlade, rows_of
from service.jobs.screening.chunk_store import ChunkStore
from service.jobs.screening.request import Criteria, ScreeningRequest

FILE = "results.parquet"
_UNSCREENED = b"rubscreen.not_screened"
_TIP = pa.struct(
    [
        (name, pa.float64())
        for name in (
            "ke",
            "speed_hz",
            "speed_rpm",
            "speed_ratio",
            "chatter_hz",
            "lobes_per_revolution",
            "error_estimate",
        )
    ]
)
SCHEMA = pa.schema(
    [
        ("rank", pa.int64()),
        ("blade_index", pa.int64()),
        ("source", pa.string()),
        ("blade", pa.string()),
        ("contact_name", pa.string()),
        ("contact", pa.string()),  # JSON
        ("smallest_unstable_ke", pa.float64()),
        ("speed_hz", pa.float64()),
        ("speed_rpm", pa.float64()),
        ("speed_ratio", pa.float64()),
        ("chatter_hz", pa.float64()),
        ("wear_lobes", pa.float64()),
        ("error_estimate", pa.float64()),
        ("proven", pa.bool_()),
        ("verdict", pa.string()),
        ("margin", pa.float64()),
        ("meets_criteria", pa.bool_()),
        ("criteria_missed", pa.list_(pa.string())),
        ("unstable_share", pa.float64()),
        ("verified_share", pa.float64()),
        ("speed_low_hz", pa.float64()),
        ("speed_high_hz", pa.float64()),
        ("ke_max", pa.float64()),
        ("ke_liner", pa.float64()),
        ("model", pa.string()),
        ("solver", pa.string()),
        ("critical_speeds", pa.list_(_TIP)),
    ]
)


def write_results(folder: JobFolder, request: ScreeningRequest) -> None:
    """Rank what is stored, and write it to the job's folder.

    Raises
    ------
    OSError
        When it cannot be written.
    DamagedFile
        When a chunk is not whole.
    """
    rows, unscreened = stored_rows(folder)
    write_durably(folder.path / FILE, to_parquet(ranked(rows, request.criteria), unscreened))


def stored_rows(folder: JobFolder) -> tuple[list[dict[str, Any]], list[UnscreenedBlade]]:
    """Rows of the chunks stored so far, in the order of the job, and the blades not screened.

    Raises
    ------
    DamagedFile
        When a chunk is not whole.
    """
    rows, unscreened = [], []
    for _, content in ChunkStore(folder.chunks).each():
        more, failed = rows_of(content)
        rows += more
        unscreened += failed
    return rows, unscreened


def ranked(rows: Iterable[Mapping[str, Any]], criteria: Criteria) -> pa.Table:
    """The ranking: largest least K_e first, then the smaller unstable share, as `screen.risk`."""

    def risk(row: Mapping[str, Any]) -> tuple[float, float, int]:
        smallest, share = row["smallest_unstable_ke"], row["unstable_share"]
        least = math.inf if smallest is None else smallest
        return -least, math.inf if share is None or math.isnan(share) else share, row["blade_index"]

    ordered = sorted(rows, key=risk)
    lines = [_line(rank, row, criteria) for rank, row in enumerate(ordered, 1)]
    return pa.Table.from_pylist(lines, schema=SCHEMA)


def results(folder: JobFolder) -> tuple[pa.Table, list[UnscreenedBlade], bool]:
    """The ranking, the blades not screened, and whether that is all of the job.

    Raises
    ------
    DamagedFile
        When a file of the job is not whole.
    """
    path = folder.path / FILE
    if path.is_file():
        try:
            table = pq.read_table(path, partitioning=None)
        except (OSError, pa.ArrowException) as error:
            raise DamagedFile(
                "results", str(path), f"retry the job, which writes it again ({error})"
            ) from None
        return table, unscreened_of(table), True
    rows, unscreened = stored_rows(folder)
    return ranked(rows, ScreeningRequest.from_dict(folder.request()).criteria), unscreened, False


def unscreened_of(table: pa.Table) -> list[UnscreenedBlade]:
    """The blades not screened, in the metadata of a table read from Parquet."""
    said = json.loads((table.schema.metadata or {}).get(_UNSCREENED, b"[]"))
    return [UnscreenedBlade(**entry) for entry in said]


def to_parquet(table: pa.Table, unscreened: Sequence[UnscreenedBlade]) -> bytes:
    """As a Parquet file; the blades not screened go into its metadata."""
    said = json.dumps([vars(blade) for blade in unscreened]).encode()
    buffer = io.BytesIO()
    pq.write_table(table.replace_schema_metadata({_UNSCREENED: said}), buffer, compression="zstd")
    return buffer.getvalue()


def to_csv(table: pa.Table) -> bytes:
    """As CSV with a heading; lists are left out but for the criteria missed."""
    for name in ("source", "blade", "contact_name"):
        place = table.schema.get_field_index(name)
        table = table.set_column(place, name, pa.array([_inert(t) for t in table[name].to_pylist()]))
    missed = [None if names is None else " ".join(names) for names in table["criteria_missed"].to_pylist()]
    place = table.schema.get_field_index("criteria_missed")
    flat = table.set_column(place, "criteria_missed", pa.array(missed, pa.string()))
    # The contact last: it is JSON, whose commas lead astray whoever cuts lines at commas.
    names = [name for name in flat.column_names if name not in ("contact", "critical_speeds")]
    buffer = io.BytesIO()
    pyarrow.csv.write_csv(flat.select([*names, "contact"]), buffer)
    return buffer.getvalue()


def to_rows(table: pa.Table) -> list[dict[str, Any]]:
    """As the objects of the wire."""
    rows = table.to_pylist()
    for row in rows:
        row["contact"] = json.loads(row["contact"])
        row["speed_range_hz"] = [row.pop("speed_low_hz"), row.pop("speed_high_hz")]
    return rows


def _inert(text: str | None) -> str | None:
    """A text that no spreadsheet takes for a formula."""
    return f"'{text}" if text is not None and text[:1] in ("=", "+", "-", "@", "\t", "\r") else text


def _line(rank: int, row: Mapping[str, Any], criteria: Criteria) -> dict[str, Any]:
    worst = row["critical_speeds"][0] if row["critical_speeds"] else {}
    missed = criteria.missed(row)
    return {
        "rank": rank,
        **{name: row[name] for name in ("blade_index", "source", "blade", "contact_name")},
        "contact": json.dumps(row["contact"]),
        "smallest_unstable_ke": row["smallest_unstable_ke"],
        **{name: worst.get(name) for name in ("speed_hz", "speed_rpm", "speed_ratio", "chatter_hz")},
        "wear_lobes": worst.get("lobes_per_revolution"),
        "error_estimate": worst.get("error_estimate"),
        **{name: row[name] for name in ("proven", "verdict", "margin", "unstable_share", "verified_share")},
        "meets_criteria": None if missed is None else not missed,
        "criteria_missed": missed,
        "speed_low_hz": row["speed_range_hz"][0],
        "speed_high_hz": row["speed_range_hz"][1],
        **{name: row[name] for name in ("ke_max", "ke_liner", "model", "solver", "critical_speeds")},
    }

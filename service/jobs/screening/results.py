"""The ranking of a screening as a table: safest first, one row a blade and contact."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from sdm_core.interruption import checkpoint
from service.jobs.chunk_store import ChunkStore
from service.jobs.durable_files import write_durably
from service.jobs.job_folder import JobFolder
from service.jobs.screening.chunk_content import UnscreenedBlade, rows_of
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
# Rows of the file read together: a page needs one group or two of them.
ROWS_IN_GROUP = 1000
# Tables of chunks joined at a time: many small ones take up several times the room.
JOIN_AT = 256
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
UNRANKED = pa.schema(list(SCHEMA)[1:])


def write_results(folder: JobFolder, request: ScreeningRequest) -> None:
    """Rank what is stored, and write it to the job's folder.

    Raises
    ------
    OSError
        When it cannot be written.
    DamagedFile
        When a chunk is not whole.
    Cancelled
        When the surrounding `interruptible` block wants it to stop.
    """
    tables: list[pa.Table] = []
    unscreened: list[UnscreenedBlade] = []
    for _, content in ChunkStore(folder.chunks).each():
        checkpoint()
        table, failed = table_of(content, request.criteria)
        tables.append(table)
        unscreened += failed
        if len(tables) >= JOIN_AT:
            tables = [joined(tables)]
    write_durably(folder.path / FILE, to_parquet(ranked(joined(tables)), unscreened))


def table_of(content: bytes, criteria: Criteria) -> tuple[pa.Table, list[UnscreenedBlade]]:
    """The rows of a chunk, not ranked yet (`UNRANKED`), and its blades that were not screened.

    Raises
    ------
    DamagedFile
        When it is not what was written.
    """
    rows, unscreened = rows_of(content)
    return pa.Table.from_pylist([_line(row, criteria) for row in rows], schema=UNRANKED), unscreened


def joined(tables: Sequence[pa.Table]) -> pa.Table:
    """Tables of chunks as one, each column in one piece."""
    return pa.concat_tables([UNRANKED.empty_table(), *tables]).combine_chunks()


def rank_order(table: pa.Table) -> np.ndarray:
    """Places of rows from the safest on: largest least K_e first, then the smaller unstable share.

    As `screen.risk`; rows alike in both stand in the order of the job.
    """
    least = table["smallest_unstable_ke"].fill_null(np.inf).to_numpy()
    share = table["unstable_share"].fill_null(np.inf).to_numpy()
    return np.lexsort((table["blade_index"].to_numpy(), np.where(np.isnan(share), np.inf, share), -least))


def with_ranks(table: pa.Table, ranks: np.ndarray) -> pa.Table:
    """Rows of `UNRANKED` as those of `SCHEMA`."""
    return table.add_column(0, SCHEMA.field("rank"), pa.array(ranks, pa.int64()))


def ranked(table: pa.Table) -> pa.Table:
    """The ranking of the rows of `joined`."""
    return with_ranks(table.take(rank_order(table)), np.arange(1, table.num_rows + 1))


def unscreened_of(schema: pa.Schema) -> list[UnscreenedBlade]:
    """The blades not screened, in the metadata of a file of `to_parquet`."""
    said = json.loads((schema.metadata or {}).get(_UNSCREENED, b"[]"))
    return [UnscreenedBlade(**entry) for entry in said]


def to_parquet(table: pa.Table, unscreened: Sequence[UnscreenedBlade]) -> bytes:
    """As a Parquet file; the blades not screened go into its metadata."""
    said = json.dumps([vars(blade) for blade in unscreened]).encode()
    buffer = io.BytesIO()
    kept = table.replace_schema_metadata({_UNSCREENED: said})
    pq.write_table(kept, buffer, compression="zstd", row_group_size=ROWS_IN_GROUP)
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


def _line(row: Mapping[str, Any], criteria: Criteria) -> dict[str, Any]:
    worst = row["critical_speeds"][0] if row["critical_speeds"] else {}
    missed = criteria.missed(row)
    return {
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

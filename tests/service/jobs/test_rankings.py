"""Rankings by pages: the same rows as the whole, without reading the whole."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sdm_core.errors import Cancelled, DamagedFile
from sdm_core.interruption import interruptible
from service.jobs.chunk_store import ChunkStore
from service.jobs.job_folder import JobFolder
from service.jobs.screening import rankings
from service.jobs.screening.rankings import Rankings
from service.jobs.screening.request import Criteria, ScreeningRequest
from service.jobs.screening.results import FILE, ROWS_IN_GROUP, SCHEMA, write_results

CONTACTS = ("LE", "TE")


def row(contact: str, ke: float | None, share: float | None) -> dict[str, Any]:
    tip = {"ke": ke, "speed_hz": 100.0, "speed_rpm": 6e3, "speed_ratio": 0.3, "chatter_hz": 330.0}
    return {
        "blade": "b",
        "contact_name": contact,
        "contact": {"weights": {contact: 1.0}},
        "smallest_unstable_ke": ke,
        "critical_speeds": []
        if ke is None
        else [tip | {"lobes_per_revolution": 3.3, "error_estimate": 1e-9}],
        "speed_range_hz": [50.0, 200.0],
        "ke_max": 2.5e4,
        "ke_liner": 9e3,
        "proven": True,
        "verdict": "stable" if ke is None or ke > 9e3 else "unstable at some speed",
        "margin": None if ke is None else ke / 9e3 - 1.0,
        "unstable_share": share,
        "verified_share": 0.01,
        "model": "m",
        "solver": "s",
    }


def chunk(first: int, blades: int, rng: np.random.Generator) -> bytes:
    """Results of some blades, with few different K_e and shares, so that there are ties."""
    screened = [
        {
            "index": index,
            "source": f"blades[{index}]",
            "results": [
                {"row": row(name, rng.choice([None, 5e3, 1e4, 2e4]), rng.choice([None, 0.0, 0.1]))}
                for name in CONTACTS
            ],
        }
        for index in range(first, first + blades)
    ]
    lost = [{"index": first + blades, "source": f"blades[{first + blades}]", "name": "x", "reason": "bad"}]
    text = json.dumps({"screened": screened, "unscreened": lost}).encode()
    content = io.BytesIO()
    np.savez_compressed(content, content=np.frombuffer(text, dtype=np.uint8))
    return content.getvalue()


def job_in(place: Path, chunks: int = 6, blades: int = 7) -> JobFolder:
    place.mkdir(parents=True)
    asked = ScreeningRequest(criteria=Criteria(least_margin=0.2), blades_per_chunk=blades + 1)
    (place / "request.json").write_text(json.dumps(asked.to_dict()))
    rng = np.random.default_rng(4)
    for number in range(chunks):
        ChunkStore(place / "chunks").put(number, chunk(number * (blades + 1), blades, rng))
    return JobFolder(place)


def ended(folder: JobFolder) -> None:
    write_results(folder, ScreeningRequest.from_dict(folder.request()))


def expected_order(rows: list[dict[str, Any]]) -> list[tuple[int, str]]:
    """Safest first, said once more and otherwise: by repeated comparison of what a user sees."""

    def key(seen: dict[str, Any]) -> tuple[float, float, int, int]:
        ke = np.inf if seen["smallest_unstable_ke"] is None else seen["smallest_unstable_ke"]
        share = np.inf if seen["unstable_share"] is None else seen["unstable_share"]
        return -ke, share, seen["blade_index"], CONTACTS.index(seen["contact_name"])

    return [(seen["blade_index"], seen["contact_name"]) for seen in sorted(rows, key=key)]


@pytest.mark.parametrize("complete", [False, True], ids=["of chunks", "of the file"])
def test_pages_put_together_are_the_whole_ranking(tmp_path, monkeypatch, complete):
    monkeypatch.setattr("service.jobs.screening.results.ROWS_IN_GROUP", 10)
    folder = job_in(tmp_path / "job")
    if complete:
        ended(folder)
    ranking = Rankings().of(folder)
    whole = ranking.columns(SCHEMA.names)
    assert (ranking.complete, ranking.rows, whole.num_rows) == (complete, 84, 84)
    assert whole["rank"].to_pylist() == list(range(1, 85))
    rows = whole.to_pylist()
    assert [(r["blade_index"], r["contact_name"]) for r in rows] == expected_order(rows)
    for size in (1, 7, 10, 84, 100):
        pages = [ranking.at(np.arange(84)[first : first + size]) for first in range(0, 84, size)]
        assert pa.concat_tables(pages).equals(whole), size
    scattered = np.array([0, 9, 10, 33, 83])
    assert ranking.at(scattered).equals(whole.take(scattered))
    assert ranking.at(np.zeros(0, int)).equals(SCHEMA.empty_table())
    assert [blade.index for blade in ranking.unscreened] == [7, 15, 23, 31, 39, 47]


def test_the_ranking_of_all_chunks_is_that_of_the_file(tmp_path):
    folder = job_in(tmp_path / "job")
    before = Rankings().of(folder)
    ended(folder)
    after = Rankings().of(folder)
    assert before.columns(SCHEMA.names).equals(after.columns(SCHEMA.names))
    assert before.unscreened == after.unscreened


def test_a_page_of_the_file_reads_the_rows_of_its_group_alone(tmp_path, monkeypatch):
    folder = job_in(tmp_path / "job", chunks=2, blades=ROWS_IN_GROUP)
    ended(folder)
    assert pq.ParquetFile(folder.path / FILE).num_row_groups == 4
    read = []
    group = pq.ParquetFile.read_row_group
    monkeypatch.setattr(pq.ParquetFile, "read_row_group", lambda file, i: read.append(i) or group(file, i))
    ranking = Rankings().of(folder)
    found = ranking.at(np.arange(ROWS_IN_GROUP - 5, ROWS_IN_GROUP + 5))
    assert found["rank"].to_pylist() == list(range(ROWS_IN_GROUP - 4, ROWS_IN_GROUP + 6))
    assert read == [0, 1]


def test_a_chunk_is_read_once_however_many_pages_are_asked_for(tmp_path, monkeypatch):
    folder = job_in(tmp_path / "job", chunks=3)
    read = []
    table_of = rankings.table_of
    monkeypatch.setattr(
        rankings, "table_of", lambda content, asked: read.append(1) or table_of(content, asked)
    )
    kept = Rankings()
    assert [kept.of(folder).rows for _ in range(5)] == [42] * 5
    assert len(read) == 3
    ChunkStore(folder.chunks).put(3, chunk(24, 7, np.random.default_rng(5)))
    ranking = kept.of(folder)
    assert (ranking.rows, len(read)) == (56, 4)
    assert ranking.columns(SCHEMA.names).equals(Rankings().of(folder).columns(SCHEMA.names))


def test_a_chunk_that_was_computed_again_replaces_the_one_that_rotted(tmp_path):
    folder, kept = job_in(tmp_path / "job", chunks=3), Rankings()
    kept.of(folder)
    next(path for path in folder.chunks.iterdir() if path.name.startswith("000001")).unlink()
    assert kept.of(folder).rows == 28
    ChunkStore(folder.chunks).put(1, chunk(8, 6, np.random.default_rng(6)))
    assert kept.of(folder).rows == 40
    assert sorted(set(kept.of(folder).columns(["blade_index"])["blade_index"].to_pylist()))[7] == 8


def test_what_is_kept_of_jobs_is_bounded_and_a_job_that_ended_is_not_kept(tmp_path):
    folders = [job_in(tmp_path / str(number)) for number in range(4)]
    one = Rankings()
    one.of(folders[0])
    kept = Rankings(most_bytes=int(2.5 * one.kept_bytes))
    for folder in (*folders, *folders):
        assert kept.of(folder).rows == 84
        assert kept.kept_bytes <= 2.5 * one.kept_bytes
    assert kept.kept_bytes > 1.5 * one.kept_bytes
    ended(folders[3])
    assert kept.of(folders[3]).complete and kept.kept_bytes < 1.5 * one.kept_bytes
    nothing = Rankings(most_bytes=0)
    assert nothing.of(folders[0]).rows == 84 and nothing.kept_bytes == 0


def test_who_gives_up_waiting_leaves_to_the_next_what_was_read(tmp_path, monkeypatch):
    folder, kept, turns = job_in(tmp_path / "job"), Rankings(), iter(range(100))

    def stop() -> None:
        if next(turns) == 4:
            raise Cancelled("the client hung up")

    with pytest.raises(Cancelled), interruptible(stop):
        kept.of(folder)
    read = []
    table_of = rankings.table_of
    monkeypatch.setattr(
        rankings, "table_of", lambda content, asked: read.append(1) or table_of(content, asked)
    )
    assert kept.of(folder).rows == 84 and len(read) == 2


def test_a_file_that_is_not_whole_is_named(tmp_path):
    folder = job_in(tmp_path / "job")
    ended(folder)
    content = (folder.path / FILE).read_bytes()
    (folder.path / FILE).write_bytes(content[: len(content) // 2])
    with pytest.raises(DamagedFile, match="retry the job"):
        Rankings().of(folder)
    middle = len(content) // 4
    (folder.path / FILE).write_bytes(content[:middle] + 200 * b"\xff" + content[middle + 200 :])
    with pytest.raises(DamagedFile, match="retry the job"):
        Rankings().of(folder).columns(SCHEMA.names)


def test_a_file_of_one_large_group_is_paged_too(tmp_path):
    """As older versions wrote it."""
    folder = job_in(tmp_path / "job")
    ended(folder)
    table = pq.read_table(folder.path / FILE, partitioning=None)
    pq.write_table(table, folder.path / FILE, row_group_size=10**6)
    found = Rankings().of(folder).at(np.arange(40, 50))
    assert found["rank"].to_pylist() == list(range(41, 51))

"""Chunks: what is stored comes back as it was, and what is not whole is found out."""

from __future__ import annotations

import numpy as np
import pytest

from sdm_core.blade import blade_to_dict, example_blade
from sdm_core.boundary import verdicts
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import DamagedFile
from service.jobs.chunk_store import ChunkStore
from service.jobs.screening import blade_lines
from service.jobs.screening.blade_lines import BladeLine
from service.jobs.screening.checks import blades_per_chunk, limits_of
from service.jobs.screening.chunk import chunk_payload, compute_chunk
from service.jobs.screening.chunk_content import ChunkContent, rows_of
from service.jobs.screening.request import Criteria, ScreeningRequest
from service.jobs.screening.watched import watching
from service.screening.screen import screen
from service.settings import Settings
from training.activation import active_id
from training.screening import Screener

EDGES = {"LE": ContactConfiguration.at("LE"), "TE": ContactConfiguration.at("TE")}
LIMITS = limits_of(Settings())


def request(**more) -> ScreeningRequest:
    asked = {"contacts": EDGES, "map_shape": (12, 9), "ke_liner": 5000.0, "model": active_id()} | more
    return ScreeningRequest(**asked)


def lines(*documents) -> list[BladeLine]:
    return [BladeLine(i, f"blades[{i}]", document) for i, document in enumerate(documents)]


@pytest.fixture(scope="module")
def rotor_37():
    return blade_to_dict(example_blade("nasa_rotor_37"))


@pytest.fixture(scope="module")
def stored(rotor_37) -> bytes:
    blades = lines(rotor_37, {"schema": "rubscreen/blade/1"}, rotor_37 | {"name": "again"})
    return compute_chunk(chunk_payload(request().to_dict(), blades, LIMITS))


def test_a_request_is_kept_whole():
    asked = request(
        speed_range=(0.1, 0.4),
        speed_unit="ratio",
        criteria=Criteria(least_margin=0.2),
        contacts={"arcs": ContactConfiguration.at("LE", arcs=[(0.9, 1.1)])},
    )
    assert ScreeningRequest.from_dict(asked.to_dict()) == asked


def test_a_chunk_holds_what_a_screening_of_the_same_blade_finds(stored, rotor_37):
    blade = example_blade("nasa_rotor_37")
    expected = screen([blade], EDGES, Screener.default(), map_shape=(12, 9), ke_liner=5000.0)
    content = ChunkContent.from_bytes(stored, blade_index=0)
    (found,) = content.screened
    for result in expected.results:
        (kept,) = (r for r in found.results if r.contact_name == result.contact_name)
        assert kept.to_dict() == result.to_dict()
        np.testing.assert_array_equal(kept.map.stable, result.map.stable)
        np.testing.assert_array_equal(kept.map.source, result.map.source)
        np.testing.assert_array_equal(kept.map.reason, result.map.reason)
        np.testing.assert_allclose(
            kept.map.unstable_probability, result.map.unstable_probability, rtol=1e-3, atol=1e-7
        )
        np.testing.assert_array_equal(kept.boundary.critical_ke, result.boundary.critical_ke)
        assert kept.boundary.unstable_ke == result.boundary.unstable_ke
        assert kept.critical_speeds == result.critical_speeds
        assert kept.map.certificate == result.map.certificate
        assert kept.verdict == result.verdict


def test_a_blade_that_cannot_be_screened_is_noted_and_stops_none(stored):
    rows, unscreened = rows_of(stored)
    assert [(row["blade_index"], row["contact_name"]) for row in rows] == [
        (0, "LE"),
        (0, "TE"),
        (2, "LE"),
        (2, "TE"),
    ]
    assert [(blade.index, blade.source) for blade in unscreened] == [(1, "blades[1]")]
    assert unscreened[0].reason.startswith("name = missing")


def test_the_same_chunk_is_the_same_bytes_whole_or_blade_by_blade(stored, rotor_37):
    blades = lines(rotor_37, {"schema": "rubscreen/blade/1"}, rotor_37 | {"name": "again"})
    asked = request().to_dict()
    parts = [
        ChunkContent.from_bytes(compute_chunk(chunk_payload(asked, [blade], LIMITS)))
        for blade in reversed(blades)
    ]
    assert ChunkContent.joined(parts).to_bytes() == stored


def test_a_chunk_that_is_not_whole_is_not_read(stored):
    for damaged in (b"", b"no npz", stored[: len(stored) // 2], stored[:-1], stored[::-1]):
        for read in (ChunkContent.from_bytes, rows_of):
            with pytest.raises(DamagedFile):
                read(damaged)


def test_a_stored_chunk_that_was_altered_is_taken_away_to_be_computed_again(tmp_path):
    store = ChunkStore(tmp_path / "chunks")
    assert store.numbers() == store.verified() == set()
    for number in range(3):
        store.put(number, b"content %d" % number)
    files = sorted((tmp_path / "chunks").iterdir())
    files[0].write_bytes(b"content 9")
    files[1].write_bytes(b"content")
    (tmp_path / "chunks" / ".incoming-1").write_bytes(b"half")
    (tmp_path / "chunks" / "notes.txt").write_bytes(b"not ours")
    with pytest.raises(DamagedFile, match="checksum"):
        store.read(0)
    assert store.verified() == store.numbers() == {2}
    assert store.read(2) == b"content 2"


def test_confident_answers_of_a_chunk_are_told_for_the_audit_and_no_others(stored):
    counted, drawn = [], []
    watching(counted.append, drawn.append)(stored)
    assert [result.contact_name for result in counted] == ["LE", "TE", "LE", "TE"]
    for result, answers in zip(counted, drawn, strict=True):
        sure = (result.map.source == "surrogate") & (result.map.reason == "confident")
        assert len(answers) == sure.sum() > 0
        assert (answers.model, answers.alpha) == (result.map.model, result.map.certificate.alpha)
        exact = verdicts(answers.blade, answers.contact, answers.speed_hz, answers.ke)
        np.testing.assert_array_equal(answers.stable, exact == 1.0)
    watching(counted.append, drawn.append)(b"not whole")  # is logged
    assert len(counted) == 4


def test_what_no_blade_can_meet_is_told_by_name():
    row = {
        "smallest_unstable_ke": 6000.0,
        "ke_max": 25000.0,
        "ke_liner": 5000.0,
        "proven": True,
        "unstable_share": 0.1,
    }
    asked = Criteria(least_ke=5000.0, least_margin=0.2, most_unstable_share=0.1)
    assert asked.missed(row) == []
    assert asked.missed(row | {"smallest_unstable_ke": 5999.0}) == ["least_margin"]
    assert asked.missed(row | {"smallest_unstable_ke": 4000.0, "unstable_share": 0.2}) == [
        "least_ke",
        "least_margin",
        "most_unstable_share",
    ]
    # No crossing up to ke_max is one above it; what is not proven counts for nothing.
    assert asked.missed(row | {"smallest_unstable_ke": None}) == []
    assert asked.missed(row | {"smallest_unstable_ke": None, "proven": False}) == ["least_ke", "least_margin"]
    assert Criteria().missed(row) is None


def test_chunks_are_shorter_where_blades_take_longer():
    arcs = {"arcs": ContactConfiguration.at("LE", arcs=[(0.0, 0.3)])}
    assert blades_per_chunk(request(), profiles=False) > blades_per_chunk(request(), profiles=True) >= 1
    assert blades_per_chunk(request(contacts=arcs), profiles=False) == 1


def test_blades_of_a_job_are_read_a_chunk_at_a_time_and_a_cut_file_is_named(tmp_path):
    wanted = lines(*({"name": str(i)} for i in range(5)))
    (tmp_path / blade_lines.FILE).write_bytes(blade_lines.encode(wanted))
    chunks = list(blade_lines.read_chunks(tmp_path, 2))
    assert [number for number, _ in chunks] == [0, 1, 2]
    assert [blade for _, part in chunks for blade in part] == wanted
    content = (tmp_path / blade_lines.FILE).read_bytes()
    (tmp_path / blade_lines.FILE).write_bytes(content[:-5])
    with pytest.raises(DamagedFile, match="restore it from a backup"):
        list(blade_lines.read(tmp_path))

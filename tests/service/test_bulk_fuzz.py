"""Damaged, cut and foreign binary bodies are refused with little memory, never as the service's fault."""

from __future__ import annotations

import io
import struct
import tracemalloc
import zipfile

import httpx
import numpy as np
import pyarrow as pa
import pytest
from bulk_bodies import FORMS, to_arrow, to_npz
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from sdm_core.errors import InvalidInput
from service.rest.forms.arrow_question import arrow_question
from service.rest.forms.media_types import ARROW, NPZ
from service.rest.forms.npz_question import npz_question
from service.rest.question_schemas import POINTS_EXAMPLE
from service.rest.questions import PointsQuestion
from service.settings import Settings
from service.sizes import TooLarge

READERS = {NPZ: npz_question, ARROW: arrow_question}
WHOLE = {
    NPZ: [to_npz(POINTS_EXAMPLE), to_npz(POINTS_EXAMPLE, compressed=True)],
    ARROW: [to_arrow(POINTS_EXAMPLE), to_arrow(POINTS_EXAMPLE, batch=1)],
}
SMALL = Settings(max_body_bytes=2**20)


def read(form: str, body: bytes, limits: Settings = SMALL) -> str:
    """What became of a body: read, or refused with a reason."""
    try:
        PointsQuestion.read(READERS[form](body, limits), limits)
    except InvalidInput as error:
        assert type(error).__name__ != "DamagedFile", "that is a fault of the service's own files"
        assert error.field and error.remedy
        return "refused"
    return "read"


def peak_of(form: str, body: bytes, limits: Settings = SMALL) -> tuple[str, int]:
    """What became of it, and the most memory it took: Python's and Arrow's."""
    read(form, WHOLE[form][0])  # what is loaded once is not the body's doing
    pool = pa.default_memory_pool()
    before = pool.bytes_allocated()
    tracemalloc.start()
    try:
        outcome = read(form, body, limits)
        return outcome, tracemalloc.get_traced_memory()[1] + max(0, pool.bytes_allocated() - before)
    finally:
        tracemalloc.stop()


@st.composite
def damaged(draw: st.DrawFn) -> tuple[str, bytes]:
    """A good body with bytes changed, taken away or put in."""
    form = draw(st.sampled_from(list(WHOLE)))
    body = bytearray(draw(st.sampled_from(WHOLE[form])))
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.integers(0, len(body)))
        what = draw(st.sampled_from(["bits", "number", "cut", "put in", "repeat"]))
        if what == "bits" and place < len(body):
            body[place] ^= draw(st.integers(1, 255))
        elif what == "number":
            number = draw(st.sampled_from([0, 1, 0x7FFFFFFF, 0xFFFFFFFF, 0x80000000, 0x10000]))
            body[place : place + 4] = struct.pack("<I", number)
        elif what == "cut":
            del body[place : place + draw(st.integers(1, len(body) or 1))]
        elif what == "put in":
            body[place:place] = draw(st.binary(max_size=40))
        else:
            body[place:place] = body[place : place + draw(st.integers(1, 200))]
    return form, bytes(body)


@given(damaged())
@settings(max_examples=600, deadline=None)
def test_a_damaged_body_is_read_or_refused(case):
    read(*case)


@given(damaged())
@settings(max_examples=60, deadline=None)
def test_a_damaged_body_takes_little_memory(case):
    _, peak = peak_of(*case)
    assert peak < 4 * SMALL.max_body_bytes


@given(st.sampled_from(list(WHOLE)), st.binary(max_size=300))
@example(ARROW, b"\xff\xff\xff\xff\0\0\0\0")
@example(NPZ, b"PK\x05\x06" + 18 * b"\0")
@settings(max_examples=200, deadline=None)
def test_bytes_that_are_something_else_are_refused(form, body):
    assert read(form, body) == "refused"


@pytest.mark.parametrize("form", FORMS)
def test_a_body_cut_off_anywhere_is_refused(form):
    for whole in WHOLE[form]:
        for end in range(0, len(whole), 7):
            assert read(form, whole[:end]) == "refused"
        assert read(form, whole) == "read"


@given(damaged())
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_body_over_http_is_never_a_fault_of_the_service(shared_address, case):
    form, body = case
    headers = {"Content-Type": form}
    answer = httpx.post(f"{shared_address}/v1/stability", content=body, headers=headers)
    assert answer.status_code in (200, 413, 422), answer.text


def a_bomb() -> bytes:
    return to_npz(POINTS_EXAMPLE, compressed=True, ke=np.zeros(2**24))


def test_an_archive_that_unpacks_to_a_thousand_times_its_size_is_refused_packed():
    body = a_bomb()
    assert len(body) < 2**18
    with pytest.raises(TooLarge, match="unpacked"):
        npz_question(body, SMALL)
    assert peak_of(NPZ, body)[1] < 2 * SMALL.max_body_bytes


def test_an_archive_that_lies_about_its_size_is_not_unpacked():
    body = bytearray(a_bomb())
    entry = body.rindex(b"PK\x01\x02", 0, body.index(b"ke.npy", body.index(b"PK\x01\x02")))
    body[entry + 24 : entry + 28] = struct.pack("<I", 1000)  # of 128 MiB
    outcome, peak = peak_of(NPZ, bytes(body))
    assert outcome == "refused" and peak < 4 * SMALL.max_body_bytes


@pytest.mark.parametrize("kind", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_compression_that_cannot_be_stopped_halfway_is_refused(kind):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", kind) as archive, np.load(io.BytesIO(WHOLE[NPZ][0])) as npz:
        for name in npz.files:
            with archive.open(f"{name}.npy", "w") as file:
                np.lib.format.write_array(file, npz[name])
    with pytest.raises(InvalidInput, match="bzip2"):
        npz_question(buffer.getvalue(), SMALL)


def test_an_archive_of_a_hundred_thousand_empty_entries_takes_no_memory():
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for i in range(20_000):
            archive.writestr(zipfile.ZipInfo(f"{i}.npy"), b"")
    outcome, peak = peak_of(NPZ, buffer.getvalue(), Settings())
    assert outcome == "refused" and peak < 2**20


def test_an_array_that_declares_more_than_is_there_gets_no_room():
    def npy(shape: str, descr: str = "<f8") -> bytes:
        said = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}"
        header = said.encode().ljust(117) + b"\n"
        return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header

    wrong = [("(10000000000,)", "<f8"), ("(1000000000000,)", "<U0"), ("(-1, -2)", "<f8"), ("()", "|O")]
    for shape, descr in wrong:
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w") as archive:
            archive.writestr("ke.npy", npy(shape, descr))
        outcome, peak = peak_of(NPZ, buffer.getvalue())
        assert outcome == "refused" and peak < 2**20


def test_python_objects_are_never_unpickled():
    class Harmful:
        def __reduce__(self):
            return pytest.fail, ("it was unpickled",)

    buffer = io.BytesIO()
    np.savez(buffer, question=np.array(Harmful(), dtype=object), allow_pickle=True)
    assert read(NPZ, buffer.getvalue()) == "refused"


@pytest.mark.parametrize("compression", ["lz4", "zstd"])
def test_a_compressed_table_is_refused_before_it_is_unpacked(compression):
    zeros = np.zeros(2**20)
    body = to_arrow(POINTS_EXAMPLE, batch=2**20, compression=compression, speed_hz=zeros, ke=zeros)
    pool = pa.default_memory_pool()
    before = pool.max_memory()
    with pytest.raises(InvalidInput, match="uncompressed"):
        arrow_question(body, Settings(max_points=2**21))
    assert pool.max_memory() == before


def test_a_schema_of_very_many_columns_is_refused_before_it_is_read():
    wide = pa.table({f"c{i}": pa.array([], pa.float64()) for i in range(5000)})
    nested = pa.table({"ke": pa.array([], pa.struct([(f"c{i}", pa.float64()) for i in range(5000)]))})
    said = pa.table({"ke": [1.0]}).replace_schema_metadata({str(i): "x" for i in range(5000)})
    for table in (wide, nested, said):
        sink = pa.BufferOutputStream()
        with pa.ipc.new_stream(sink, table.schema) as writer:
            writer.write_table(table)
        with pytest.raises(InvalidInput, match="schema with"):
            arrow_question(sink.getvalue().to_pybytes(), SMALL)


def test_rows_without_end_are_refused_while_they_are_counted():
    body = to_arrow(POINTS_EXAMPLE, batch=1, speed_hz=np.full(6000, 200.0), ke=np.ones(6000))
    with pytest.raises(InvalidInput, match="4096"):
        arrow_question(body, Settings())
    with pytest.raises(TooLarge):
        arrow_question(body, Settings(max_points=3000))

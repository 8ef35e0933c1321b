"""Files sent ahead: read in every form, and no way out of their folder."""

from __future__ import annotations

import io
import json
import zipfile

import pytest

from service.jobs.errors import DamagedUpload, NoRoom, NoSuchUpload, UploadTooLarge
from service.jobs.uploads import JSON, LINES, ZIP, Upload, Uploads

BLADES = [{"name": "a"}, {"name": "b"}]


@pytest.fixture
def uploads(tmp_path) -> Uploads:
    (tmp_path / "uploads").mkdir()
    return Uploads(tmp_path / "uploads", most_bytes=100_000, reserve_bytes=0)


def sent(
    uploads: Uploads, content: bytes, form: str, name: str = "batch", owner: str | None = "k1"
) -> Upload:
    writer = uploads.begin(len(content), owner)
    for start in range(0, len(content), 7):
        writer.write(content[start : start + 7])
    upload = writer.whole(name, form)
    writer.keep(upload)
    return upload


def zipped(**files: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("content", "form", "sources"),
    [
        (json.dumps(BLADES).encode(), JSON, ["batch[0]", "batch[1]"]),
        (b"\n".join(json.dumps(b).encode() for b in BLADES), LINES, ["batch:1", "batch:2"]),
        (
            zipped(**{"a.json": b'{"name": "a"}', "read.me": b"x", "sub/b.JSON": b'{"name": "b"}'}),
            ZIP,
            ["batch/a.json", "batch/sub/b.JSON"],
        ),
    ],
)
def test_blades_of_a_file_come_with_their_place_in_it(uploads, content, form, sources):
    upload = sent(uploads, content, form)
    assert uploads.get(upload.id, "k1") == upload
    found = list(uploads.documents(upload, 10))
    assert [source for source, _ in found] == sources
    assert [document for _, document in found] == BLADES
    with pytest.raises(UploadTooLarge, match="more than 1 blades"):
        list(uploads.documents(upload, 1))


def test_names_in_a_zip_lead_nowhere(uploads, tmp_path):
    evil = {"../../../out.json": b"{}", "/etc/out.json": b"{}", "..\\out.json": b"{}"}
    upload = sent(uploads, zipped(**evil), ZIP, name="../../name.zip")
    assert len(list(uploads.documents(upload, 10))) == 3
    everything = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert sorted(path.name for path in everything) == ["about.json", "content"]
    assert {path.parent.parent for path in everything} == {tmp_path / "uploads"}


@pytest.mark.parametrize("name", ["../jobs", "", "x", "..", "/etc/passwd", "A" * 32, "0" * 31 + "/", None, 5])
def test_no_identifier_is_a_path(uploads, name):
    with pytest.raises(NoSuchUpload):
        uploads.get(name, None)
    with pytest.raises(NoSuchUpload):
        uploads.remove(name, None)


def test_a_file_belongs_to_the_key_it_came_with(uploads):
    upload = sent(uploads, b"[]", JSON)
    with pytest.raises(NoSuchUpload):
        uploads.get(upload.id, "k2")
    assert uploads.get(upload.id, None) == upload
    uploads.remove(upload.id, "k1")
    with pytest.raises(NoSuchUpload):
        uploads.get(upload.id, "k1")


def test_a_bomb_is_not_unpacked(uploads):
    bomb = zipped(**{"a.json": b" " * 50_000_000})
    upload = sent(uploads, bomb, ZIP)
    with pytest.raises(UploadTooLarge, match="inflate"):
        list(uploads.documents(upload, 10))


def test_a_bomb_that_lies_about_its_size_is_cut_short(uploads):
    content = bytearray(zipped(**{"a.json": b'"' + b" " * 40_000_000 + b'"', "b.json": b"1" * 5000}))
    # The size in the central list and in the member's own head: 1,000 bytes, they say.
    for signature, offset in ((b"PK\x01\x02", 24), (b"PK\x03\x04", 22)):
        at = content.index(signature)
        content[at + offset : at + offset + 4] = (1000).to_bytes(4, "little")
    upload = sent(uploads, bytes(content), ZIP)
    with pytest.raises((UploadTooLarge, DamagedUpload)):
        list(uploads.documents(upload, 10))


@pytest.mark.parametrize(
    ("content", "form"),
    [
        (b"{", JSON),
        (b"\xff\xfe", JSON),
        (b"[" * 100_000, JSON),
        (b'{"name": 1}\n{"na', LINES),
        (b"PK no zip", ZIP),
        (zipped(a=b"{}"), ZIP),
        (zipped(**{"a.json": b"{"}), ZIP),
        (zipped(**{"a.json": b'{"name": "x"}' * 50})[:60], ZIP),
    ],
    # By words: a zip holds the time it was made, and test processes must agree on the names.
    ids=[
        "JSON cut off",
        "no UTF-8",
        "too deep",
        "a line cut off",
        "no zip",
        "a member that is no JSON file",
        "a member cut off",
        "a zip cut off",
    ],
)
def test_what_is_not_what_it_says_is_named(uploads, content, form):
    from sdm_core.errors import InvalidInput

    upload = sent(uploads, content[:100_000], form)
    with pytest.raises(InvalidInput) as refused:
        list(uploads.documents(upload, 10))
    assert refused.value.field.startswith("batch")


def test_too_much_is_refused_before_and_while_it_comes(uploads, tmp_path):
    with pytest.raises(UploadTooLarge):
        uploads.begin(100_001)
    writer = uploads.begin()
    writer.write(b"x" * 100_000)
    with pytest.raises(UploadTooLarge):
        writer.write(b"x")
    writer.abandon()
    assert list((tmp_path / "uploads").iterdir()) == []
    with pytest.raises(NoRoom):
        Uploads(tmp_path / "uploads", 10, reserve_bytes=2**62).begin()

"""A backup's file: what comes out is what went in, or nothing does."""

from __future__ import annotations

import hashlib
import io
import json
import os
import tarfile
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdm_core.errors import DamagedFile, InvalidInput
from service.backup.archive import MANIFEST, ArchiveWriter, extract
from service.backup.backup import backup
from service.backup.restore import restore
from service.records.database import RESTORING, open_database
from service.settings import Settings

CONTENTS = {
    "backup.json": b"{}",
    "data/jobs/0a/request.json": b"asked",
    "data/jobs/0a/chunks/0.npz": bytes(range(256)) * 5,
}


def written(contents: dict[str, bytes], folder: Path) -> bytes:
    """An archive of these files."""
    target = io.BytesIO()
    with (folder / "lines").open("w+b") as lines:
        archive = ArchiveWriter(target, lines)
        for name, content in contents.items():
            source = folder / "source"
            source.write_bytes(content)
            os.utime(source, (1e9, 1e9))
            archive.add(name, source)
        archive.close()
    return target.getvalue()


def unpacked(archive: bytes, folder: Path) -> dict[str, bytes]:
    folder.mkdir()
    with (folder.parent / f"{folder.name}-lines").open("w+b") as lines:
        extract(io.BytesIO(archive), folder, lines)
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return written(CONTENTS, tmp_path_factory.mktemp("archive"))


def test_what_was_packed_comes_out_with_its_times(archive, tmp_path):
    assert unpacked(archive, tmp_path / "out") == CONTENTS
    assert (tmp_path / "out" / "backup.json").stat().st_mtime == 1e9


@given(st.data())
def test_a_byte_altered_anywhere_is_found_or_changes_nothing(archive, tmp_path_factory, data):
    place = data.draw(st.integers(0, len(archive) - 1))
    altered = bytearray(archive)
    altered[place] ^= data.draw(st.integers(1, 255))
    out = tmp_path_factory.mktemp("altered") / "out"
    try:
        found = unpacked(bytes(altered), out)
    except DamagedFile:
        return
    assert found == CONTENTS


@given(st.data())
def test_a_backup_cut_off_anywhere_is_refused(archive, tmp_path_factory, data):
    # Behind its list a tar has only zeros.
    end = archive.index(MANIFEST.encode()) + 512
    out = tmp_path_factory.mktemp("short") / "out"
    with pytest.raises(DamagedFile):
        unpacked(archive[: data.draw(st.integers(0, end))], out)


def crafted(*members: tuple[tarfile.TarInfo, bytes]) -> bytes:
    """An archive made to do harm: its list is right."""
    target, lines = io.BytesIO(), b""
    with tarfile.open(fileobj=target, mode="w") as tar:
        for member, content in members:
            member.size = len(content)
            tar.addfile(member, io.BytesIO(content))
            entry = {
                "name": member.name,
                "size": len(content),
                "mtime": 0,
                "sha256": hashlib.sha256(content).hexdigest(),
            }
            lines += json.dumps(entry).encode() + b"\n"
        listed = tarfile.TarInfo(MANIFEST)
        listed.size = len(lines)
        tar.addfile(listed, io.BytesIO(lines))
    return target.getvalue()


def test_a_crafted_archive_of_plain_files_is_taken(tmp_path):
    # The others below are refused for what is wrong with them, not for how they are made.
    assert unpacked(crafted((tarfile.TarInfo("data/a"), b"a")), tmp_path / "out") == {"data/a": b"a"}


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../out", "data/../../out", "data/./a", "data//a", "a\\b", ".", "a" * 1001]
)
def test_names_that_lead_elsewhere_are_refused(tmp_path, name):
    with pytest.raises(DamagedFile):
        unpacked(crafted((tarfile.TarInfo(name), b"harm")), tmp_path / "out")
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [tmp_path / "out-lines"]


@pytest.mark.parametrize(
    "kind",
    [tarfile.CONTTYPE, tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.FIFOTYPE, tarfile.CHRTYPE, tarfile.DIRTYPE],
)
def test_what_is_no_plain_file_is_refused(tmp_path, kind):
    member = tarfile.TarInfo("data/link")
    member.type, member.linkname = kind, "/etc/passwd"
    with pytest.raises(DamagedFile):
        unpacked(crafted((member, b"")), tmp_path / "out")


def test_a_backup_that_lacks_a_file_of_its_list_is_refused(tmp_path):
    whole = crafted((tarfile.TarInfo("a"), b"1"), (tarfile.TarInfo("b"), b"2"))
    lacking = whole[:1024] + whole[2048:]  # without the header and the content of b
    with pytest.raises(DamagedFile, match="missing"):
        unpacked(lacking, tmp_path / "out")


def test_a_file_that_is_there_twice_is_refused(tmp_path):
    with pytest.raises(DamagedFile, match="twice"):
        unpacked(crafted((tarfile.TarInfo("a"), b"1"), (tarfile.TarInfo("a"), b"1")), tmp_path / "out")


def test_a_log_that_grows_while_it_is_copied_is_copied_as_it_was(tmp_path):
    log, target = tmp_path / "log.jsonl", io.BytesIO()
    log.write_bytes(b"first\n" * 1000)

    def grows(size: int) -> None:
        with log.open("ab") as file:
            file.write(b"later\n")

    with (tmp_path / "lines").open("w+b") as lines:
        archive = ArchiveWriter(target, lines, grows)
        archive.add("log", log)
        archive.close()
    assert unpacked(target.getvalue(), tmp_path / "out") == {"log": b"first\n" * 1000}


def test_memory_stays_flat_over_many_files(tmp_path):
    source = tmp_path / "source"
    source.write_bytes(b"chunk")

    def peak(files: int) -> int:
        path, out = tmp_path / f"{files}.tar", tmp_path / f"{files}"
        out.mkdir()
        tracemalloc.start()
        with path.open("wb") as target, (tmp_path / "lines").open("w+b") as lines:
            archive = ArchiveWriter(target, lines)
            for i in range(files):
                archive.add(f"data/{i:06d}", source)
            archive.close()
        with path.open("rb") as target, (tmp_path / "lines").open("w+b") as lines:
            assert extract(target, out, lines) == files
        high = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return high

    peak(10)
    assert peak(3000) < peak(300) + 300_000  # a list of members would be a kilobyte each


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A data folder with something in it."""
    folder = tmp_path / "data"
    open_database(folder).close()
    for name in ("jobs/0a/chunks", "uploads/0b", "models/m1", "scratch/dask"):
        (folder / name).mkdir(parents=True)
    for name in (
        "jobs/0a/request.json",
        "jobs/0a/chunks/0.npz",
        "uploads/0b/content",
        "models/m1/card.json",
        "models/active",
    ):
        (folder / name).write_text(name)
    for name in ("scratch/dask/x", "models/.lock", "jobs/0a/chunks/.incoming-1", "models/x.1.partial"):
        (folder / name).write_text("not kept")
    return folder


def _tree(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and not path.name.startswith("rubscreen.sqlite")
    }


def test_everything_but_what_is_half_made_is_restored(data, tmp_path):
    made = backup(Settings(data_folder=data), tmp_path / "b.tar")
    assert (tmp_path / "b.tar").stat().st_mode & 0o077 == 0
    done = restore(tmp_path / "b.tar", tmp_path / "new")
    assert done.files == made.files == 6
    kept = {name: content for name, content in _tree(data).items() if content != b"not kept"}
    kept.pop(".retention.lock", None)
    assert _tree(tmp_path / "new") == kept
    assert (tmp_path / "new" / "rubscreen.sqlite").is_file()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["b.tar", "data", "new"]


def test_models_and_answers_kept_elsewhere_are_restored_into_the_data_folder(data, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    for name in ("models/m2", "datasets", "answers"):
        (elsewhere / name).mkdir(parents=True)
        (elsewhere / name / "file").write_text(name)
    settings = Settings(
        data_folder=data, models_folder=elsewhere / "models", served_answers_folder=elsewhere / "answers"
    )
    backup(settings, tmp_path / "b.tar")
    done = restore(tmp_path / "b.tar", tmp_path / "new")
    tree = _tree(tmp_path / "new")
    assert tree["models/m2/file"] == b"models/m2"
    assert tree["datasets/file"] == b"datasets"
    assert tree["answers/file"] == b"answers"
    assert "models/m1/card.json" not in tree
    assert done.answers == tmp_path / "new" / "answers"


def test_a_damaged_backup_leaves_nothing_behind(data, tmp_path):
    backup(Settings(data_folder=data), tmp_path / "b.tar")
    content = bytearray((tmp_path / "b.tar").read_bytes())
    content[content.index(b"models/m1/card.json", 600)] ^= 1
    (tmp_path / "bad.tar").write_bytes(content)
    (tmp_path / "empty").mkdir()
    for folder in ("new", "empty"):
        with pytest.raises(DamagedFile):
            restore(tmp_path / "bad.tar", tmp_path / folder)
    assert not (tmp_path / "new").exists()
    assert list((tmp_path / "empty").iterdir()) == []


def test_a_folder_that_is_not_empty_is_never_touched(data, tmp_path):
    backup(Settings(data_folder=data), tmp_path / "b.tar")
    before = _tree(data)
    with pytest.raises(InvalidInput, match="not empty"):
        restore(tmp_path / "b.tar", data)
    assert _tree(data) == before


def test_a_restore_that_was_killed_is_refused_by_a_service_and_done_again(data, tmp_path):
    backup(Settings(data_folder=data), tmp_path / "b.tar")
    new = tmp_path / "new"
    (new / RESTORING / "data").mkdir(parents=True)
    with pytest.raises(InvalidInput, match="restore"):
        open_database(new)
    restore(tmp_path / "b.tar", new)
    open_database(new).close()
    assert not (new / RESTORING).exists()


@pytest.mark.parametrize("place", ["data/b.tar", "data/jobs/b.tar", "there.tar", "nowhere/b.tar"])
def test_a_backup_goes_to_a_new_file_outside_of_what_it_copies(data, tmp_path, place):
    (tmp_path / "there.tar").write_bytes(b"an older backup")
    before = _tree(tmp_path)
    with pytest.raises(InvalidInput, match="FILE"):
        backup(Settings(data_folder=data), tmp_path / place)
    assert _tree(tmp_path) == before


def test_a_backup_of_sqlite_does_not_go_into_postgresql(data, tmp_path):
    backup(Settings(data_folder=data), tmp_path / "b.tar")
    with pytest.raises(InvalidInput, match="database_url"):
        restore(tmp_path / "b.tar", tmp_path / "new", f"sqlite:///{tmp_path}/other.sqlite")
    assert not (tmp_path / "new").exists()


def test_a_damaged_database_is_found_when_it_is_backed_up(data, tmp_path):
    path = data / "rubscreen.sqlite"
    content = bytearray(path.read_bytes())
    content[4096:] = b"\xff" * (len(content) - 4096)
    path.write_bytes(content)
    with pytest.raises(InvalidInput, match="database"):
        backup(Settings(data_folder=data), tmp_path / "b.tar")
    assert not (tmp_path / "b.tar").exists()

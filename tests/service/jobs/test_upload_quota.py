"""The files of one key take up so much and no more; nobody else's count."""

from __future__ import annotations

import threading
from pathlib import Path

import httpx
import pytest

from service.app import create_app
from service.jobs.errors import TooManyUploads
from service.jobs.uploads import LINES, Upload, Uploads
from service.records.database import open_database
from service.records.keys import KeyStore
from service.roles import Role
from service.settings import Settings


@pytest.fixture
def uploads(tmp_path: Path) -> Uploads:
    (tmp_path / "uploads").mkdir()
    return Uploads(tmp_path / "uploads", most_bytes=1000, reserve_bytes=0, most_bytes_of_owner=2000)


def sent(uploads: Uploads, size: int, name: str, owner: str | None = "k1") -> Upload:
    writer = uploads.begin(owner=owner)
    try:
        writer.write(b"\n" * size)
        upload = writer.whole(name, LINES)
        writer.keep(upload)
        return upload
    except BaseException:
        writer.abandon()
        raise


def names(tmp_path: Path) -> int:
    return len(list((tmp_path / "uploads").iterdir()))


def test_a_file_too_many_is_refused_and_nothing_is_left_of_it(uploads, tmp_path):
    first, second = sent(uploads, 900, "a"), sent(uploads, 1000, "b")
    with pytest.raises(TooManyUploads, match="DELETE /v1/uploads/ID") as refused:
        sent(uploads, 101, "c")
    assert "1,900 bytes are kept, 101 came" in refused.value.value
    assert [entry["id"] for entry in refused.value.members["uploads"]] == [second.id, first.id]
    assert names(tmp_path) == 2
    assert sent(uploads, 100, "c").size_bytes == 100


def test_room_comes_back_with_a_file_that_is_deleted_by_whomever(uploads, tmp_path):
    first = sent(uploads, 1000, "a")
    sent(uploads, 1000, "b")
    with pytest.raises(TooManyUploads):
        sent(uploads, 1, "c")
    another = Uploads(tmp_path / "uploads", 1000, 0, 2000)  # of another replica
    another.remove(first.id, "k1")
    sent(uploads, 1000, "c")
    with pytest.raises(TooManyUploads):
        sent(another, 1, "d")


def test_the_same_file_sent_again_takes_up_nothing_more(uploads):
    kept = sent(uploads, 1000, "a"), sent(uploads, 1000, "b")
    assert sent(uploads, 1000, "a") == kept[0]


def test_each_owner_has_a_quota_of_its_own_and_who_needs_no_key_has_none(uploads):
    for owner in ("k1", "k2"):
        for name in ("a", "b"):
            sent(uploads, 1000, name, owner)
    for i in range(5):
        sent(uploads, 1000, str(i), None)
    with pytest.raises(TooManyUploads, match="for key k2"):
        sent(uploads, 1, "c", "k2")


def test_without_a_quota_there_is_none(tmp_path):
    (tmp_path / "uploads").mkdir()
    uploads = Uploads(tmp_path / "uploads", most_bytes=1000, reserve_bytes=0)
    assert len({sent(uploads, 1000, str(i)).id for i in range(5)}) == 5


def test_files_on_their_way_are_no_more_than_may_be_kept(uploads):
    writers = [uploads.begin(owner="k1") for _ in range(3)]
    for writer in writers[:2]:
        writer.write(1000 * b"\n")
    with pytest.raises(TooManyUploads, match="are arriving"):
        writers[2].write(b"\n")
    for writer in writers:
        writer.abandon()
    assert sent(uploads, 1000, "a").size_bytes == 1000


def test_of_files_that_come_at_the_same_time_no_more_are_kept_than_there_is_room_for(tmp_path):
    (tmp_path / "uploads").mkdir()
    uploads = Uploads(tmp_path / "uploads", most_bytes=1000, reserve_bytes=0, most_bytes_of_owner=8000)
    begun = [uploads.begin(owner="k1") for _ in range(8)]
    sent(uploads, 1000, "x", "k1")
    refused = []

    def finish(i: int) -> None:
        begun[i].write(bytes([65 + i]) * 1000)
        try:
            begun[i].keep(begun[i].whole(str(i), LINES))
        except TooManyUploads:
            refused.append(i)
            begun[i].abandon()

    threads = [threading.Thread(target=finish, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(refused) == 1 and names(tmp_path) == 8


def test_over_rest_it_is_a_problem_that_lists_what_could_go(serving, screener, tmp_path, problem):
    database = open_database(tmp_path)
    store = KeyStore(database)
    keys = [{"X-API-Key": store.create("office", Role.submit)[1]} for _ in range(2)]
    database.close()
    settings = Settings(data_folder=tmp_path, auth="on", run_jobs=False, max_uploads_bytes=1000)

    def send(key: dict[str, str], name: str) -> httpx.Response:
        headers = key | {"Content-Type": "application/x-ndjson"}
        return http.post(f"/v1/uploads?name={name}", content=b"{}" + 598 * b"\n", headers=headers)

    app = create_app(settings, screener=screener)
    with serving(app) as url, httpx.Client(base_url=url, timeout=20.0) as http:
        kept = send(keys[0], "a").json()
        refused = problem(send(keys[0], "b"), 507, "uploads")
        assert refused["type"] == "urn:rubscreen:problem:upload-quota"
        assert refused["uploads"] == [{"id": kept["id"], "name": "a", "size_bytes": 600}]
        assert send(keys[1], "b").status_code == 201
        assert http.delete(f"/v1/uploads/{kept['id']}", headers=keys[0]).status_code == 204
        assert send(keys[0], "b").status_code == 201

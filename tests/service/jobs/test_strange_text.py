"""Text that no database holds, in every place where a request has text: named as wrong, and never a 5xx."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator
from urllib.parse import quote

import httpx
import pytest
from postgres_server import needs_postgres
from sqlalchemy.exc import DataError, InterfaceError, OperationalError, ProgrammingError, TimeoutError

from service.app import create_app
from service.jobs.errors import DamagedUpload
from service.jobs.uploads import JSON, LINES, ZIP, Upload, Uploads, UploadWriter
from service.records.database import does_not_answer, is_out_of_room
from service.settings import Settings

# A half surrogate pair, percent-encoded and as JSON writes it, is no UTF-8.
TEXTS = ["\x00", "a\x00b", "\ud800", "x" * 5000, "é" * 201, "', '", "%", "\u202e\U0001f600"]
NONE = "0" * 32
NAMED = ["nul", "nul within", "half a pair", "long", "long in bytes", "quotes", "percent", "right to left"]


def in_url(text: str) -> str:
    return quote(text.encode("utf-8", "surrogatepass"), safe="")


@pytest.fixture(scope="module", params=["sqlite", pytest.param("postgresql", marks=needs_postgres)])
def http(request, serving, tmp_path_factory, new_screener) -> Iterator[httpx.Client]:
    """A service that takes jobs and runs none, on each kind of database."""
    from postgres_server import empty_database

    data = tmp_path_factory.mktemp("data")

    def served(url: str | None) -> Iterator[httpx.Client]:
        settings = Settings(data_folder=data, database_url=url, run_jobs=False, max_name_length=5000)
        app = create_app(settings, screener=new_screener())
        with serving(app) as where, httpx.Client(base_url=where, timeout=30.0) as client:
            yield client

    if request.param == "sqlite":
        yield from served(None)
    else:
        with empty_database(request.getfixturevalue("postgres")) as url:
            yield from served(url)


def refused(reply: httpx.Response) -> None:
    assert 400 <= reply.status_code < 500, (reply.status_code, reply.text)
    assert reply.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize("text", TEXTS, ids=NAMED)
def test_no_text_in_an_address_is_a_job(http, text):
    for kind in ("screenings", "trainings"):
        for query in ("after", "state", "limit"):
            refused(http.get(f"/v1/{kind}?{query}={in_url(text)}"))
        where = f"/v1/{kind}/{in_url(text)}"
        for path in ("", "/events"):
            refused(http.get(where + path))
        refused(http.delete(where))
        refused(http.post(where + "/retry"))
    refused(http.get(f"/v1/trainings/{in_url(text)}/result"))
    for path in ("results", "report", f"blades/{in_url(text)}/map.png?contact=LE", "blades/0/boundaries.png"):
        refused(http.get(f"/v1/screenings/{in_url(text)}/{path}"))
    refused(http.get(f"/v1/screenings/{NONE}/results?contact={in_url(text)}"))
    refused(http.delete(f"/v1/uploads/{in_url(text)}"))


@pytest.mark.parametrize("text", TEXTS, ids=NAMED)
def test_a_job_has_a_name_that_every_database_holds_or_is_refused_for_it(http, text):
    bodies = {
        "/v1/trainings": {"name": text, "rounds": 0},
        "/v1/screenings": {"name": text, "blades": [{"example": "nasa_rotor_37"}], "policy": "exact"},
    }
    for path, body in bodies.items():
        reply = http.post(path, content=json.dumps(body), headers={"Content-Type": "application/json"})
        if text in ("', '", "%", "\u202e\U0001f600"):
            assert reply.status_code == 202, reply.text
            assert http.get(reply.headers["location"]).json()["name"] == text
        else:
            refused(reply)
            assert reply.json()["field"] == ("body" if text == "\ud800" else "name")


@pytest.mark.parametrize("text", TEXTS, ids=NAMED)
def test_no_such_text_is_a_schedule_or_an_idempotency_key(http, text):
    for body in ({"cron": text}, {"cron": "0 3 * * *", "timezone": text}):
        reply = http.put(
            "/v1/trainings/schedule", content=json.dumps(body), headers={"Content-Type": "application/json"}
        )
        refused(reply)
    if text.isascii() and "\x00" not in text and text not in ("', '", "%"):
        refused(http.post("/v1/trainings", json={}, headers={"Idempotency-Key": text}))
    assert http.get("/v1/trainings/schedule").json()["cron"] is None


@pytest.mark.parametrize("text", TEXTS, ids=NAMED)
def test_a_file_may_have_any_name_and_is_no_path(http, text):
    where = f"/v1/uploads?name={in_url(text)}"
    reply = http.post(where, content=b"[{}]", headers={"Content-Type": "application/json"})
    if len(text) > 5000:
        refused(reply)
    else:
        assert reply.status_code == 201, reply.text
        assert http.delete(f"/v1/uploads/{reply.json()['id']}").status_code == 204


def _kept(writer: UploadWriter, name: str, form: str) -> Upload:
    upload = writer.whole(name, form)
    writer.keep(upload)
    return upload


def test_half_a_surrogate_pair_in_a_file_is_found_when_the_job_is_accepted(tmp_path):
    """Not when its ranking is written, after all of the work."""
    (tmp_path / "uploads").mkdir()
    uploads = Uploads(tmp_path / "uploads", most_bytes=10_000, reserve_bytes=0)
    half, whole = b'{"name": "\\uD800"}', b'{"name": "\\ud83d\\ude00"}'
    zipped = io.BytesIO()
    with zipfile.ZipFile(zipped, "w") as archive:
        archive.writestr("a.json", half)
    for content, form in (
        (b"[" + half + b"]", JSON),
        (whole + b"\n" + half, LINES),
        (zipped.getvalue(), ZIP),
    ):
        writer = uploads.begin()
        writer.write(content)
        with pytest.raises(DamagedUpload, match="surrogates not allowed"):
            list(uploads.documents(_kept(writer, "batch", form), 10))
    writer = uploads.begin()
    writer.write(whole)
    assert list(uploads.documents(_kept(writer, "batch", JSON), 10)) == [("batch", {"name": "\U0001f600"})]


def test_a_zip_whose_names_are_no_text_is_named(tmp_path):
    (tmp_path / "uploads").mkdir()
    uploads, content = Uploads(tmp_path / "uploads", most_bytes=10_000, reserve_bytes=0), io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("é.json", b"{}")
    writer = uploads.begin()
    writer.write(content.getvalue().replace("é".encode(), b"\xff\xfe"))
    with pytest.raises(DamagedUpload, match="send a whole zip"):
        list(uploads.documents(_kept(writer, "batch", ZIP), 10))


@pytest.mark.parametrize(
    ("error", "away"),
    [
        (OperationalError("select", {"name": "the disk is full"}, Exception("server closed")), True),
        (InterfaceError("select", {}, Exception("the connection is closed")), True),
        (TimeoutError("QueuePool limit"), True),
        (DataError("insert", {"name": "full"}, Exception("text fields cannot contain NUL")), False),
        (ProgrammingError("select", {}, Exception("no such table")), False),
    ],
)
def test_only_a_database_that_is_away_does_not_answer(error, away):
    assert does_not_answer(error) is away
    assert not is_out_of_room(error)


def test_a_full_disk_is_told_by_the_database_not_by_what_was_asked():
    assert is_out_of_room(OperationalError("insert", {}, Exception("database or disk is full")))
    cause = Exception("could not extend file")
    cause.sqlstate = "53100"  # type: ignore[attr-defined]
    assert is_out_of_room(OperationalError("insert", {}, cause))

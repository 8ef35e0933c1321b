"""Ready means that an answer would be given, kept and trusted; asking costs next to nothing."""

from __future__ import annotations

import shutil
import threading
from types import SimpleNamespace

import anyio
import httpx
import pytest

from service.app import create_app
from service.operation.draining import Draining
from service.operation.readiness import Check, DatabaseCheck, KeptCheck, disk_check
from service.records.database import Database
from service.settings import Settings


@pytest.fixture
def serve(serving, screener, tmp_path):
    """A client of a service with a data folder and the settings given."""

    def served(**settings):
        return serving(create_app(Settings(data_folder=tmp_path, **settings), screener=screener))

    return served


def test_a_service_with_a_data_folder_looks_at_database_and_disk(serve):
    with serve() as url:
        checks = httpx.get(f"{url}/readyz", timeout=20.0).json()["checks"]
    assert list(checks) == ["self_check", "disk", "database"]
    assert all(check["ok"] and check["needed"] for check in checks.values())


def test_a_service_whose_database_is_away_is_not_ready_until_it_is_back(serve, monkeypatch, problem):
    monkeypatch.setattr(KeptCheck.__init__, "__defaults__", (0.0,))
    with serve() as url, httpx.Client(base_url=url, timeout=20.0) as http:
        with monkeypatch.context() as away:
            away.setattr(Database, "answers", lambda self: False)
            problem(http.get("/readyz"), 503, "database")
            assert http.get("/healthz").status_code == 200
        assert http.get("/readyz").status_code == 200


def test_a_service_without_room_for_what_jobs_write_is_not_ready(serve, tmp_path, problem):
    there = shutil.disk_usage(tmp_path).free
    with serve(min_free_bytes=10 * there) as url, httpx.Client(base_url=url, timeout=20.0) as http:
        document = problem(http.get("/readyz"), 503, "disk")
    assert str(tmp_path) in document["value"] and "make room" in document["remedy"]


def test_a_data_folder_that_is_gone_is_no_room(tmp_path):
    assert not disk_check(tmp_path / "gone", 0).ok
    assert disk_check(tmp_path, 0).ok


def test_a_thousand_probes_ask_the_model_once_in_a_while(own_http, screener):
    asked, points = [], type(screener).points
    screener.points = lambda *a, **k: (asked.append(1), points(screener, *a, **k))[1]
    for _ in range(1000):
        assert own_http.get("/readyz").status_code == 200
    # Twice for a check, which holds for a second: even a minute for all of it makes no more than this.
    assert 2 <= len(asked) <= 120


def test_those_who_ask_at_the_same_time_share_one_check():
    made = []

    async def slow() -> Check:
        made.append(1)
        await anyio.sleep(0.05)
        return Check(True, "well")

    async def ask() -> None:
        check = KeptCheck(slow, keep_s=3600.0)
        async with anyio.create_task_group() as group:
            for _ in range(50):
                group.start_soon(check)
        assert (await check()).ok

    anyio.run(ask)
    assert len(made) == 1


def test_what_was_found_is_found_anew_once_it_is_old():
    found = iter([Check(True, "well"), Check(False, "away")])

    async def next_one() -> Check:
        return next(found)

    async def ask() -> list[bool]:
        check = KeptCheck(next_one, keep_s=0.0)
        return [(await check()).ok for _ in range(2)]

    assert anyio.run(ask) == [True, False]


def test_a_database_that_never_answers_keeps_one_thread_and_no_probe_waiting():
    free, asked = threading.Event(), []

    def answers() -> bool:
        asked.append(1)
        return free.wait(30.0)

    async def ask() -> list[bool]:
        check = DatabaseCheck(SimpleNamespace(answers=answers, shown="db"), patience_s=0.05)
        hung = [(await check()).ok for _ in range(10)]
        free.set()
        while check._asking.locked():
            await anyio.sleep(0.01)
        return [*hung, (await check()).ok]

    assert anyio.run(ask) == [False] * 10 + [True]
    assert len(asked) == 2


def test_a_service_about_to_stop_says_so_and_answers_all_the_same(serving, screener, question, problem):
    draining = Draining()
    app = create_app(screener=screener, draining=draining)
    with serving(app) as url, httpx.Client(base_url=url, timeout=20.0) as http:
        before = http.post("/v1/stability", json=question())
        assert http.get("/readyz").status_code == 200 and "connection" not in before.headers
        draining.begun = True
        leaving = http.get("/readyz")
        assert problem(leaving, 503, "service")["type"] == "urn:rubscreen:problem:draining"
        answers = [http.post("/v1/stability", json=question()), http.get("/healthz"), leaving]
        assert [answer.headers["connection"] for answer in answers] == ["close"] * 3
        assert answers[0].json() == before.json()
        assert "rubscreen_draining 1.0" in http.get("/metrics").text

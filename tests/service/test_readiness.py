"""Ready means that an answer would be given, kept and trusted; asking costs next to nothing."""

from __future__ import annotations

import shutil
import threading
from types import SimpleNamespace

import anyio
import httpx
import pytest
from anyio import to_thread

from service.app import create_app
from service.operation.draining import Draining
from service.operation.readiness import Check, KeptCheck, database_check, disk_check, folder_check
from service.records.database import Database, open_database
from service.records.keys import ApiKey, KeyStore, split_key
from service.rest.desk import Desk
from service.rest.errors import NotReady
from service.rest.key_check import KeyCheck
from service.rest.readiness import Readiness
from service.roles import Role
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
        check = database_check(SimpleNamespace(answers=answers, shown="db"), patience_s=0.05)
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


def test_a_folder_that_hangs_is_no_room(tmp_path, monkeypatch):
    free = threading.Event()
    monkeypatch.setattr("service.operation.readiness.disk_check", lambda *asked: free.wait(30.0))

    async def ask() -> Check:
        return await folder_check(tmp_path, 0, patience_s=0.05)()

    found = anyio.run(ask)
    free.set()
    assert not found.ok and str(tmp_path) in found.detail


def test_a_service_all_of_whose_threads_are_taken_is_ready_and_lets_keys_in(screener, tmp_path):
    free = threading.Event()
    desk = Desk.opened(Settings(data_folder=tmp_path, run_jobs=False), screener)
    key, text = KeyStore(desk.database).create("office", Role.read)

    async def ask() -> tuple[list[str], str]:
        threads = to_thread.current_default_thread_limiter()
        async with anyio.create_task_group() as group:
            for _ in range(int(threads.total_tokens)):  # uploads to a disk that hangs, say
                group.start_soon(to_thread.run_sync, free.wait)
            while threads.available_tokens:
                await anyio.sleep(0.01)
            try:
                with anyio.fail_after(20.0):
                    checks = await Readiness(desk, Draining()).checks()
                    return list(checks), (await desk.access.keys.check(text)).id
            finally:
                free.set()

    try:
        assert anyio.run(ask) == (["self_check", "disk", "database"], key.id)
    finally:
        desk.close()


def test_a_database_that_swallows_questions_refuses_keys_in_time_and_knows_them_when_it_is_back(
    tmp_path, monkeypatch
):
    database, free, asked, find = open_database(tmp_path), threading.Event(), [], KeyStore.find
    store = KeyStore(database)
    texts = [store.create(f"tool {i}", Role.read)[1] for i in range(10)]

    def hangs(self: KeyStore, key_id: str) -> ApiKey | None:
        asked.append(key_id)
        free.wait(60.0)
        return find(self, key_id)

    async def ask() -> None:
        keys = KeyCheck(store, patience_s=1.0)

        async def refused(text: str) -> None:
            with pytest.raises(NotReady, match="does not answer"):
                await keys.check(text)

        with anyio.fail_after(20.0):  # ten, one after the other, and then two at the same time
            async with anyio.create_task_group() as group:
                for text in texts:
                    group.start_soon(refused, text)
            await refused(texts[0])
        assert len(asked) <= 2  # however many wait, no more threads than that hang
        free.set()
        for text in texts:
            assert (await keys.check(text)).opened_by(split_key(text)[1])
        keys.close()

    monkeypatch.setattr(KeyStore, "find", hangs)
    anyio.run(ask)
    database.close()

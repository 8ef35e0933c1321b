"""Who sends too much is told when to come back, and can."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from threading import Semaphore
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdm_core.errors import InvalidInput
from service.app import create_app
from service.records.database import open_database
from service.records.keys import KeyLimits, KeyStore
from service.rest import rate_limits
from service.rest.access import ANONYMOUS, Caller
from service.rest.gate import Access, Gate
from service.rest.job_quota import JobQuota, TooManyJobs
from service.rest.rate_limits import Allowance, RateLimits, TooManyRequests
from service.roles import Role
from service.settings import Settings

GAPS = st.lists(st.floats(0.0, 40.0) | st.just(0.0), min_size=1, max_size=120)


class Clock:
    """A time that stands still until it is told."""

    def __init__(self) -> None:
        self.now = 1e6

    def __call__(self) -> float:
        return self.now


def _passes(limits: RateLimits, per_minute: int) -> bool:
    try:
        limits.take("me", per_minute)
    except TooManyRequests:
        return False
    return True


@given(GAPS, st.integers(1, 20))
def test_who_keeps_to_so_many_in_every_minute_is_never_refused(gaps, per_minute):
    clock = Clock()
    limits, sent = RateLimits(clock), []
    for gap in gaps:
        clock.now += gap
        if sum(at > clock.now - 60.0 for at in sent) < per_minute:
            assert _passes(limits, per_minute)
            sent.append(clock.now)


@given(GAPS, st.integers(1, 20))
def test_nobody_gets_more_answered_than_a_full_bucket_and_what_flows_in(gaps, per_minute):
    clock = Clock()
    limits, sent = RateLimits(clock), []
    for gap in gaps:
        clock.now += gap
        if _passes(limits, per_minute):
            sent.append(clock.now)
    for i, first in enumerate(sent):
        for j in range(i, len(sent)):
            assert j - i + 1 <= per_minute * (1 + (sent[j] - first) / 60.0) + 1e-3


@given(GAPS, st.integers(1, 400))
def test_waiting_as_long_as_told_succeeds_and_half_a_second_less_a_second_does_not(gaps, per_minute):
    clock = Clock()
    limits = RateLimits(clock)
    while _passes(limits, per_minute):
        clock.now += gaps[len(gaps) // 2] / 1000
    for gap in gaps:
        clock.now += gap
        try:
            limits.take("me", per_minute)
        except TooManyRequests as refused:
            told = refused.retry_after_s
            assert isinstance(told, int) and told >= 1 and refused.headers == {"Retry-After": str(told)}
            clock.now += max(0.0, told - 1.0) - 1e-3  # the shortest whole number of seconds
            if told > 1:
                assert not _passes(limits, per_minute)
            clock.now += told - max(0.0, told - 1.0) + 1e-3
            assert _passes(limits, per_minute)


def test_a_minutes_requests_may_come_at_once_and_then_one_every_sixtieth():
    clock = Clock()
    limits = RateLimits(clock)
    assert [_passes(limits, 60) for _ in range(61)] == [True] * 60 + [False]
    clock.now += 1.0
    assert [_passes(limits, 60) for _ in range(2)] == [True, False]


def test_callers_that_left_are_forgotten(monkeypatch):
    monkeypatch.setattr(rate_limits, "_FORGET_FROM", 100)
    clock = Clock()
    limits = RateLimits(clock)
    for caller in range(10_000):
        clock.now += 1.0
        limits.take(str(caller), 60)  # full again after a second
        limits.enter(f"in {caller}", Allowance(None, 5))
        limits.leave(f"in {caller}")
    assert len(limits._full_at) <= 200
    assert not limits._inside


def test_a_refused_request_takes_up_no_place():
    limits = RateLimits(Clock())
    limits.enter("me", Allowance(1, 2))
    for _ in range(5):
        with pytest.raises(TooManyRequests, match="in a minute"):
            limits.enter("me", Allowance(1, 2))
    limits.enter("me", Allowance(None, 2))
    with pytest.raises(TooManyRequests, match="same time"):
        limits.enter("me", Allowance(None, 2))
    limits.enter("another", Allowance(None, 2))


Serve = Callable[..., httpx.Client]


@pytest.fixture
def serve(screener, serving) -> Iterator[Serve]:
    """Clients of services with given settings."""
    with ExitStack() as stack:

        def started(**fields: Any) -> httpx.Client:
            url = stack.enter_context(serving(create_app(Settings(**fields), screener=screener)))
            return stack.enter_context(httpx.Client(base_url=url, timeout=20.0))

        yield started


@pytest.fixture
def store(tmp_path) -> Iterator[KeyStore]:
    database = open_database(tmp_path / "data")
    yield KeyStore(database)
    database.close()


def _key(store: KeyStore, **limits: int) -> dict[str, str]:
    return {"X-API-Key": store.create("office", Role.submit, limits=KeyLimits(**limits))[1]}


def test_a_key_is_refused_beyond_its_requests_in_a_minute_until_the_time_it_is_told(serve, store, tmp_path):
    http = serve(data_folder=tmp_path / "data", auth="on", requests_per_minute=90)
    key, other = _key(store), _key(store)
    statuses = []
    while 429 not in statuses:
        answer = http.post("/v1/stability", headers=key)
        statuses.append(answer.status_code)
        assert len(statuses) < 1000
    assert statuses[:90] == [422] * 90  # refused as a question, for its empty body
    assert http.get("/v1/models", headers=other).status_code == 200
    time.sleep(int(answer.headers["retry-after"]))
    assert http.get("/v1/models", headers=key).status_code == 200


def test_a_refusal_is_a_problem_that_says_how_many_there_may_be(serve, store, tmp_path, problem):
    http = serve(data_folder=tmp_path / "data", auth="on")
    few = _key(store, requests_per_minute=2)  # the key's own, not the settings' 6000
    answers = [http.post("/v1/stability", json={}, headers=few) for _ in range(3)]
    assert [answer.status_code for answer in answers] == [422, 422, 429]
    refused = problem(answers[2], 429, "requests")
    assert refused["type"] == "urn:rubscreen:problem:too-many-requests"
    assert refused["value"] == "over 2 in a minute"
    assert 29 <= int(answers[2].headers["retry-after"]) <= 30


def test_health_is_never_limited(serve, store, tmp_path):
    http = serve(data_folder=tmp_path / "data", auth="on", requests_per_minute=1)
    key = _key(store)
    assert [http.get("/v1/models", headers=key).status_code for _ in range(2)] == [200, 429]
    for path in ("/healthz", "/readyz"):
        for headers in (key, {}):
            assert [http.get(path, headers=headers).status_code for _ in range(5)] == [200] * 5


def test_without_keys_every_address_has_its_own_bucket(serve, problem):
    http = serve(requests_per_minute=2)  # a proxy on this machine says whom it asks for

    def ask(address: str) -> httpx.Response:
        return http.get("/v1/models", headers={"X-Forwarded-For": address})

    assert [ask("192.0.2.7").status_code for _ in range(3)] == [200, 200, 429]
    assert ask("192.0.2.8").status_code == 200
    assert [ask(f"2001:db8::{host}").status_code for host in range(3)] == [200, 200, 429]
    assert ask("2001:db8:0:1::1").status_code == 200
    problem(ask("192.0.2.7"), 429, "requests")


def test_this_machine_is_limited_only_where_it_is_said(serve, monkeypatch):
    from service.rest import gate

    monkeypatch.setattr(gate, "REQUESTS_PER_MINUTE", 5)
    monkeypatch.setattr(gate, "CONCURRENT_REQUESTS", 1)
    http = serve()
    assert {http.get("/v1/models").status_code for _ in range(20)} == {200}
    told = [http.get("/v1/models", headers={"X-Forwarded-For": "192.0.2.7"}).status_code for _ in range(6)]
    assert told == [200] * 5 + [429]


def test_who_tries_keys_is_stopped_before_the_database_is_asked_and_good_keys_pass(
    serve, store, tmp_path, monkeypatch
):
    http = serve(data_folder=tmp_path / "data", auth="on", requests_per_minute=5)
    key = _key(store, requests_per_minute=1000)
    assert http.get("/v1/models", headers=key).status_code == 200
    asked, find = [], KeyStore.find
    monkeypatch.setattr(KeyStore, "find", lambda self, key_id: asked.append(key_id) or find(self, key_id))
    tried = [
        http.get("/v1/models", headers={"X-API-Key": f"rub_{i:012x}_{'0' * 64}"}).status_code
        for i in range(10)
    ]
    assert tried == [401] * 4 + [429] * 6  # the good key took the first place, before it was known
    assert len([key_id for key_id in asked if key_id.startswith("00000")]) == 4
    assert {http.get("/v1/models", headers=key).status_code for _ in range(10)} == {200}


@pytest.mark.parametrize("own", [{}, {"max_concurrent_requests": 2}])
def test_a_key_is_refused_beyond_its_requests_at_the_same_time(
    serve, store, tmp_path, screener, question, problem, monkeypatch, own
):
    limit = 2 if own else 3
    http = serve(data_folder=tmp_path / "data", auth="on", max_concurrent_requests=3, worker_threads=4)
    key, other = _key(store, **own), _key(store)
    screener.pause.clear()
    inside, answer = Semaphore(0), screener.map
    monkeypatch.setattr(screener, "map", lambda *asked: inside.release() or answer(*asked))
    with ThreadPoolExecutor(limit) as pool:
        try:
            waiting = [
                pool.submit(http.post, "/v1/map", json=question("/v1/map"), headers=key) for _ in range(limit)
            ]
            assert all(inside.acquire(timeout=10.0) for _ in range(limit))
            refused = http.get("/v1/models", headers=key)
            assert http.get("/v1/models", headers=other).status_code == 200
        finally:
            screener.pause.set()
        assert [done.result().status_code for done in waiting] == [200] * limit
    document = problem(refused, 429, "requests")
    assert document["value"] == f"over {limit} at the same time"
    assert refused.headers["retry-after"] == "1"
    assert http.get("/v1/models", headers=key).status_code == 200


def test_who_has_a_whole_answer_may_ask_again_at_once():
    access = Access.opened(Settings(max_concurrent_requests=1), None)
    scope = {"type": "http", "path": "/v1/models", "server": None, "client": ("127.0.0.1", 1), "headers": []}

    async def answer(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        for more in (True, False):
            await send({"type": "http.response.body", "body": b"x", "more_body": more})

    async def scene() -> list[bool]:
        room = []

        async def sent(message: Any) -> None:  # what a client has of the answer now
            try:
                _, who = await access.admit(scope)
            except TooManyRequests:
                room.append(False)
            else:
                room.append(True)
                access.limits.leave(who)

        await Gate(answer)(scope | {"state": {"desk": SimpleNamespace(access=access)}}, None, sent)
        return room

    assert asyncio.run(scene()) == [False, False, True]
    assert not access.limits._inside


def test_a_request_that_failed_without_an_answer_takes_up_no_place():
    access = Access.opened(Settings(max_concurrent_requests=1), None)
    scope = {"type": "http", "path": "/v1/models", "server": None, "client": ("127.0.0.1", 1), "headers": []}

    async def fail(scope: Any, receive: Any, send: Any) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        asyncio.run(Gate(fail)(scope | {"state": {"desk": SimpleNamespace(access=access)}}, None, None))
    assert not access.limits._inside


def test_a_client_that_hung_up_takes_up_no_place(serve, screener):
    http = serve(max_concurrent_requests=1)
    where = (http.base_url.host, http.base_url.port)
    for _ in range(3):
        with socket.create_connection(where) as sock:
            sock.sendall(b"POST /v1/map HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n{")
            time.sleep(0.1)  # for it to come first: a request asked meanwhile would take its place
            _until(lambda: http.get("/v1/models"), 429)
        _until(lambda: http.get("/v1/models"), 200)


def test_a_request_too_many_is_refused_before_its_body_arrives(serve):
    http = serve(requests_per_minute=1)
    assert http.get("/v1/models").status_code == 200
    with socket.create_connection((http.base_url.host, http.base_url.port), timeout=10.0) as sock:
        sock.sendall(b"POST /v1/map HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000\r\n\r\n{")
        assert sock.recv(65536).startswith(b"HTTP/1.1 429")


def _until(ask: Callable[[], httpx.Response], status: int) -> httpx.Response:
    deadline = time.monotonic() + 10.0
    while (answer := ask()).status_code != status:
        assert time.monotonic() < deadline, answer.text
        time.sleep(0.05)
    return answer


OFFICE = Caller("0123456789ab", "office", Role.submit)


def test_a_key_has_so_many_jobs_and_all_keys_together_so_many():
    quota = JobQuota(max_active_jobs=3, max_queued_jobs=10)
    quota.check_job_quota(OFFICE, 2, 9)
    with pytest.raises(TooManyJobs, match="3 of key 0123456789ab") as refused:
        quota.check_job_quota(OFFICE, 3, 3)
    assert refused.value.headers == {"Retry-After": "60"}
    with pytest.raises(TooManyJobs, match="10 of all callers"):
        quota.check_job_quota(OFFICE, 0, 10)


def test_a_key_with_a_quota_of_its_own_and_who_needs_none():
    quota = JobQuota(max_active_jobs=3, max_queued_jobs=10)
    favoured = Caller("0123456789ab", "night run", Role.submit, max_active_jobs=8)
    quota.check_job_quota(favoured, 7, 7)
    with pytest.raises(TooManyJobs):
        quota.check_job_quota(favoured, 8, 8)
    quota.check_job_quota(ANONYMOUS, 9, 9)
    with pytest.raises(TooManyJobs):
        quota.check_job_quota(ANONYMOUS, 0, 10)


@pytest.mark.parametrize("field", ["requests_per_minute", "max_concurrent_requests", "max_active_jobs"])
def test_a_limit_of_nothing_is_refused_for_a_key(field):
    with pytest.raises(InvalidInput, match="revoke the key") as refused:
        KeyLimits(**{field: 0})
    assert refused.value.field == field

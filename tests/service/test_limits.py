"""What is too large is refused with 413 before work is spent on it."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Iterator

import anyio
import httpx
import pytest
from starlette.requests import Request

from service.app import create_app
from service.rest.limits import Busy, WorkQueue
from service.settings import Settings

LIMITS = Settings(
    max_body_bytes=20_000,
    body_timeout_s=0.3,
    max_points=100,
    max_boundary_speeds=50,
    max_modes=4,
    max_tip_nodes=5,
    max_states=3,
    max_arcs=4,
    max_name_length=40,
    worker_threads=1,
    max_waiting=1,
)


@pytest.fixture
def small(screener, serving) -> Iterator[httpx.Client]:
    """A service with small limits."""
    with (
        serving(create_app(LIMITS, screener=screener)) as url,
        httpx.Client(base_url=url, timeout=20.0) as client,
    ):
        yield client


def test_the_limit_itself_is_allowed(small, question):
    body = question(speed_hz=[100.0] * 100, ke=[1.0] * 100)
    assert small.post("/v1/stability", json=body).status_code == 200
    assert (
        small.post("/v1/map", json=question("/v1/map", speed_hz=[10.0] * 10, ke=[1.0] * 10)).status_code
        == 200
    )


def test_too_many_points_are_refused(small, question, problem):
    body = question(speed_hz=[100.0] * 101, ke=[1.0] * 101)
    document = problem(small.post("/v1/stability", json=body), 413, "speed_hz")
    assert document["value"] == "101 entries" and "100" in document["remedy"]


def test_too_many_derivatives_are_refused_with_their_number(small, question, problem):
    # Three modes, three nodes: 3·(2 + 3) + 3 + 2 parameters.
    body = question("/v1/sensitivities", speed_hz=[100.0] * 5)
    assert small.post("/v1/sensitivities", json=body).status_code == 200
    body = question("/v1/sensitivities", speed_hz=[100.0] * 6)
    document = problem(small.post("/v1/sensitivities", json=body), 413, "speed_hz")
    assert "120 derivatives" in document["value"] and "100" in document["remedy"]


def test_too_many_points_of_a_map_are_refused(small, question, problem):
    body = question("/v1/map", speed_hz=[10.0] * 11, ke=[1.0] * 10)
    document = problem(small.post("/v1/map", json=body), 413, "speed_hz x ke")
    assert "110 points" in document["value"] and "100" in document["remedy"]


def test_too_many_speeds_of_a_boundary_are_refused(small, question, problem):
    body = question("/v1/boundary", speed_hz=[10.0] * 51)
    problem(small.post("/v1/boundary", json=body), 413, "speed_hz")


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"tip_nodes": [str(i) for i in range(6)]}, "blade.tip_nodes"),
        ({"tip_nodes": ["x" * 41]}, "blade.tip_nodes[0]"),
        ({"name": "x" * 41}, "blade.name"),
        ({"damping_ratio": [0.0] * 5}, "blade.damping_ratio"),
        ({"tip_z_m": [0.0] * 6}, "blade.tip_z_m"),
        ({"states": [{}] * 4}, "blade.states"),
        ({"states": [{"frequency_hz": [1.0] * 5}]}, "blade.states[0].frequency_hz"),
        ({"states": [{"mode_shape": [[1.0]] * 5}]}, "blade.states[0].mode_shape"),
        ({"states": [{"mode_shape": [[1.0], [1.0] * 6]}]}, "blade.states[0].mode_shape[1]"),
    ],
)
def test_a_blade_larger_than_any_is_refused(small, question, problem, change, field):
    body = question()
    body["blade"] |= change
    problem(small.post("/v1/stability", json=body), 413, field)


def test_more_arcs_than_allowed_are_refused(small, question, problem):
    body = question()
    body["contact"]["arcs"] = [[i / 10, i / 10 + 0.01] for i in range(5)]
    problem(small.post("/v1/stability", json=body), 413, "contact.arcs")


def test_a_speed_the_exact_core_would_take_hours_for_is_refused(small, question, problem):
    document = problem(small.post("/v1/stability", json=question(speed_hz=[180.0, 1.0])), 413, "speed_hz[1]")
    assert document["value"] == "1.0" and "3.2697 Hz" in document["remedy"]


def test_a_contact_ten_times_stiffer_than_the_blade_is_refused(small, question, problem):
    problem(small.post("/v1/stability", json=question(ke=[1e3, 1e8])), 413, "ke[1]")
    problem(small.post("/v1/boundary", json=question("/v1/boundary", ke_max=1e8)), 413, "ke_max")


def test_frequencies_ten_thousand_times_apart_are_refused(small, question, problem):
    body = question()
    body["blade"]["states"][0]["frequency_hz"] = [0.1, 900.0, 2e3]
    problem(small.post("/v1/stability", json=body), 413, "blade.states")


def test_a_long_body_is_refused_by_its_announced_length(small, problem):
    document = problem(small.post("/v1/stability", content=b"x" * 20_001), 413, "body")
    assert document["value"] == "20001 bytes"


def test_a_long_body_without_a_length_is_refused_while_it_arrives(small):
    chunk = b"2710\r\n" + b"x" * 10_000 + b"\r\n"
    with socket.create_connection((small.base_url.host, small.base_url.port), timeout=10.0) as sock:
        sock.sendall(b"POST /v1/map HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n" + 3 * chunk)
        answer = b""
        while not answer.endswith(b"}"):  # the answer comes though the body has not ended, in pieces
            piece = sock.recv(65536)
            assert piece, "the connection was closed before the whole answer"
            answer += piece
    assert answer.startswith(b"HTTP/1.1 413") and b"over 20000 bytes" in answer
    assert small.get("/healthz").status_code == 200


def test_a_body_that_never_ends_is_given_up(small, problem):
    def slow() -> Iterator[bytes]:
        yield b"{"
        time.sleep(0.8)
        yield b"}"

    try:
        answer = small.post("/v1/stability", content=slow())
    except (httpx.WriteError, httpx.RemoteProtocolError):
        pass
    else:
        problem(answer, 408, "body")
    assert small.get("/healthz").status_code == 200


def test_whose_work_is_not_to_be_turned_away_has_it_done_though_nobody_may_wait():
    async def never() -> dict[str, str]:
        await anyio.sleep_forever()
        raise AssertionError

    async def both() -> int:
        queue, request = WorkQueue(1, 0, 10.0), Request({"type": "http"}, never)
        with pytest.raises(Busy):
            await queue.run(lambda: 1, request)
        return await queue.run(lambda: 2, request, turn_away=False)

    assert asyncio.run(both()) == 2

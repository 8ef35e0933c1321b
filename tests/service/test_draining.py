"""A service that is told to stop answers what is asked until nobody asks it any more, and ends well."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator

import httpx
import numpy as np
import pytest
from served_process import ServedProcess, free_port

from service.rest.question_schemas import BOUNDARY_EXAMPLE, POINTS_EXAMPLE

FOREVER = "600"


@pytest.fixture
def started(tmp_path) -> Iterator[Callable[..., ServedProcess]]:
    """Starts services, and ends what is left of them."""
    running = []

    def start(**settings: str) -> ServedProcess:
        running.append(ServedProcess(tmp_path, free_port(), settings))
        return running[-1].start()

    yield start
    for service in running:
        service.kill()


def ask(service: ServedProcess, path: str = "/v1/stability", body: dict | None = None) -> httpx.Response:
    with httpx.Client(base_url=service.url, trust_env=False, timeout=60.0) as http:
        return http.post(path, json=body) if body is not None else http.get(path)


def until_draining(service: ServedProcess) -> None:
    deadline = time.monotonic() + 30.0
    while (answer := ask(service, "/readyz")).status_code == 200:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert answer.json()["type"] == "urn:rubscreen:problem:draining"


def test_everything_is_answered_while_it_drains_and_then_it_ends_with_zero(started):
    service = started(drain_s="2")
    service.tell(signal.SIGTERM)
    until_draining(service)
    answered = 0
    try:
        while True:  # on connections of their own, as they come through a balancer that has not noticed
            answer = ask(service, body=POINTS_EXAMPLE)
            assert answer.status_code == 200 and answer.headers["connection"] == "close"
            answered += 1
    except httpx.ConnectError:
        pass
    assert answered > 10
    assert service.ended() == 0


def test_what_is_being_computed_when_it_stops_listening_is_answered(started):
    service = started(drain_s="0")
    slow = BOUNDARY_EXAMPLE | {
        "contact": {"weights": {"LE": 1.0}, "arcs": [[0.0, 0.25]]},
        "speed_hz": np.linspace(150.0, 300.0, 40).tolist(),
        "policy": "exact",
    }
    got = []
    asking = threading.Thread(target=lambda: got.append(ask(service, "/v1/boundary", slow)))
    asking.start()
    deadline = time.monotonic() + 30.0
    while "rubscreen_work_running 1.0" not in ask(service, "/metrics").text:
        assert asking.is_alive() and time.monotonic() < deadline
    service.tell(signal.SIGTERM)
    asking.join()
    assert got[0].status_code == 200 and len(got[0].json()["critical_ke"]) == 40
    assert service.ended() == 0


def test_a_second_signal_stops_it_at_once(started):
    service = started(drain_s=FOREVER)
    service.tell(signal.SIGTERM)
    until_draining(service)
    service.tell(signal.SIGTERM)
    assert service.ended(30.0) == 0


def test_a_second_signal_waits_for_no_answer_either(started):
    service = started(drain_s=FOREVER, shutdown_s=FOREVER)
    endless = BOUNDARY_EXAMPLE | {
        "contact": {"weights": {"LE": 1.0}, "arcs": [[0.0, 0.25]]},
        "speed_hz": np.linspace(150.0, 300.0, 400).tolist(),
        "policy": "exact",
    }

    def asked() -> None:
        with pytest.raises(httpx.HTTPError):  # cut off, or told that it was
            ask(service, "/v1/boundary", endless).raise_for_status()

    asking = threading.Thread(target=asked)
    asking.start()
    while "rubscreen_work_running 1.0" not in ask(service, "/metrics").text:
        time.sleep(0.01)
    service.tell(signal.SIGTERM)
    until_draining(service)
    service.tell(signal.SIGTERM)
    assert service.ended(30.0) == 0
    asking.join()


def test_ctrl_c_does_not_drain(started):
    service = started(drain_s=FOREVER)
    service.tell(signal.SIGINT)
    assert service.ended(30.0) == 0

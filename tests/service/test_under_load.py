"""The service stays alive while it works, refuses what it has no room for, and finishes before it stops."""

from __future__ import annotations

import asyncio
import json
import logging
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlsplit

import httpx

from service.app import create_app
from service.commands.serve import _listening
from service.settings import Settings


def test_health_answers_while_every_worker_is_busy(screener, serving, question, problem):
    settings = Settings(worker_threads=1, max_waiting=1)
    with (
        serving(create_app(settings, screener=screener)) as url,
        httpx.Client(base_url=url, timeout=30.0) as client,
        ThreadPoolExecutor(2) as pool,
    ):
        screener.pause.clear()
        working = [pool.submit(client.post, "/v1/map", json=question("/v1/map")) for _ in range(2)]
        try:
            assert screener.entered.wait(10.0)
            began = time.perf_counter()
            assert client.get("/healthz").json()["status"] == "alive"
            assert time.perf_counter() - began < 2.0
            refused = _until_busy(client, question())
        finally:
            screener.pause.set()
        assert [done.result().status_code for done in working] == [200, 200]
    problem(refused, 503, "service")
    assert int(refused.headers["retry-after"]) > 0


def _until_busy(client: httpx.Client, body: dict) -> httpx.Response:
    # The second request may still be on its way to the queue; what it leaves room for would hang.
    deadline = time.monotonic() + 10.0
    while time.monotonic() < deadline:
        try:
            return client.post("/v1/stability", json=body, timeout=0.5)
        except httpx.ReadTimeout:
            continue
    raise AssertionError("the queue never filled")


def test_a_client_that_hangs_up_halfway_is_no_fault_of_the_service(shared_address, http, caplog):
    where = urlsplit(shared_address)
    with caplog.at_level(logging.INFO, "rubscreen"):
        with socket.create_connection((where.hostname, where.port)) as sock:
            sock.sendall(b"POST /v1/map HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n{")
            time.sleep(0.1)
        deadline = time.monotonic() + 10.0
        while not any("/v1/map" in r.getMessage() for r in caplog.records) and time.monotonic() < deadline:
            time.sleep(0.02)
    lines = [r for r in caplog.records if "/v1/map" in r.getMessage()]
    assert [json.loads(r.getMessage())["status"] for r in lines] == [400]
    assert not [r for r in caplog.records if r.levelno >= logging.ERROR]
    assert http.get("/healthz").status_code == 200


SLOW_SERVICE = """
import sys, threading, time, uvicorn
sys.path.insert(0, sys.argv[1])
from conftest import RuleScreener
from service.app import create_app

class Slow(RuleScreener):
    def map(self, *asked):
        print("working", flush=True)
        time.sleep(1.0)
        return super().map(*asked)

uvicorn.run(create_app(screener=Slow()), port=int(sys.argv[2]), log_level="warning")
"""


def test_the_answer_being_worked_on_is_sent_before_the_service_stops(question):
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        port = sock.getsockname()[1]
    command = [sys.executable, "-c", SLOW_SERVICE, os.path.dirname(__file__), str(port)]
    service = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    kept = threading.Thread(target=lambda: setattr(service, "log", service.stderr.read()))
    kept.start()
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=30.0) as client:
            _until_alive(client)
            with ThreadPoolExecutor(1) as pool:
                answer = pool.submit(client.post, "/v1/map", json=question("/v1/map"))
                assert service.stdout.readline() == "working\n"
                service.send_signal(signal.SIGTERM)
                assert answer.result().status_code == 200
        service.wait(30.0)
    finally:
        service.kill()
        service.wait()
        kept.join()
    assert "Traceback" not in service.log


def _until_alive(client: httpx.Client) -> None:
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        try:
            client.get("/healthz")
            return
        except httpx.TransportError:
            time.sleep(0.1)
    raise AssertionError("the service did not come up")


def test_the_socket_of_serve_is_one_whose_answers_go_out_at_once():
    # asyncio turns Nagle's algorithm off for sockets that name their protocol, and for no others: on those
    # every answer on a connection that stays open took 44 ms in place of 1.
    async def accepted_without_delay() -> int:
        found = asyncio.get_running_loop().create_future()

        async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            sock = writer.get_extra_info("socket")
            found.set_result(sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
            writer.close()

        listening = _listening("127.0.0.1", 0)
        async with await asyncio.start_server(answer, sock=listening):
            _, writer = await asyncio.open_connection(*listening.getsockname())
            writer.close()
            return await asyncio.wait_for(found, 10.0)

    assert asyncio.run(accepted_without_delay())

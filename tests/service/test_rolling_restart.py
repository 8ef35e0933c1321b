"""Two replicas behind nginx, as the documentation recommends it, are restarted and no client notices."""

from __future__ import annotations

import getpass
import os
import shutil
import signal
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from served_process import ServedProcess, free_port

from service.rest.question_schemas import MAP_EXAMPLE, POINTS_EXAMPLE

RECOMMENDED = Path(__file__).parents[2] / "docs" / "how-to" / "nginx.conf"
WHOLE = """
daemon off;
pid {folder}/nginx.pid;
user {user};
error_log {folder}/error.log;
events {{}}
http {{
    access_log off;
    client_body_temp_path {folder}/body;
    proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/fastcgi;
    uwsgi_temp_path {folder}/uwsgi;
    scgi_temp_path {folder}/scgi;
    include {folder}/rubscreen.conf;
}}
"""
pytestmark = pytest.mark.skipif(
    shutil.which("nginx") is None and not os.environ.get("CI"), reason="nginx is not installed"
)


@pytest.fixture
def replicas(tmp_path) -> Iterator[list[ServedProcess]]:
    running = []
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        running.append(ServedProcess(tmp_path / name, free_port(), {"drain_s": "1", "log_format": "json"}))
    try:
        yield [replica.start() for replica in running]
    finally:
        for replica in running:
            replica.kill()


@pytest.fixture
def balancer(tmp_path, replicas) -> Iterator[str]:
    """nginx with the recommended configuration, its addresses exchanged for those there are."""
    port, text = free_port(), RECOMMENDED.read_text(encoding="utf-8")
    for there, here in zip(("10.0.0.11:8000", "10.0.0.12:8000"), replicas, strict=True):
        assert there in text
        text = text.replace(there, f"127.0.0.1:{here.port}")
    assert "listen 80;" in text
    (tmp_path / "rubscreen.conf").write_text(text.replace("listen 80;", f"listen 127.0.0.1:{port};"))
    (tmp_path / "nginx.conf").write_text(WHOLE.format(folder=tmp_path, user=getpass.getuser()))
    process = subprocess.Popen(["nginx", "-p", str(tmp_path), "-c", str(tmp_path / "nginx.conf")])
    try:
        url, deadline = f"http://127.0.0.1:{port}", time.monotonic() + 20.0
        while time.monotonic() < deadline:
            try:
                httpx.get(f"{url}/healthz", trust_env=False)
                break
            except httpx.TransportError:
                time.sleep(0.05)
        yield url
    finally:
        process.terminate()
        process.wait(20.0)


def test_no_request_fails_while_both_replicas_are_restarted_one_after_the_other(balancer, replicas):
    stop, outcomes, lock = threading.Event(), Counter(), threading.Lock()

    def client(own_connection_each: bool, path: str, body: dict) -> None:
        with httpx.Client(base_url=balancer, trust_env=False, timeout=60.0) as kept:
            while not stop.is_set():
                try:
                    if own_connection_each:
                        answer = httpx.post(f"{balancer}{path}", json=body, trust_env=False, timeout=60.0)
                    else:
                        answer = kept.post(path, json=body)
                    outcome = str(answer.status_code)
                except httpx.TransportError as error:
                    outcome = repr(error)
                with lock:
                    outcomes[outcome] += 1

    clients = [
        threading.Thread(target=client, args=asked)
        for asked in (
            (False, "/v1/stability", POINTS_EXAMPLE),
            (True, "/v1/stability", POINTS_EXAMPLE),
            (False, "/v1/map", MAP_EXAMPLE),
        )
    ]
    for thread in clients:
        thread.start()
    try:
        time.sleep(0.5)
        for replica in replicas:
            before = outcomes["200"]
            replica.tell(signal.SIGTERM)
            assert replica.ended() == 0
            replica.start()
            assert outcomes["200"] > before  # the other one answered meanwhile
        time.sleep(0.5)
    finally:
        stop.set()
        for thread in clients:
            thread.join()
    assert set(outcomes) == {"200"} and outcomes["200"] > 100, outcomes
    print(f"{outcomes['200']} requests, 0 failed")


def test_metrics_are_not_for_those_before_the_balancer(balancer):
    assert httpx.get(f"{balancer}/metrics", trust_env=False).status_code == 404
    assert httpx.get(f"{balancer}/readyz", trust_env=False).status_code == 200

"""Long work ends when its time is up, its client hangs up, or the service is told to stop."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import httpx
import numpy as np
import pytest

from sdm_core.blade import Blade, ModalState, blade_to_dict


def endless_question() -> dict:
    """One point that the exact core needs minutes for: 64 modes and an arc of contact."""
    frequency = 600.0 + 420.0 * np.arange(64)
    shape = np.random.default_rng(1).normal(size=(64, 3))
    blade = Blade("many modes", ("A", "B", "C"), 1e-3, [ModalState(0.0, frequency, shape)])
    contact = {"weights": {"A": 1.0, "B": 1.0, "C": 1.0}, "arcs": [[0.0, 0.25]]}
    return {
        "blade": blade_to_dict(blade),
        "contact": contact,
        "speed_hz": [150.0],
        "ke": [1e5],
        "policy": "exact",
    }


@pytest.fixture
def service(tmp_path: Path):
    """Start a service with given settings; returns its address and process."""
    started = []

    def start(**settings: str) -> tuple[str, subprocess.Popen]:
        environment = {**os.environ, **{f"RUBSCREEN_{k.upper()}": v for k, v in settings.items()}}
        log = (tmp_path / "service.log").open("w+")
        command = [sys.executable, "-c", "from service.cli import app; app()", "serve", "--port", "0"]
        process = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
        started.append((process, log))
        end = time.monotonic() + 60
        while time.monotonic() < end:
            text = (tmp_path / "service.log").read_text()
            if "listening on " in text:
                url = text.split("listening on ")[1].split()[0]
                try:
                    if httpx.get(f"{url}/readyz", timeout=5, trust_env=False).status_code == 200:
                        return url, process
                except httpx.TransportError:
                    pass
            time.sleep(0.1)
        raise AssertionError((tmp_path / "service.log").read_text())

    yield start
    for process, log in started:
        process.kill()
        process.wait()
        log.close()


def seconds_of_processor(process: subprocess.Popen) -> float:
    fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def test_an_answer_that_takes_too_long_is_given_up_with_a_problem(service):
    url, _ = service(deadline_s="1")
    answer = httpx.post(f"{url}/v1/stability", json=endless_question(), timeout=60, trust_env=False)
    assert answer.status_code == 413
    assert answer.json()["field"] == "request" and "fewer" in answer.json()["remedy"]


def test_work_ends_when_its_client_hangs_up(service):
    url, process = service()
    with pytest.raises(httpx.ReadTimeout):
        httpx.post(f"{url}/v1/stability", json=endless_question(), timeout=1.5, trust_env=False)
    time.sleep(3.0)
    before = seconds_of_processor(process)
    time.sleep(2.0)
    assert seconds_of_processor(process) - before < 0.5


def test_a_service_told_to_stop_does_so_whatever_it_computes(service):
    url, process = service(shutdown_s="1")
    with httpx.Client(trust_env=False) as client, pytest.raises(httpx.ReadTimeout):
        client.post(f"{url}/v1/stability", json=endless_question(), timeout=0.5)
    # The client is gone, and another one waits while the signal comes.
    waiting = subprocess.Popen(
        [sys.executable, "-c", WAITING_CLIENT, f"{url}/v1/stability"], stdin=subprocess.PIPE, text=True
    )
    assert waiting.stdin is not None
    waiting.stdin.write(json.dumps(endless_question()))
    waiting.stdin.close()
    time.sleep(2.0)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=20) is not None
    waiting.wait(timeout=20)


WAITING_CLIENT = """
import sys, urllib.request
body = sys.stdin.read().encode()
request = urllib.request.Request(sys.argv[1], data=body, headers={"Content-Type": "application/json"})
try:
    urllib.request.urlopen(request, timeout=60)
except Exception:
    pass
"""

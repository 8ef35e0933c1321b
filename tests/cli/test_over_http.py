"""The commands against the real service: over HTTP, with the shipped model."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import uvicorn

from sdm_core.blade import Blade, ModalState, write_blade
from service.app import create_app
from service.settings import Settings
from training.screening import Screener

EXAMPLES = Path(__file__).parents[2] / "examples"
ROTOR = "nasa_rotor_37"


@pytest.fixture(scope="module")
def url():
    """The service with the shipped model, on a free loopback port."""
    listening = socket.socket()
    listening.bind(("127.0.0.1", 0))
    server = uvicorn.Server(
        uvicorn.Config(
            create_app(Settings(), screener=Screener.default()), log_level="warning", access_log=False
        )
    )
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    thread.start()
    while not server.started:
        assert thread.is_alive()
        time.sleep(0.02)
    yield f"http://127.0.0.1:{listening.getsockname()[1]}"
    server.should_exit = True
    thread.join(20)
    listening.close()


def test_a_map_over_http_is_the_map_of_this_process(rubscreen, url, tmp_path):
    documents = []
    for where in (["--url", url], []):
        path = tmp_path / f"{len(documents)}.json"
        options = ["--grid", "8x6", "--nodes", "LE,TE", "--policy", "exact", "--json", str(path)]
        result = rubscreen("map", ROTOR, *options, *where)
        assert result.exit_code == 0, result.output
        documents.append(json.loads(path.read_text()))
    assert documents[0].pop("model") != documents[1].pop("model")  # under exact this process loads none
    assert documents[0] == documents[1]
    assert documents[0]["exact_share"] == 1.0


def test_one_mode_becomes_unstable_at_two_xi_times_one_plus_xi(rubscreen, url, tmp_path):
    """DESIGN, section 6: min K_e φ²/ω² = 2ξ(1 + ξ), φ² = 4 kg^-1, at the tip of a lobe."""
    damping, f = 2e-3, 600.0
    blade = Blade("one-mode", ("LE",), damping, [ModalState(0.0, [f], [[2.0]])], design_speed_hz=200.0)
    write_blade(blade, tmp_path / "blade.json")
    result = rubscreen(
        "boundary",
        str(tmp_path / "blade.json"),
        "--ke-max",
        "1e6",
        "--policy",
        "exact",
        "--url",
        url,
        "--json",
        "-",
    )
    assert result.exit_code == 0, result.output
    tip = json.loads(result.stdout)["critical_speeds"][0]
    exact = 2 * damping * (1 + damping) * (2 * np.pi * f) ** 2 / 4
    assert tip["ke"] == pytest.approx(exact, rel=1e-5)
    assert tip["ke"] >= exact * (1 - 1e-12)


def test_what_the_service_refuses_is_one_line_and_exit_code_2(rubscreen, url):
    result = rubscreen("map", ROTOR, "--grid", "10x10", "--ke-max", "1e12", "--url", url)
    assert result.exit_code == 2
    assert "far stiffer than the blade" in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_service_that_is_not_there_is_named(rubscreen):
    result = rubscreen("map", ROTOR, "--url", "http://127.0.0.1:9")
    assert result.exit_code == 2
    assert "http://127.0.0.1:9" in result.stderr
    assert "check that the service runs there" in result.stderr


def test_a_port_in_use_is_refused(rubscreen, url):
    port = url.rpartition(":")[2]
    result = rubscreen("serve", "--port", port)
    assert result.exit_code == 2
    assert f"--port = {port}" in result.stderr
    assert "free port" in result.stderr


@pytest.mark.skipif(shutil.which("curl") is None, reason="needs curl")
def test_the_rest_example_runs(url):
    done = subprocess.run(
        ["bash", str(EXAMPLES / "rest_example.sh"), url],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    replies = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    assert replies[1]["stable"] == [True, False]
    assert replies[2]["source"] == ["exact"] * 3


def test_the_module_runs_as_a_program():
    done = subprocess.run(
        [sys.executable, "-m", "service.cli", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("rubscreen ")

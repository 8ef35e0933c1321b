"""The examples that need a running service, run against one with the shipped model."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from served_process import ServedProcess, free_port

from service.app import create_app
from service.settings import Settings

EXAMPLES = Path(__file__).parents[2] / "examples"
BOUNDARY = "19469.7"  # N/m at 200 Hz, leading edge in contact: the README's figure


@pytest.fixture(scope="module")
def url(serving) -> Iterator[str]:
    with serving(create_app(Settings())) as address:
        yield address


def run(*command: str, cwd: Path = EXAMPLES, **more: str) -> str:
    where = {"PYTHONPATH": str(EXAMPLES.parent), "COLUMNS": "200"}
    done = subprocess.run(
        command, capture_output=True, text=True, env=os.environ | where | more, timeout=120, cwd=cwd
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.skipif(shutil.which("curl") is None, reason="needs curl")
def test_the_curl_example_asks_every_kind_of_question(url):
    said = run("bash", "curl.sh", url)
    assert '"status":"ready"' in said and '"stable":[true,false]' in said and "19469.66" in said
    assert "\nPNG\n" in said and '"field": "speed_hz[0]"' in said and '{"models":[{"id":' in said


def test_the_python_example_waits_and_awaits(url):
    said = run(sys.executable, "python_client.py", url)
    assert BOUNDARY in said and "120,000 points" in said and "refused: ke[0] = -1.0" in said
    assert "trailing edge" in said


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="needs GNU Octave")
def test_the_matlab_example_runs_in_octave(url):
    where = {"RUBSCREEN_URL": url}
    command = ("octave-cli", "--no-gui", "--path", str(EXAMPLES / "matlab"), "--eval")
    folder = f"cd '{EXAMPLES / 'matlab'}';"
    said = run(*command, f"{folder} rubscreen_points", **where)
    assert BOUNDARY in said and "unstable (surrogate)" in said and "refused: speed_hz[0] = -1" in said
    assert "ready, model" in run(*command, f"{folder} rubscreen_ready", **where)


@pytest.fixture(scope="module")
def jobs_url(tmp_path_factory) -> Iterator[str]:
    data = tmp_path_factory.mktemp("data")
    running = ServedProcess(data, free_port(), {"engine_workers": "1", "drain_s": "0"}).start()
    yield running.url
    running.kill()


def test_the_python_batch_is_ranked(jobs_url, tmp_path):
    said = run(sys.executable, str(EXAMPLES / "python_batch.py"), jobs_url, cwd=tmp_path)
    lines = said.splitlines()
    assert len(lines) == 8 and lines[0].startswith("1. ")
    assert lines[-1].startswith("8. damping x 1, both edges: 5,366 N/m, misses least_margin")
    assert (tmp_path / "ranking.csv").read_text().count("\n") == 9


@pytest.mark.skipif(shutil.which("curl") is None, reason="needs curl")
def test_the_curl_batch_is_one_job_and_ranked(jobs_url):
    said = run("bash", "batch.sh", jobs_url)
    assert "event: done" in said and '"nasa-rotor-37","both"' in said
    assert "Those that miss the criteria: 2" in said and "A report of" in said


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="needs GNU Octave")
def test_the_matlab_batch_runs_in_octave(jobs_url):
    command = ("octave-cli", "--no-gui", "--path", str(EXAMPLES / "matlab"), "--eval")
    said = run(*command, f"cd '{EXAMPLES / 'matlab'}'; rubscreen_batch", RUBSCREEN_URL=jobs_url)
    assert "4. nasa-rotor-37, both: 5366 N/m, misses them" in said

"""The demonstration: a real service, asked over HTTP, and nothing left running."""

from __future__ import annotations

import json
import os
import runpy
import signal
import subprocess
import sys
import time
from pathlib import Path

import httpx
import pytest

from sdm_core.errors import RubscreenError
from service import demo

EXAMPLES = Path(__file__).parents[2] / "examples"


def assert_gone(url: str) -> None:
    with pytest.raises(httpx.TransportError):
        httpx.get(f"{url}/healthz", trust_env=False)


def test_the_demo_ranks_both_blades_through_the_service(rubscreen, tmp_path):
    result = rubscreen("demo", "--out", str(tmp_path / "new"), "--grid", "20x20")
    assert result.exit_code == 0, result.output
    for words in ("service ready", "Safest", "Worst", "Verified", "Maps", "service stopped"):
        assert words in result.stdout
    report = json.loads((tmp_path / "new" / "report.json").read_text())
    first, last = report["results"][0], report["results"][-1]
    assert (first["blade"], first["contact_name"]) == ("generic-compressor-blade", "TE")
    assert (last["blade"], last["contact_name"]) == ("nasa-rotor-37", "both")
    # By the closed form, at the tip of a lobe of mode 1 near the lowest speed.
    assert last["smallest_unstable_ke"] == pytest.approx(5365.5, rel=1e-3)
    assert len(list((tmp_path / "new").glob("*.png"))) == 9
    log = (tmp_path / "new" / "service.log").read_text()
    assert "/v1/map" in log
    assert "Traceback" not in log


def test_the_service_is_stopped_when_the_demo_fails(tmp_path):
    with pytest.raises(ZeroDivisionError), demo.running_service(tmp_path / "log") as url:
        assert httpx.get(f"{url}/readyz", trust_env=False).status_code == 200
        raise ZeroDivisionError
    assert_gone(url)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_service_is_stopped_when_the_demo_is_interrupted(tmp_path, number):
    code = (
        # Whoever starts tests in the background may have made children ignore SIGINT.
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import time, pathlib; from service import demo\n"
        f"with demo.running_service(pathlib.Path({str(tmp_path / 'log')!r})) as url:\n"
        "    print(url, flush=True); time.sleep(60)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, stderr=subprocess.DEVNULL
    ) as process:
        url = process.stdout.readline().strip()
        os.kill(process.pid, number)
        assert process.wait(20) != 0
    assert_gone(url)


def test_a_service_that_does_not_start_ends_with_its_log(tmp_path, monkeypatch):
    monkeypatch.setenv("RUBSCREEN_MAX_POINTS", "many")
    began = time.monotonic()
    with pytest.raises(RubscreenError, match="RUBSCREEN_MAX_POINTS"), demo.running_service(tmp_path / "log"):
        pass
    assert time.monotonic() - began < 30


def test_a_service_without_a_model_ends_the_demo_with_what_to_do(rubscreen, tmp_path, monkeypatch):
    monkeypatch.setenv("RUBSCREEN_MODELS_FOLDER", str(tmp_path))
    result = rubscreen("demo", "--out", str(tmp_path / "out"))
    assert result.exit_code == 2
    assert "train a model first" in result.stderr


def test_the_python_example_runs(capsys):
    runpy.run_path(str(EXAMPLES / "python_example.py"), run_name="__main__")
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("trailing edge: ")
    assert lines[1].startswith("leading edge: ")
    assert "unstable at some speed" in lines[1]

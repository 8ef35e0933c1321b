"""`rubscreen batch` and `trainings` against a running service, and what Ctrl-C leaves behind."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from served_process import ServedProcess, free_port

from sdm_core.blade import EXAMPLES
from service.commands.batch_files import packed
from service.commands.blade_batch import blade_paths

SHIPPED = Path(__file__).parents[2] / "sdm_core" / "blade" / "examples"


@pytest.fixture(scope="module")
def url(tmp_path_factory) -> Iterator[str]:
    settings = {"engine_workers": "1", "drain_s": "0"}
    running = ServedProcess(tmp_path_factory.mktemp("data"), free_port(), settings).start()
    yield running.url
    running.kill()


@pytest.fixture
def folder(tmp_path) -> Path:
    """Two blades, one file that is no blade, one that is cut off."""
    for name in EXAMPLES:
        shutil.copy(SHIPPED / f"{name}.json", tmp_path)
    (tmp_path / "odd.json").write_text('{"schema": "something/1"}')
    (tmp_path / "cut.json").write_text('{"schema": ')
    return tmp_path


def test_a_folder_is_screened_and_every_file_of_it_accounted_for(rubscreen, url, folder):
    out = folder.parent / "out"
    files = {end: str(out / f"r.{end}") for end in ("json", "csv", "parquet", "html")}
    said = rubscreen(
        *("batch", "submit", str(folder), "--url", url, "--grid", "8x8", "--ke-liner", "9000"),
        *("--least-margin", "0.2", "--wait"),
        *(text for end, path in files.items() for text in (f"--{end}", path)),
    )
    assert said.exit_code == 0, said.output
    assert "not sent" in said.stderr and "cut.json" in said.stderr
    document = json.loads(Path(files["json"]).read_text())
    assert document["complete"] and len(document["results"]) == 6
    assert [lost["source"].endswith("odd.json") for lost in document["not_screened"]] == [True]
    assert [lost["source"].endswith("cut.json") for lost in document["not_sent"]] == [True]
    assert "missed least_margin" in said.output and "odd.json" in said.output
    assert pq.read_table(files["parquet"]).num_rows == 6
    assert Path(files["csv"]).read_text().count("\n") == 7
    assert "nasa-rotor-37" in Path(files["html"]).read_text()
    job = document["job"]
    listed = rubscreen("batch", "list", "--url", url, "--state", "done", "--json", "-")
    assert job in [each["id"] for each in json.loads(listed.stdout)["jobs"]]
    missed = rubscreen("batch", "results", job, "--url", url, "--misses", "--json", "-")
    assert {row["meets_criteria"] for row in json.loads(missed.stdout)["results"]} == {False}
    assert rubscreen("batch", "report", job, "--url", url, "-o", str(out / "x.html")).exit_code == 0
    assert (
        rubscreen(
            "batch", "map", job, "0", "--contact", "LE", "--url", url, "-o", str(out / "m.png")
        ).exit_code
        == 0
    )
    assert (out / "m.png").read_bytes().startswith(b"\x89PNG")
    again = rubscreen("batch", "retry", job, "--url", url, "--wait")
    assert again.exit_code == 0 and "done" in again.output


def test_ctrl_c_leaves_the_job_running_and_says_how_to_watch_it_again(rubscreen, url, tmp_path):
    blades = tmp_path / "blades"
    blades.mkdir()
    for i in range(24):
        shutil.copy(SHIPPED / "nasa_rotor_37.json", blades / f"{i}.json")
    command = ("batch", "submit", str(blades), "--url", url, "--grid", "8x8", "--wait")
    watching = subprocess.Popen(
        [sys.executable, "-m", "service.cli", *command],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        # What runs in the background is started with Ctrl-C ignored, these tests perhaps too.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert watching.stderr is not None
    job = watching.stderr.readline().split()[-1]
    time.sleep(1.0)
    watching.send_signal(signal.SIGINT)
    _, said = watching.communicate(timeout=30)
    assert watching.returncode == 130, said
    assert f"rubscreen batch watch {job} --url {url}" in said and "Traceback" not in said
    assert json.loads(rubscreen("batch", "status", job, "--url", url, "--json", "-").stdout)["state"] in (
        "queued",
        "running",
    )
    assert "stopping" in rubscreen("batch", "cancel", job, "--url", url).output
    watched = rubscreen("batch", "watch", job, "--url", url)
    assert watched.exit_code == 2 and "cancelled" in watched.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("submit", "nope"), "BLADE = nope: give a blade file"),
        (("submit", "nasa_rotor_37", "--weights", "chord"), "--weights = chord"),
        (("submit", "nasa_rotor_37", "--speed", "100Hz:0.3ratio"), "--speed = 100Hz:0.3ratio"),
        (("submit", "nasa_rotor_37", "--csv", "x.csv"), "--csv = x.csv: give --wait too"),
        (("submit", "nasa_rotor_37", "--nodes", "XX"), "contacts[0].weights.XX = 1.0: for blades[0]: "),
        (
            ("submit", "nasa_rotor_37", "--least-margin", "0.2"),
            "criteria.least_margin = 0.2: give ke_liner too",
        ),
        (("status", "0" * 32), "give the id of a screening"),
        (("list", "--state", "sleeping"), "state = sleeping"),
    ],
)
def test_a_refusal_is_one_line_that_says_what_to_do(rubscreen, url, arguments, said):
    found = rubscreen("batch", *arguments, "--url", url)
    assert found.exit_code == 2
    assert said in found.stderr and len(found.stderr.strip().splitlines()) == 1


def test_a_single_blade_that_cannot_be_screened_is_named_as_it_was_typed(rubscreen, url, folder):
    found = rubscreen("batch", "submit", str(folder / "odd.json"), "--url", url)
    assert found.exit_code == 2 and "batch.zip" not in found.stderr
    assert f"{str(folder / 'odd.json').lstrip('/')}.schema = something/1" in found.stderr


def test_the_same_files_make_the_same_archive_and_so_the_same_job(rubscreen, url, folder):
    (folder / "cut.json").unlink()
    contents = []
    for _ in range(2):
        with packed(blade_paths([str(folder)]), skip=True) as sending:
            contents.append(sending.archive.read_bytes())
    assert contents[0] == contents[1]
    asked = ("batch", "submit", str(folder), "--url", url, "--grid", "8x8", "--idempotency-key", "night")
    jobs = [rubscreen(*asked).stdout.strip() for _ in range(2)]
    assert jobs[0] == jobs[1] and len(jobs[0]) == 32
    rubscreen("batch", "cancel", jobs[0], "--url", url)


def test_trainings_are_scheduled_by_the_calendar(rubscreen, url):
    when = ("trainings", "schedule", "0 3 * * SUN", "--timezone", "Europe/Paris", "--url", url)
    assert "0 3 * * SUN (Europe/Paris), next " in rubscreen(*when).output
    assert "SUN" in rubscreen("trainings", "schedule", "--url", url).output
    assert "no training" in rubscreen("trainings", "schedule", "--off", "--url", url).output
    wrong = rubscreen("trainings", "submit", "--cases", "3", "--url", url)
    assert wrong.exit_code == 2 and "--cases = 3" in wrong.stderr
    assert "no trainings" in rubscreen("trainings", "list", "--url", url).output

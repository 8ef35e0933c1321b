"""A backup taken while a job runs, restored elsewhere: what was over is the same, what ran goes on."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tarfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
from postgres_server import empty_database, needs_postgres, running_postgres
from served_process import ServedProcess, free_port

from sdm_core.blade import blade_to_dict, example_blade

BLADE = blade_to_dict(example_blade("nasa_rotor_37"))
# So many that a chunk is one blade, and takes some seconds.
CONTACTS = [{"name": f"c{i}", "weights": {"LE": 1.0, "TE": 0.1 + 0.05 * i}} for i in range(14)]
FORMS = ("application/json", "text/csv", "application/vnd.apache.parquet")
MANY = 6


def rubscreen(*arguments: str, url: str | None) -> list[str]:
    return [
        sys.executable,
        "-m",
        "service.cli",
        *arguments,
        *(() if url is None else ("--database-url", url)),
    ]


@contextmanager
def service(data: Path, url: str | None) -> Iterator[httpx.Client]:
    """A service in a process of its own."""
    settings = {"engine_workers": "1", "job_lease_s": "4", "drain_s": "0"}
    data.mkdir(exist_ok=True)
    process = ServedProcess(data, free_port(), settings if url is None else settings | {"database_url": url})
    try:
        process.start()
        with httpx.Client(base_url=process.url, timeout=60.0, trust_env=False) as client:
            yield client
        process.tell(signal.SIGTERM)
        assert process.ended() == 0
    finally:
        process.kill()


def screened(client: httpx.Client, many: int, contacts: Any) -> str:
    """A screening of rotor 37 with one damping after the other."""
    blades = [BLADE | {"name": f"r37-{i}", "damping_ratio": 1e-3 * (1 + i / 20)} for i in range(many)]
    body = {"blades": blades, "contacts": contacts, "map_shape": [12, 12]}
    answer = client.post("/v1/screenings", json=body)
    assert answer.status_code == 202, answer.text
    return answer.json()["id"]


def until(client: httpx.Client, job: str, there: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    deadline = time.monotonic() + 400.0
    while not there(found := client.get(f"/v1/screenings/{job}").json()):
        assert found["state"] in ("queued", "running", "done"), found
        assert time.monotonic() < deadline, found
        time.sleep(0.05)
    return found


def results(client: httpx.Client, job: str) -> list[bytes]:
    """The results in every form."""
    answers = [client.get(f"/v1/screenings/{job}/results", headers={"Accept": form}) for form in FORMS]
    assert [answer.status_code for answer in answers] == [200] * len(FORMS)
    return [answer.content for answer in answers]


def chunks(data: Path, job: str) -> set[str]:
    return {path.name for path in (data / "jobs" / job / "chunks").iterdir()}


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=needs_postgres)])
def databases(request: pytest.FixtureRequest) -> Iterator[tuple[str | None, str | None]]:
    """URLs of two databases, the second to restore into."""
    if request.param == "sqlite":
        yield None, None
        return
    with ExitStack() as stack:
        server = stack.enter_context(running_postgres())
        yield stack.enter_context(empty_database(server)), stack.enter_context(empty_database(server))


def done(job: dict[str, Any]) -> bool:
    return job["state"] == "done"


def test_a_backup_of_a_running_job_is_restored_elsewhere_and_ends_as_the_original_did(tmp_path, databases):
    here, there = tmp_path / "here", tmp_path / "there"
    archive, (url, other) = tmp_path / "backup.tar", databases
    with service(here, url) as client:
        over = screened(client, 2, [{"weights": {"LE": 1.0}}])
        until(client, over, done)
        running = screened(client, MANY, CONTACTS)
        until(client, running, lambda job: job["progress"]["done"] >= 2)
        subprocess.run(
            rubscreen("backup", str(archive), "--data", str(here), url=url), check=True, timeout=120
        )
        expected = results(client, over)
        report = client.get(f"/v1/screenings/{over}/report").content
        until(client, running, done)
        expected_later = results(client, running)
    all_chunks = chunks(here, running)
    # Nothing of the original can be used by mistake, its models included.
    shutil.rmtree(here)

    restored = rubscreen("restore", str(archive), "--data", str(there), url=other)
    subprocess.run(restored, check=True, timeout=120)
    stored = chunks(there, running)
    assert 2 <= len(stored) < MANY, "the backup was made too late to say anything"
    with service(there, other) as client:
        assert results(client, over) == expected
        assert client.get(f"/v1/screenings/{over}/report").content == report
        ended = until(client, running, done)
        assert ended["progress"]["done"] == MANY
        assert results(client, running) == expected_later
        assert chunks(there, running) == all_chunks
    log = [json.loads(line) for line in (there / "jobs" / running / "log.jsonl").read_text().splitlines()]
    # Of what the backup held nothing was computed again.
    assert sorted(entry["chunk"] for entry in log if entry["event"] == "stored") == list(range(MANY))


@needs_postgres
def test_a_backup_of_postgresql_is_restored_into_an_empty_database_only(tmp_path):
    data, archive = tmp_path / "data", tmp_path / "b.tar"
    with running_postgres() as server, empty_database(server) as url, empty_database(server) as other:
        with service(data, url) as client:
            assert client.get("/v1/screenings").json()["jobs"] == []
            made = rubscreen("backup", str(archive), "--data", str(data), url=url)
            subprocess.run(made, check=True, timeout=120)
        used = _said(rubscreen("restore", str(archive), "--data", str(tmp_path / "new"), url=url))
        assert "a service has used it" in used
        as_sqlite = _said(rubscreen("restore", str(archive), "--data", str(tmp_path / "new"), url=None))
        assert "empty PostgreSQL database" in as_sqlite
        without = os.environ | {"PATH": str(Path(sys.executable).parent)}
        asked = rubscreen("restore", str(archive), "--data", str(tmp_path / "new"), url=other)
        assert "pg_restore, which is not installed" in _said(asked, env=without)
        assert not (tmp_path / "new").exists()


def _said(command: list[str], **options: Any) -> str:
    refused = subprocess.run(command, capture_output=True, text=True, timeout=120, **options)
    assert refused.returncode == 2, refused.stdout
    return refused.stderr


def test_the_archive_can_be_looked_into_with_tar(tmp_path):
    with service(tmp_path / "data", None):
        pass
    made = rubscreen("backup", str(tmp_path / "b.tar"), "--data", str(tmp_path / "data"), url=None)
    subprocess.run(made, check=True, timeout=120)
    with tarfile.open(tmp_path / "b.tar") as tar:
        names = tar.getnames()
    assert names[:3] == ["backup.json", "database/rubscreen.sqlite-queue", "database/rubscreen.sqlite"]
    assert names[-1] == "manifest.jsonl"

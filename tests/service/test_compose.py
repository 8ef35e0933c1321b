"""compose.yaml carried out without containers: its commands, environments and health checks as processes.

Not replayed: images, networks and volumes, and the names of hosts, for which the loopback stands. PostgreSQL
is one of the tests' own.
"""

from __future__ import annotations

import getpass
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml
from postgres_server import empty_database, needs_postgres, running_postgres
from served_process import free_port

from sdm_core.blade import blade_to_dict, example_blade

REPOSITORY = Path(__file__).parents[2]
COMPOSE = yaml.safe_load((REPOSITORY / "compose.yaml").read_text(encoding="utf-8"))
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
OURS = ("replica-1", "replica-2", "scheduler", "worker")
# Of the Compose specification, as far as this file uses it.
KNOWN = {
    *("image", "build", "init", "restart", "environment", "volumes", "networks", "healthcheck", "command"),
    *("ports", "depends_on", "stop_grace_period"),
}
needs_nginx = pytest.mark.skipif(
    shutil.which("nginx") is None and not os.environ.get("CI"), reason="nginx is not installed"
)


def test_every_name_in_it_leads_somewhere():
    assert set(COMPOSE) <= {"name", "services", "networks", "volumes", "x-rubscreen", "x-replica"}
    for name, service in SERVICES.items():
        assert set(service) <= KNOWN, name
        assert set(service.get("depends_on", ())) <= set(SERVICES), name
        assert set(service.get("networks", ())) <= set(COMPOSE["networks"]), name
        for volume in service.get("volumes", ()):
            source = volume.partition(":")[0]
            assert source in COMPOSE["volumes"] or (REPOSITORY / source).is_file(), volume


def test_nothing_but_the_balancer_can_be_reached_from_outside():
    assert [name for name, service in SERVICES.items() if "ports" in service] == ["nginx"]
    assert SERVICES["nginx"]["ports"] == ["${RUBSCREEN_PUBLISH:-127.0.0.1:8080}:80"]
    assert COMPOSE["networks"]["inside"]["internal"] is True
    for name in ("postgres", "scheduler", "worker"):
        assert list(SERVICES[name]["networks"]) == ["inside"], name


def test_whoever_computes_sees_the_data_where_the_image_keeps_it():
    dockerfile = (REPOSITORY / "Dockerfile").read_text(encoding="utf-8")
    kept = re.search(r"^VOLUME (.*)$", dockerfile, re.MULTILINE)
    assert kept is not None
    for name in OURS:
        assert SERVICES[name]["volumes"] == [f"data:{kept[1]}"], name


def test_every_secret_and_choice_is_in_the_example_of_the_environment():
    named = set(re.findall(r"\$\{([A-Z_]+)", (REPOSITORY / "compose.yaml").read_text(encoding="utf-8")))
    lines = (REPOSITORY / ".env.example").read_text(encoding="utf-8").splitlines()
    given = dict(line.split("=", 1) for line in lines if line and not line.startswith("#"))
    assert set(given) == named
    assert given["POSTGRES_PASSWORD"] == ""  # nobody starts with one that everybody knows
    assert ".env" in (REPOSITORY / ".gitignore").read_text(encoding="utf-8").splitlines()


def test_replicas_stop_no_sooner_than_they_have_drained():
    from service.settings import Settings

    settings = Settings()
    for name in ("replica-1", "replica-2"):
        patience = float(SERVICES[name]["stop_grace_period"].removesuffix("s"))
        assert patience > settings.drain_s + settings.shutdown_s


@dataclass
class Stack:
    """The services as processes."""

    folder: Path
    replacements: dict[str, str]
    processes: list[subprocess.Popen[bytes]]

    def said(self, text: str) -> str:
        """A text of compose.yaml with what stands for hosts, ports and passwords here."""
        text = re.sub(r"\$\{[A-Z_]+:-([^}]*)\}", r"\1", text)
        for there, here in self.replacements.items():
            text = text.replace(there, here)
        return text

    def environment(self, name: str) -> dict[str, str]:
        kept = {key: value for key, value in os.environ.items() if not key.startswith("RUBSCREEN_")}
        told = {key: self.said(value) for key, value in SERVICES[name].get("environment", {}).items()}
        # On the loopback it would ask for no keys.
        return kept | {"RUBSCREEN_DATA_FOLDER": str(self.folder / "data"), "RUBSCREEN_AUTH": "on"} | told

    def run(self, name: str, command: list[str]) -> subprocess.Popen[bytes]:
        command = [self.said(word) for word in command]
        program = [sys.executable, "-m", "service.cli"] if command[0] == "rubscreen" else ["dask"]
        program = [sys.executable] if command[0] == "python" else program
        with (self.folder / f"{name}.log").open("ab") as log:
            environment = self.environment(name)
            process = subprocess.Popen([*program, *command[1:]], env=environment, stdout=log, stderr=log)
        self.processes.append(process)
        return process


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Stack, str, str]]:
    """The whole of it running: with the balancer's address and a key, made as the documentation says."""
    folder = tmp_path_factory.mktemp("compose")
    ports = {name: free_port() for name in ("scheduler", "replica-1", "replica-2", "nginx")}
    with running_postgres() as server, empty_database(server) as url:
        replacements = {
            "postgresql://rubscreen:${POSTGRES_PASSWORD:?put it into .env}@postgres/rubscreen": url,
            "tcp://scheduler:8786": f"tcp://127.0.0.1:{ports['scheduler']}",
            "8786": str(ports["scheduler"]),
            "/tmp/rubscreen-workers": str(folder / "workers"),
        }
        made = Stack(folder, replacements, [])
        try:
            yield made, *_started(made, ports)
        finally:
            for process in reversed(made.processes):
                process.send_signal(signal.SIGTERM)
            for process in made.processes:
                try:
                    process.wait(20.0)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()


def _started(made: Stack, ports: dict[str, int]) -> tuple[str, str]:
    key = subprocess.run(
        [sys.executable, "-m", "service.cli", "keys", "create", "design office", "--role", "submit"],
        env=made.environment("replica-1"), stdout=subprocess.PIPE, text=True, check=True,
    ).stdout.strip()  # fmt: skip
    made.run("scheduler", SERVICES["scheduler"]["command"])
    made.run("worker", SERVICES["worker"]["command"])
    dockerfile = (REPOSITORY / "Dockerfile").read_text(encoding="utf-8")
    command = json.loads(re.findall(r"^CMD (.*)$", dockerfile, re.MULTILINE)[-1])
    for name in ("replica-1", "replica-2"):
        made.replacements |= {"0.0.0.0": "127.0.0.1", "8000": str(ports[name])}
        made.run(name, command)
    _balance(made, ports)
    url = f"http://127.0.0.1:{ports['nginx']}"
    deadline = time.monotonic() + 120.0
    for port in (ports["replica-1"], ports["replica-2"], ports["nginx"]):
        while _status(f"http://127.0.0.1:{port}/readyz") != 200:
            assert all(process.poll() is None for process in made.processes), _logs(made)
            assert time.monotonic() < deadline, _logs(made)
            time.sleep(0.2)
    return url, key


def _balance(made: Stack, ports: dict[str, int]) -> None:
    """nginx by the command of compose.yaml, its folders exchanged for those of this test."""
    folder = made.folder
    shell, flag, script = SERVICES["nginx"]["command"]
    source = SERVICES["nginx"]["volumes"][0].split(":")
    script = script.replace(source[1], str(REPOSITORY / source[0]))
    script = script.replace("/etc/nginx/conf.d/default.conf", str(folder / "default.conf"))
    script, _, last = script.rpartition("&&")
    subprocess.run([shell, flag, script], check=True)
    assert last.split() == ["exec", "nginx", "-g", "'daemon", "off;'"]
    text = (folder / "default.conf").read_text(encoding="utf-8")
    for name in ("replica-1", "replica-2"):
        address = SERVICES[name]["networks"]["front"]["ipv4_address"]
        assert text.count(f"server {address}:8000 ") == 1
        text = text.replace(f"{address}:8000", f"127.0.0.1:{ports[name]}")
    text = text.replace("listen 80;", f"listen 127.0.0.1:{ports['nginx']};")
    (folder / "default.conf").write_text(text)
    places = "".join(f"{kind}_temp_path {folder}/{kind};" for kind in ("proxy", "fastcgi", "uwsgi", "scgi"))
    places += f"client_body_temp_path {folder}/body; access_log off;"
    whole = f"pid {folder}/pid; user {getpass.getuser()}; error_log {folder}/error.log; events {{}}"
    (folder / "nginx.conf").write_text(f"{whole} http {{ {places} include {folder}/default.conf; }}")
    command = ["nginx", "-p", str(folder), "-c", str(folder / "nginx.conf"), "-g", "daemon off;"]
    made.processes.append(subprocess.Popen(command))


def _status(url: str) -> int | None:
    try:
        return httpx.get(url, timeout=10.0, trust_env=False).status_code
    except httpx.TransportError:
        return None


def _logs(made: Stack) -> str:
    return "".join(path.read_text()[-2000:] for path in made.folder.glob("*.log"))


@needs_postgres
@needs_nginx
def test_the_whole_stack_screens_a_blade_for_who_has_a_key_and_for_nobody_else(stack):
    made, url, key = stack
    blade = blade_to_dict(example_blade("nasa_rotor_37"))
    body = {"blades": [blade], "contacts": [{"weights": {"LE": 1.0}}], "map_shape": [8, 8]}
    with httpx.Client(base_url=url, trust_env=False, timeout=30.0) as client:
        assert client.post("/v1/screenings", json=body).status_code == 401
        client.headers["Authorization"] = f"Bearer {key}"
        answer = client.post("/v1/screenings", json=body)
        assert answer.status_code == 202, answer.text
        where, deadline = answer.headers["location"], time.monotonic() + 90.0
        while (job := client.get(where).json())["state"] != "done":
            assert time.monotonic() < deadline and job["state"] != "failed", (job, _logs(made))
            time.sleep(0.2)
        assert client.get(f"{where}/results").json()["total"] == 1
        # A file larger than the body of a question may be.
        lines = (b" " * 2**24 + b"\n") * 4 + b" " * 2**20 + b'{"name": "none"}'
        file = {"content": lines, "headers": {"Content-Type": "application/x-ndjson"}}
        upload = client.post("/v1/uploads", **file)
        assert upload.status_code == 201, upload.text
        assert (upload.json()["size_bytes"], upload.json()["blades"]) == (len(lines), 1)
    # By the worker, not by one of a replica's own.
    assert not (made.folder / "data" / "scratch").exists()


@needs_postgres
@needs_nginx
def test_the_scheduler_is_healthy_while_it_runs(stack):
    made, _, _ = stack
    kind, *check = SERVICES["scheduler"]["healthcheck"]["test"]
    assert kind == "CMD"
    assert made.run("scheduler", check).wait(20.0) == 0
    made.replacements = {"8786": str(free_port())}
    assert made.run("scheduler", check).wait(20.0) != 0

"""Workers elsewhere, by the commands of docs/how-to/scale-out.md: with TLS, and for nobody without."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from served_process import ServedProcess, free_port

from sdm_core.blade import blade_to_dict, example_blade
from sdm_core.errors import InvalidInput
from service.jobs.engine import DaskEngine, EngineGone, Tls, checked_scheduler

HOW_TO = Path(__file__).parents[2] / "docs" / "how-to"
FILES = {"ca": "ca.pem", "cert": "dask.pem", "key": "dask.key"}
BLADES = 6


def documented(name: str, **replaced: str) -> str:
    """The commands of a block of the documentation, with words exchanged."""
    text = (HOW_TO / "scale-out.md").read_text(encoding="utf-8")
    found = re.findall(rf"^```sh {name}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert len(found) == 1
    for there, here in replaced.items():
        assert there in found[0], there
        found[0] = found[0].replace(there, here)
    return found[0]


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _certificates(tmp_path_factory.mktemp("tls"))


def _certificates(folder: Path) -> Path:
    subprocess.run(["bash", "-ec", documented("certificates")], cwd=folder, check=True, capture_output=True)
    return folder


def tls(folder: Path) -> Tls:
    return Tls(folder / FILES["ca"], folder / FILES["cert"], folder / FILES["key"])


@pytest.fixture(scope="module")
def scheduler(certificates: Path) -> Iterator[str]:
    """The address of a scheduler with three workers, all started as documented."""
    port = str(free_port())
    scratch = {"/tmp/rubscreen-workers": str(certificates / "workers")}
    here = {"8786": port, "SCHEDULER": "127.0.0.1"}
    commands = [documented("scheduler", **{"8786": port}), documented("worker", **here, **scratch)]
    with (certificates / "log").open("ab") as log:
        processes = [
            subprocess.Popen(["bash", "-c", f"exec env {command}"], cwd=certificates, stdout=log, stderr=log)
            for command in commands
        ]
    address = f"tls://127.0.0.1:{port}"
    try:
        _wait_for(address, certificates, 3)
        yield address
    finally:
        for process in reversed(processes):
            process.send_signal(signal.SIGINT)
        for process in processes:
            process.wait(30.0)


def _wait_for(address: str, certificates: Path, workers: int) -> None:
    engine = DaskEngine(address, 0, certificates, tls(certificates))
    deadline = time.monotonic() + 60.0
    try:
        while True:
            try:
                if engine.slots() == workers:
                    return
            except EngineGone:
                pass
            assert time.monotonic() < deadline, (certificates / "log").read_text()
            time.sleep(0.2)
    finally:
        engine.close()


def _screened(service: ServedProcess, kill_a_worker_of: Path | None = None) -> tuple[set[str], bytes]:
    """A screening to its end: its chunks, whose names are checksums, and its ranking."""
    blade = blade_to_dict(example_blade("nasa_rotor_37"))
    blades = [blade | {"name": f"r37-{i}", "damping_ratio": 1e-3 * (1 + i / 20)} for i in range(BLADES)]
    contacts = [{"name": f"c{i}", "weights": {"LE": 1.0, "TE": 0.1 + 0.05 * i}} for i in range(16)]
    body: dict[str, Any] = {"blades": blades, "contacts": contacts, "map_shape": [12, 12]}
    with httpx.Client(base_url=service.url, trust_env=False, timeout=60.0) as client:
        where = client.post("/v1/screenings", json=body).headers["location"]
        deadline, killed = time.monotonic() + 150.0, kill_a_worker_of is None
        while (job := client.get(where).json())["state"] != "done":
            assert job["state"] in ("queued", "running", "waiting"), job
            assert time.monotonic() < deadline, job
            if not killed and job["progress"]["done"] >= 1:
                assert kill_a_worker_of is not None
                os.kill(_a_worker_of(kill_a_worker_of), signal.SIGKILL)
                killed = True
            time.sleep(0.1)
        assert killed
        ranking = client.get(f"{where}/results", headers={"Accept": "text/csv"}).content
    folder = service.data / "jobs" / where.rpartition("/")[2] / "chunks"
    return {path.name for path in folder.iterdir()}, ranking


def _a_worker_of(certificates: Path) -> int:
    """One of the processes that compute, not the one that watches over them."""
    import psutil

    computing = []
    for process in psutil.process_iter(["cwd", "cmdline"]):
        command = " ".join(process.info["cmdline"] or ())
        if process.info["cwd"] == str(certificates) and "spawn_main" in command:
            computing.append(process.pid)
    assert len(computing) >= 3
    return computing[0]


def test_a_screening_is_the_same_on_workers_elsewhere_though_one_is_killed(tmp_path, scheduler, certificates):
    names = {"scheduler_tls_ca": "ca", "scheduler_tls_cert": "cert", "scheduler_tls_key": "key"}
    elsewhere = {name: str(certificates / FILES[part]) for name, part in names.items()}
    elsewhere |= {"scheduler": scheduler, "drain_s": "0"}
    # The documentation sets just these.
    told = set(re.findall(r"RUBSCREEN_([A-Z_]+)=", documented("service")))
    assert told == {name.upper() for name in elsewhere} - {"DRAIN_S"}
    found = []
    for name, settings, watched in (
        ("local", {"engine_workers": "2", "drain_s": "0"}, None),
        ("elsewhere", elsewhere, certificates),
    ):
        (tmp_path / name).mkdir()
        service = ServedProcess(tmp_path / name, free_port(), settings)
        try:
            found.append(_screened(service.start(), watched))
        finally:
            service.tell(signal.SIGTERM)
            service.ended()
    assert found[0] == found[1]
    assert len(found[0][0]) == BLADES
    assert not (tmp_path / "elsewhere" / "scratch").exists()


def test_who_has_no_certificate_of_the_authority_is_refused_by_the_scheduler(
    scheduler, certificates, tmp_path
):
    stranger = _certificates(tmp_path)
    # Of another authority, that he alone trusts; and in his own name, trusting ours.
    own = Tls(certificates / FILES["ca"], stranger / FILES["cert"], stranger / FILES["key"])
    for who in (tls(stranger), own):
        engine = DaskEngine(scheduler, 0, tmp_path, who)
        with pytest.raises(EngineGone):
            engine.slots()
        engine.close()
    engine = DaskEngine(scheduler.replace("tls", "tcp"), 0, tmp_path)
    with pytest.raises(EngineGone):
        engine.slots()
    engine.close()
    with pytest.raises(InvalidInput, match="scheduler_tls_ca"):
        checked_scheduler(scheduler, None)
    # Beneath dask: without a certificate not a byte of its protocol is taken.
    host, port = scheduler.removeprefix("tls://").split(":")
    context = ssl.create_default_context(cafile=str(certificates / FILES["ca"]))
    context.check_hostname = False
    try:
        with (
            socket.create_connection((host, int(port)), 5.0) as plain,
            context.wrap_socket(plain) as encrypted,
        ):
            encrypted.sendall(b"\0" * 16)
            heard = encrypted.recv(1)
    except OSError:
        heard = b""
    assert heard == b""


def test_nothing_of_scheduler_and_workers_listens_without_tls_beyond_this_machine(scheduler, certificates):
    import psutil

    processes = [
        process for process in psutil.process_iter(["cwd"]) if process.info["cwd"] == str(certificates)
    ]
    listening = {
        connection.laddr.port
        for process in processes
        for connection in process.net_connections("tcp")
        if connection.status == psutil.CONN_LISTEN and connection.laddr.ip not in ("127.0.0.1", "::1")
    }
    context = ssl.create_default_context(cafile=str(certificates / FILES["ca"]))
    context.check_hostname = False
    context.load_cert_chain(certificates / FILES["cert"], certificates / FILES["key"])
    assert len(listening) >= 4
    for port in listening:
        with socket.create_connection(("127.0.0.1", port), 5.0) as plain, context.wrap_socket(plain):
            pass


SRUN = """#!/usr/bin/env bash
while [[ $1 == --* ]]; do echo "$1" >>"$0.log"; shift; done
exec "$@"
"""


def test_the_slurm_recipe_starts_scheduler_and_workers(certificates, tmp_path):
    # SLURM's own programs are stood in for: what srun is given is run here.
    (tmp_path / "srun").write_text(SRUN)
    (tmp_path / "scontrol").write_text(
        '#!/usr/bin/env bash\n[[ "$*" == "show hostnames n[1-2]" ]] && echo 127.0.0.1\n'
    )
    for name in ("srun", "scontrol"):
        (tmp_path / name).chmod(0o755)
    port = free_port()
    environment = os.environ | {
        "PATH": f"{tmp_path}:{Path(sys.executable).parent}:{os.environ['PATH']}",
        "RUBSCREEN_TLS": str(certificates),
        "RUBSCREEN_ADDRESS": str(tmp_path / "address"),
        "RUBSCREEN_PORT": str(port),
        "SLURM_JOB_NODELIST": "n[1-2]",
        "SLURM_CPUS_PER_TASK": "2",
        "TMPDIR": str(tmp_path),
    }
    with (tmp_path / "log").open("ab") as log:
        job = subprocess.Popen(
            ["bash", str(HOW_TO / "slurm.sbatch")],
            env=environment,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
    try:
        deadline = time.monotonic() + 30.0
        while not (tmp_path / "address").is_file():
            assert job.poll() is None and time.monotonic() < deadline, (tmp_path / "log").read_text()
            time.sleep(0.1)
        address = (tmp_path / "address").read_text().strip()
        assert address == f"tls://127.0.0.1:{port}"
        _wait_for(address, certificates, 2)
    finally:
        os.killpg(job.pid, signal.SIGTERM)
        job.wait(30.0)
    assert "--nodelist=127.0.0.1" in (tmp_path / "srun.log").read_text()


@pytest.mark.parametrize("unit", sorted(path.name for path in HOW_TO.glob("*.service")))
def test_systemd_takes_the_units(unit, tmp_path):
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd is not installed")
    text = (HOW_TO / unit).read_text(encoding="utf-8")
    program = re.search(r"^ExecStart=(\S+)", text, re.MULTILINE)
    assert program is not None
    # Where it will be installed, nothing is yet.
    (tmp_path / unit).write_text(text.replace(program[1], "/bin/true").replace("User=rubscreen", "User=root"))
    said = subprocess.run(["systemd-analyze", "verify", str(tmp_path / unit)], capture_output=True, text=True)
    assert (said.returncode, unit in said.stderr) == (0, False), said.stderr


@pytest.mark.parametrize("unit", sorted(path.name for path in HOW_TO.glob("*.service")))
def test_the_units_start_programs_with_options_these_have(unit):
    command = re.search(r"^ExecStart=(.*)$", (HOW_TO / unit).read_text(encoding="utf-8"), re.MULTILINE)
    assert command is not None
    program, verb, *options = command[1].split()
    ours = [sys.executable, "-m", "service.cli"] if program.endswith("/rubscreen") else ["dask"]
    helped = subprocess.run(
        [*ours, verb, "--help"], capture_output=True, text=True, env=os.environ | {"COLUMNS": "200"}
    )
    for option in options:
        if option.startswith("--"):
            assert option.partition("=")[0] in helped.stdout, option

"""The Dockerfile's steps, taken from it and carried out in an empty folder, lead to a service that is ready.

No container engine is needed. Replayed to the letter: every COPY (nothing else of the repository is there),
the `pip install` step, the command and the health check; as on the image, by a user without privileges whose
home is empty. Not replayed: the base image (a new virtual environment of this Python stands for it, or of a
copy of it where only root may run this one), the `useradd` (an existing user stands for the new one,
and gets the data folder) and port 8000 (a free one, on the loopback only).

The new environment sees the dependencies this one has, so that the install step installs the project, not
torch once more; RUBSCREEN_FULL_INSTALL=1 leaves it empty and installs everything.
"""

from __future__ import annotations

import json
import os
import pwd
import re
import shutil
import signal
import socket
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest

from service.rest.question_schemas import POINTS_EXAMPLE

REPOSITORY = Path(__file__).parents[2]
DOCKERFILE = REPOSITORY / "Dockerfile"


def steps() -> list[tuple[str, str]]:
    """(instruction, argument) of every step of the Dockerfile."""
    text = re.sub(r"(?m)^#.*\n?", "", DOCKERFILE.read_text(encoding="utf-8")).replace("\\\n", " ")
    return [(line.split()[0], line.split(maxsplit=1)[1]) for line in text.splitlines() if line.strip()]


def argument(instruction: str) -> str:
    """The argument of the last step of that kind, which is the one that counts."""
    return [text for name, text in steps() if name == instruction][-1]


@dataclass
class Image:
    """What the steps made: a folder in place of the image's root, and who runs there."""

    root: Path
    environment: dict[str, str]
    user: dict[str, object]

    @property
    def home(self) -> Path:
        return self.root / "home"

    def run(self, command: list[str], **options: object) -> subprocess.Popen[str]:
        """Start a command as the image's user, in its home."""
        kept = {"cwd": self.home, "env": self.environment, "text": True} | self.user | options
        return subprocess.Popen(command, **kept)  # type: ignore[call-overload]


@pytest.fixture(scope="module")
def image() -> Iterator[Image]:
    """The image's file system, built by the Dockerfile's own steps."""
    root = Path(tempfile.mkdtemp(prefix="rubscreen-image-"))
    root.chmod(0o755)
    try:
        yield _built(root)
    finally:
        shutil.rmtree(root, ignore_errors=True)


def _built(root: Path) -> Image:
    home, user = root / "home", {}
    home.mkdir()
    if os.geteuid() == 0:
        nobody = pwd.getpwnam("nobody")
        os.chown(home, nobody.pw_uid, nobody.pw_gid)
        user = {"user": nobody.pw_uid, "group": nobody.pw_gid, "extra_groups": []}
    environment = _environment(root, anyone=bool(user))
    image = Image(root, environment | {"HOME": str(home)}, user)
    where = root
    for instruction, text in steps():
        if instruction == "WORKDIR":
            where = root / text.lstrip("/")
            where.mkdir(parents=True, exist_ok=True)
        elif instruction == "COPY":
            _copy(text.split(), where)
        elif instruction == "RUN" and "install -d -o" in text:
            kept = root / text.rpartition(" ")[2].lstrip("/")
            kept.mkdir(parents=True)
            if user:
                os.chown(kept, nobody.pw_uid, nobody.pw_gid)
        elif instruction == "ENV":
            name, _, value = text.partition("=")
            image.environment[name] = str(root / value.lstrip("/")) if value.startswith("/") else value
        elif instruction == "RUN" and text.startswith("pip "):
            subprocess.run(["sh", "-c", text], cwd=where, env=environment, check=True)
    return image


def _environment(root: Path, *, anyone: bool) -> dict[str, str]:
    """Make a virtual environment below `root`; the variables of a process in it."""
    hidden = ("RUBSCREEN_", "PYTHON", "VIRTUAL_ENV")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(hidden)}
    prefix, version = Path(sys.base_prefix), f"python{sys.version_info.major}.{sys.version_info.minor}"
    if anyone and not _open_to_all(prefix):
        left_out = shutil.ignore_patterns("site-packages", "test", "__pycache__", "config-*", "*.a")
        shutil.copytree(prefix / "lib", root / "python" / "lib", ignore=left_out, symlinks=True)
        (root / "python" / "bin").mkdir()
        shutil.copy(prefix / "bin" / version, root / "python" / "bin")
        prefix = root / "python"
        kept["LD_LIBRARY_PATH"] = str(prefix / "lib")
    subprocess.run([prefix / "bin" / version, "-m", "venv", root / "venv"], env=kept, check=True)
    _lend_dependencies(root / "venv", anyone=anyone)
    return kept | {"PATH": f"{root / 'venv' / 'bin'}{os.pathsep}{os.environ['PATH']}"}


def _open_to_all(folder: Path) -> bool:
    """Whether any user can list and enter the folder."""
    return all(part.stat().st_mode & 0o005 == 0o005 for part in (folder, *folder.parents))


def _copy(arguments: list[str], where: Path) -> None:
    *sources, target = arguments
    for source in sources:
        found, to = REPOSITORY / source, where / target
        if found.is_dir():
            shutil.copytree(found, to, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(found, to)


def _lend_dependencies(environment: Path, *, anyone: bool) -> None:
    """Let the new environment see this one's packages, unless its user could not read them."""
    here = Path(sysconfig.get_path("purelib"))
    if os.environ.get("RUBSCREEN_FULL_INSTALL") or (anyone and not _open_to_all(here)):
        return
    # A path file adds the folder but does not run the path files in it: an editable install of the
    # project stays out of sight.
    inside = environment / here.relative_to(sys.prefix)
    (inside / "lent.pth").write_text(f"{here}\n", encoding="utf-8")


@pytest.fixture(scope="module")
def service(image: Image) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """The image's command, running."""
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        port = sock.getsockname()[1]
    command = [
        {"0.0.0.0": "127.0.0.1", "8000": str(port)}.get(word, word) for word in json.loads(argument("CMD"))
    ]
    log = image.root / "log"
    with log.open("w") as written:
        running = image.run(command, stdout=written, stderr=written)
        try:
            deadline = time.monotonic() + 120.0
            while _status(port) != 200:
                assert running.poll() is None and time.monotonic() < deadline, log.read_text()
                time.sleep(0.2)
            yield running, port
        finally:
            running.kill()
            running.wait()


def _status(port: int) -> int | None:
    try:
        return httpx.get(f"http://127.0.0.1:{port}/readyz", timeout=10.0).status_code
    except httpx.TransportError:
        return None


def test_the_image_runs_without_privileges():
    order = [name for name, _ in steps()]
    assert argument("USER") not in ("root", "0")
    assert order.index("USER") < order.index("CMD")
    others = [text for name, text in steps() if name == "RUN" and not text.startswith("pip install ")]
    assert [text.split()[0] for text in others] == ["apt-get", "useradd"]


def test_what_the_image_keeps_is_in_a_volume_that_its_user_can_write():
    kept = argument("VOLUME")
    assert argument("ENV") == f"RUBSCREEN_DATA_FOLDER={kept}"
    made = next(text for name, text in steps() if name == "RUN" and text.startswith("useradd"))
    assert made.endswith(f"install -d -o {argument('USER')} {kept}")


def test_everything_the_image_copies_gets_past_the_ignore_file():
    allowed = (REPOSITORY / ".dockerignore").read_text(encoding="utf-8").splitlines()
    for name, text in steps():
        if name == "COPY":
            assert {f"!{source}" for source in text.split()[:-1]} <= set(allowed)


def test_the_installed_service_is_not_the_working_tree(image):
    asked = [
        str(image.root / "venv" / "bin" / "python"),
        "-c",
        "import service, os; print(service.__file__, os.getuid())",
    ]
    found, _ = image.run(asked, stdout=subprocess.PIPE).communicate(timeout=60)
    file, uid = found.split()
    assert Path(file).is_relative_to(image.root / "venv")
    assert uid != "0"


def test_the_command_of_the_image_gets_ready_and_answers(service):
    _, port = service
    answer = httpx.post(f"http://127.0.0.1:{port}/v1/stability", json=POINTS_EXAMPLE, timeout=60.0)
    assert answer.status_code == 200
    assert None not in answer.json()["stable"]


def test_it_starts_for_others_only_when_there_is_a_key_and_says_how_to_make_one(image, tmp_path):
    asked = {
        "env": image.environment | {"RUBSCREEN_AUTH": "on", "RUBSCREEN_DATA_FOLDER": str(image.home / "keys")}
    }
    command = [{"0.0.0.0": "127.0.0.1", "8000": "0"}.get(word, word) for word in json.loads(argument("CMD"))]
    refused = image.run(command, stderr=subprocess.PIPE, **asked)
    assert "rubscreen keys create" in refused.communicate(timeout=60)[1]
    assert refused.returncode == 2
    made = image.run(
        ["rubscreen", "keys", "create", "office", "--role", "submit"], stdout=subprocess.PIPE, **asked
    )
    assert made.communicate(timeout=60)[0].startswith("rub_")
    running = image.run(command, stdout=subprocess.PIPE, **asked)
    try:
        assert "listening on" in running.stdout.readline()
    finally:
        running.kill()
        running.wait()


def test_the_health_check_passes_while_the_service_runs_and_fails_after_it_stops(image, service):
    running, port = service
    check = json.loads(argument("HEALTHCHECK").partition("CMD")[2].replace("8000", str(port)))
    assert image.run(check).wait(30) == 0
    running.send_signal(signal.SIGTERM)
    assert running.wait(40) in (0, -signal.SIGTERM)
    assert image.run(check, stderr=subprocess.DEVNULL).wait(30) != 0

"""`rubscreen serve` as a process of its own, as it runs in production."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import httpx


def free_port() -> int:
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return int(sock.getsockname()[1])


@dataclass
class ServedProcess:
    """A service on a port of the loopback; settings by their names, e.g. ``drain_s="0"``."""

    data: Path
    port: int
    settings: dict[str, str] = field(default_factory=dict)
    process: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def log(self) -> Path:
        return self.data / f"{self.port}.log"

    def start(self) -> ServedProcess:
        """Start it, and return once it is ready."""
        command = [sys.executable, "-m", "service.cli", "serve", "--port", str(self.port)]
        kept = {name: value for name, value in os.environ.items() if not name.startswith("RUBSCREEN_")}
        told = {f"RUBSCREEN_{name.upper()}": value for name, value in self.settings.items()}
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(
                [*command, "--data", str(self.data)], stdout=log, stderr=log, env=kept | told
            )
        deadline = time.monotonic() + 120.0
        while time.monotonic() < deadline:
            assert self.process.poll() is None, self.log.read_text()
            try:
                if httpx.get(f"{self.url}/readyz", timeout=10.0, trust_env=False).status_code == 200:
                    return self
            except httpx.TransportError:
                pass
            time.sleep(0.05)
        raise AssertionError(f"it never got ready: {self.log.read_text()}")

    def tell(self, number: signal.Signals) -> None:
        assert self.process is not None
        self.process.send_signal(number)

    def ended(self, within_s: float = 60.0) -> int:
        """The exit code."""
        assert self.process is not None
        return self.process.wait(within_s)

    def kill(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.wait()

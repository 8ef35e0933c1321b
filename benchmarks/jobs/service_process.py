"""A service in a process of its own, on the loopback, that can be killed."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import httpx
import psutil

_LISTENING = re.compile(r"listening on (http://\S+)")


class ServiceProcess:
    """``rubscreen serve`` with a data folder, and what it says.

    Parameters
    ----------
    settings
        RUBSCREEN_... variables, without that beginning: ``max_points="1000"``.
    """

    def __init__(self, data: Path, port: int = 0, **settings: Any) -> None:
        told = {f"RUBSCREEN_{name.upper()}": str(value) for name, value in settings.items()}
        command = [sys.executable, "-m", "service.cli", "serve", "--data", str(data), "--port", str(port)]
        kept = {k: v for k, v in os.environ.items() if not k.startswith("RUBSCREEN_")}
        self.process = subprocess.Popen(
            command,
            env={**kept, "OMP_NUM_THREADS": "1", **told},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        self.said: deque[str] = deque(maxlen=2000)
        self._address: str | None = None
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def __enter__(self) -> Self:
        try:
            return self.ready()
        except BaseException:
            self.kill()
            raise

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.kill()

    @property
    def url(self) -> str:
        """Where it listens."""
        assert self._address is not None
        return self._address

    def ready(self, patience_s: float = 90.0, probe: str = "/readyz") -> Self:
        """Wait until it says that it is ready; with `/healthz` as `probe`, until it answers at all."""
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            if self.process.poll() is not None:
                self._listener.join(5.0)
                raise RuntimeError("the service ended: " + "".join(self.said))
            if self._address is not None:
                try:
                    if httpx.get(f"{self._address}{probe}", timeout=20.0).status_code == 200:
                        return self
                except httpx.HTTPError:
                    pass
            time.sleep(0.05)
        raise RuntimeError("the service is not ready: " + "".join(self.said))

    def workers(self) -> list[psutil.Process]:
        """The processes that compute its chunks."""
        try:
            children = psutil.Process(self.process.pid).children(recursive=True)
        except psutil.NoSuchProcess:
            return []
        return [child for child in children if "spawn_main" in " ".join(_command(child))]

    def memory_bytes(self) -> int:
        """Resident memory of the service itself."""
        return int(psutil.Process(self.process.pid).memory_info().rss)

    def kill(self) -> None:
        """As a power cut would, for this process; its workers are left to find out by themselves."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def stop(self, patience_s: float = 60.0) -> int:
        """Ask it to stop, and wait; its exit status."""
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(patience_s)

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said.append(line)
            found = _LISTENING.search(line)
            if found is not None and self._address is None:
                self._address = found[1]


def _command(process: psutil.Process) -> list[str]:
    try:
        return process.cmdline()
    except psutil.Error:
        return []

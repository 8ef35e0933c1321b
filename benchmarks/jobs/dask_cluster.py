"""A dask scheduler and workers started by hand, on the loopback."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
import time
from collections import deque
from pathlib import Path
from types import TracebackType
from typing import Self

_ADDRESS = re.compile(r"Scheduler at:\s+((?:tcp|tls)://\S+)")
# Without a dashboard too dask serves pages, and on every address unless it is told one.
_PAGES = ("--no-dashboard", "--dashboard-address", "127.0.0.1:0")
_ALONE = ("--nthreads", "1", "--nworkers", "1", *_PAGES)


class DaskCluster:
    """A scheduler and `count` worker processes without a nanny: what is killed stays dead.

    Parameters
    ----------
    tls
        The options of ``dask scheduler`` and ``dask worker`` for TLS, where it is to be used.
    """

    def __init__(self, scratch: Path, count: int = 3, tls: tuple[str, ...] = ()) -> None:
        self._said: deque[str] = deque(maxlen=500)
        here = ("--host", "127.0.0.1")
        self._scheduler = self._start("dask_scheduler", *here, "--port", "0", *_PAGES, *tls)
        self.address = self._found_address()
        where = (self.address, *here, "--no-nanny", *_ALONE, "--local-directory", str(scratch), *tls)
        self.workers = [self._start("dask_worker", *where) for _ in range(count)]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in (*self.workers, self._scheduler):
            process.kill()
            process.wait()

    def _start(self, program: str, *options: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", f"distributed.cli.{program}", *options]
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        threading.Thread(target=self._listen, args=(process,), daemon=True).start()
        return process

    def _listen(self, process: subprocess.Popen[str]) -> None:
        assert process.stdout is not None
        for line in process.stdout:
            self._said.append(line)

    def _found_address(self, patience_s: float = 60.0) -> str:
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            for line in list(self._said):
                if (found := _ADDRESS.search(line)) is not None:
                    return found[1]
            time.sleep(0.1)
        raise RuntimeError("no scheduler: " + "".join(self._said))

"""Whether the service should be sent requests: what is checked, and how often at most."""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

import anyio
from anyio import to_thread

from service.records.database import Database

# A probe comes every few seconds from each balancer; answers as old as this are as good.
KEEP_S = 1.0
DATABASE_PATIENCE_S = 2.0
LEAST_FREE_BYTES = 2**20  # a few transactions of SQLite, and a line in each log


@dataclass(frozen=True)
class Check:
    """The outcome of one check.

    Attributes
    ----------
    ok
        Whether all is well.
    detail
        What was found, in words.
    needed
        False for what an operator should know of and does not keep the service from answering.
    remedy
        What to do when it is not well.
    """

    ok: bool
    detail: str
    needed: bool = True
    remedy: str = ""


class KeptCheck:
    """A check whose outcome is kept for a second, so that probes cannot load the service.

    Those who ask while it is being made wait for it, and share it.
    """

    def __init__(self, check: Callable[[], Awaitable[Check]], keep_s: float = KEEP_S) -> None:
        self._check, self._keep_s = check, keep_s
        self._lock = anyio.Lock()
        self._kept: tuple[float, Check] | None = None

    async def __call__(self) -> Check:
        """The outcome, at most `keep_s` old."""
        async with self._lock:
            if self._kept is None or time.monotonic() - self._kept[0] > self._keep_s:
                found = await self._check()
                self._kept = time.monotonic(), found
            return self._kept[1]


class DatabaseCheck:
    """Whether the database can be written to, without waiting long for one that is away."""

    def __init__(self, database: Database, patience_s: float = DATABASE_PATIENCE_S) -> None:
        self._database, self._patience_s = database, patience_s
        self._asking = threading.Lock()

    async def __call__(self) -> Check:
        """Ask; a question that is still open from before counts as no answer, and none is added to it."""
        answers = False
        if not self._asking.locked():
            with anyio.move_on_after(self._patience_s):
                answers = await to_thread.run_sync(self._answers, abandon_on_cancel=True)
        shown = self._database.shown
        if answers:
            return Check(True, f"{shown} can be read and written")
        return Check(False, f"{shown} does not answer", remedy="start it, or see to the network between")

    def _answers(self) -> bool:
        with self._asking:
            try:
                return self._database.answers()
            except Exception:  # whatever it is, it does not answer
                return False


def disk_check(folder: Path, reserve_bytes: int) -> Check:
    """Whether there is room left for the database to be written.

    Jobs wait by themselves while less than `reserve_bytes` is free, and questions are answered meanwhile.
    With only a quarter of that left it is not they who fill the disk, and the database is next. With less
    than `LEAST_FREE_BYTES` it is full, whatever the reserve.
    """
    least_bytes = max(reserve_bytes // 4, LEAST_FREE_BYTES)
    try:
        free = shutil.disk_usage(folder).free
    except OSError as error:
        return Check(False, f"{folder}: {error.strerror}", remedy="mount it, or give another data_folder")
    detail = f"{free / 2**20:,.0f} MiB free in {folder}"
    goes_on = max(reserve_bytes, LEAST_FREE_BYTES) / 2**20
    remedy = f"make room: jobs go on from {goes_on:,.0f} MiB on (min_free_bytes)"
    return Check(free >= least_bytes, detail, remedy=remedy)

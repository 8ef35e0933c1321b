"""Whether the service should be sent requests: what is checked, and how often at most."""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

import anyio
from anyio import CapacityLimiter, to_thread

from service.records.database import Database

# A probe comes every few seconds from each balancer; answers as old as this are as good.
KEEP_S = 1.0
PATIENCE_S = 2.0
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


class PatientCheck:
    """A check that may hang: made in a thread that nothing else waits for, and given up after a while.

    Parameters
    ----------
    ask
        Makes the check.
    late
        The outcome when it does not come in time; while one is still being made, the next is not begun.
    """

    def __init__(self, ask: Callable[[], Check], late: Check, patience_s: float = PATIENCE_S) -> None:
        self._ask, self._late, self._patience_s = ask, late, patience_s
        self._asking = threading.Lock()
        # Of its own: the threads that uploads are written in may all be taken.
        self._limiter = CapacityLimiter(1)

    async def __call__(self) -> Check:
        """Ask; a question that is still open from before counts as no answer, and none is added to it."""
        if not self._asking.locked():
            with anyio.move_on_after(self._patience_s):
                return await to_thread.run_sync(self._alone, abandon_on_cancel=True, limiter=self._limiter)
        return self._late

    def _alone(self) -> Check:
        with self._asking:
            return self._ask()


def database_check(database: Database, patience_s: float = PATIENCE_S) -> PatientCheck:
    """Whether the database can be written to, without waiting long for one that is away."""
    away = Check(False, f"{database.shown} does not answer", remedy="start it, or see to the network between")

    def ask() -> Check:
        try:
            answers = database.answers()
        except Exception:  # whatever it is, it does not answer
            return away
        return Check(True, f"{database.shown} can be read and written") if answers else away

    return PatientCheck(ask, away, patience_s)


def folder_check(folder: Path, reserve_bytes: int, patience_s: float = PATIENCE_S) -> PatientCheck:
    """As `disk_check`, without waiting long for a file system over a network that is away."""
    away = Check(False, f"{folder} does not answer", remedy="see to the file system it is on")
    return PatientCheck(lambda: disk_check(folder, reserve_bytes), away, patience_s)


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

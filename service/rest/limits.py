"""What is too much at once, and the work that waits its turn."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from threading import Event
from typing import TypeVar

from anyio import CapacityLimiter, to_thread
from starlette.requests import Request

from sdm_core.errors import Cancelled, InvalidInput, TooMuchWork
from sdm_core.interruption import interruptible

T = TypeVar("T")


class SlowBody(InvalidInput):
    """The body of the request did not arrive in time."""


class Busy(InvalidInput):
    """Too many requests are waiting already."""


class WorkQueue:
    """Runs work in threads, a few at a time, so that the event loop stays free.

    Work stops at its next checkpoint when its time is up, its client has hung up, or the service closes.

    Parameters
    ----------
    threads
        Calls that run at the same time.
    max_waiting
        Calls that may wait for a thread.
    deadline_s
        Time one call may take, from when it gets a thread.
    """

    def __init__(self, threads: int, max_waiting: int, deadline_s: float) -> None:
        self._limiter = CapacityLimiter(threads)
        self._max_waiting = max_waiting
        self._deadline_s = deadline_s
        self._closing = Event()

    def close(self) -> None:
        """Stop what still runs."""
        self._closing.set()

    @property
    def threads(self) -> int:
        """Calls that may run at the same time."""
        return int(self._limiter.total_tokens)

    @property
    def running(self) -> int:
        """Calls that run."""
        return self._limiter.statistics().borrowed_tokens

    @property
    def waiting(self) -> int:
        """Calls that wait for a thread."""
        return self._limiter.statistics().tasks_waiting

    def check_room(self) -> None:
        """Raise `Busy` when no further call may wait."""
        if (waiting := self.waiting) >= self._max_waiting:
            raise Busy("service", f"{waiting} requests waiting", "send the request again later")

    async def run(self, work: Callable[[], T], request: Request, *, turn_away: bool = True) -> T:
        """The outcome of `work`, from a thread.

        Parameters
        ----------
        turn_away
            Whether it is refused when as many calls wait as may.

        Raises
        ------
        Busy
        TooMuchWork
            When the time is up.
        Cancelled
            When the client has gone or the service closes.
        """
        if turn_away:
            self.check_room()
        gone = Event()

        def stop_at(end: float) -> Callable[[], None]:
            def check() -> None:
                if gone.is_set() or self._closing.is_set():
                    raise Cancelled("the client hung up, or the service is closing")
                if time.monotonic() > end:
                    found = f"more than {self._deadline_s:g} s of exact work"
                    raise TooMuchWork("request", found, "ask for fewer points, speeds or modes in one call")

            return check

        def guarded() -> T:
            with interruptible(stop_at(time.monotonic() + self._deadline_s)):
                return work()

        watch = asyncio.create_task(_hung_up(request, gone))
        try:
            return await to_thread.run_sync(guarded, limiter=self._limiter)
        finally:
            watch.cancel()


async def _hung_up(request: Request, gone: Event) -> None:
    """Set `gone` once the client has closed the connection."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
    gone.set()

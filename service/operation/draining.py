"""Leaving without losing a request: say so first, go on answering, then finish what is begun."""

from __future__ import annotations

import logging
import signal
import time
from dataclasses import dataclass, field
from threading import Event
from types import FrameType

import uvicorn

logger = logging.getLogger("rubscreen.service")


@dataclass
class Draining:
    """Whether the service is about to stop.

    From then on it is not ready, so that a balancer sends no more, and closes each connection after its
    answer, so that a client that keeps one makes the next elsewhere; but it answers everything that comes.

    Attributes
    ----------
    begun
        Whether it is about to stop.
    stopping
        Set once it stops: answers that have no end of their own, such as events of a job, end then.
    """

    begun: bool = False
    stopping: Event = field(default_factory=Event)


class DrainingServer(uvicorn.Server):
    """A server that drains before it stops, and ends with exit code 0.

    SIGTERM begins draining. SIGINT, which is Ctrl-C, stops without: somebody is waiting at a terminal. A
    second signal of either kind stops at once, whatever is being answered.

    Parameters
    ----------
    draining
        Shared with the application.
    drain_s
        How long it goes on answering after SIGTERM.
    """

    def __init__(self, config: uvicorn.Config, draining: Draining, drain_s: float) -> None:
        super().__init__(config)
        self._draining, self._drain_s = draining, drain_s
        self._stop_at: float | None = None
        self._announced = False

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Note a signal; nothing is logged here, since it may interrupt a line being logged.

        It is not remembered for being raised again afterwards, as uvicorn would: having drained as it was
        told to, the process ends well.
        """
        if self._stop_at is not None:
            self.should_exit = self.force_exit = True
            return
        wait_s = 0.0 if sig == signal.SIGINT or not self.started else self._drain_s
        self._draining.begun = True
        self._stop_at = time.monotonic() + wait_s
        self.should_exit = wait_s == 0.0

    async def on_tick(self, counter: int) -> bool:
        """Whether to stop now; asked ten times a second."""
        if self._stop_at is not None:
            if not self._announced:
                self._announced = True
                logger.info("draining for %.1f s", max(0.0, self._stop_at - time.monotonic()))
            self.should_exit = self.should_exit or time.monotonic() >= self._stop_at
        return await super().on_tick(counter)

    async def shutdown(self, sockets: list | None = None) -> None:
        """Finish what is begun, and the application's own shutdown even when told to hurry."""
        self._draining.stopping.set()
        await super().shutdown(sockets)
        if self.force_exit:  # left out by uvicorn, but what was counted and kept is written in it
            await self.lifespan.shutdown()

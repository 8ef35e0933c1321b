"""What is too large or too much, and the work that waits its turn."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Sized
from threading import Event
from typing import Any, TypeVar

import numpy as np
from anyio import CapacityLimiter, to_thread
from starlette.requests import Request

from sdm_core.blade import Blade
from sdm_core.blade.tracking import FURTHER_SHAPES
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import Cancelled, InvalidInput, OutOfSpeedRange, TooMuchWork
from sdm_core.interruption import interruptible
from service.settings import Settings

T = TypeVar("T")


class TooLarge(InvalidInput):
    """The request is larger than the service takes in one call."""


class SlowBody(InvalidInput):
    """The body of the request did not arrive in time."""


class Busy(InvalidInput):
    """Too many requests are waiting already."""


def check_length(field: str, values: Any, most: int, remedy: str = "split the request") -> None:
    """Refuse a list, object or text of more than `most` entries; other types are left to the core.

    Raises
    ------
    TooLarge
        Naming the field, its length and the remedy.
    """
    if isinstance(values, Sized) and len(values) > most:
        kind = "characters" if isinstance(values, str) else "entries"
        raise TooLarge(field, f"{len(values)} {kind}", f"give at most {most}, or {remedy}")


def check_blade_size(blade: dict[str, Any], settings: Settings) -> None:
    """Refuse a blade larger than any real one before any of it is read.

    Fields of the wrong type are left to the core, which names them.
    """
    reduce = "reduce the modal data"
    nodes = blade.get("tip_nodes")
    check_length("blade.name", blade.get("name"), settings.max_name_length, "shorten it")
    check_length("blade.tip_nodes", nodes, settings.max_tip_nodes, reduce)
    for i, node in enumerate(nodes if isinstance(nodes, list) else ()):
        check_length(f"blade.tip_nodes[{i}]", node, settings.max_name_length, "shorten it")
    for key in ("tip_radius_m", "tip_z_m", "tip_theta_rad"):
        check_length(f"blade.{key}", blade.get(key), settings.max_tip_nodes, reduce)
    check_length("blade.damping_ratio", blade.get("damping_ratio"), settings.max_modes, reduce)
    states = blade.get("states")
    check_length("blade.states", states, settings.max_states, reduce)
    for i, state in enumerate(states if isinstance(states, list) else ()):
        if isinstance(state, dict):
            _check_state_size(f"blade.states[{i}]", state, settings)


def _check_state_size(field: str, state: dict[str, Any], settings: Settings) -> None:
    reduce = "reduce the modal data"
    for key in ("frequency_hz", "mode_shape", *FURTHER_SHAPES):
        rows = state.get(key)
        check_length(f"{field}.{key}", rows, settings.max_modes, reduce)
        for j, row in enumerate(rows if isinstance(rows, list) else ()):
            check_length(f"{field}.{key}[{j}]", row, settings.max_tip_nodes, reduce)
    check_length(f"{field}.tip_growth_m", state.get("tip_growth_m"), settings.max_tip_nodes, reduce)


def check_reach(
    blade: Blade,
    contact: ContactConfiguration,
    speed_hz: np.ndarray,
    ke_field: str,
    ke: float,
    settings: Settings,
) -> None:
    """Refuse what no rotor does and the exact core would take hours for.

    Raises
    ------
    InvalidInput
        When a contact node is not the blade's.
    OutOfSpeedRange
        Where the blade's modal data do not reach.
    TooLarge
        When the blade vibrates too often in a revolution, its frequencies lie too far apart, or the
        contact is too stiff.
    """
    frequency = np.array([state.frequency_hz for state in blade.states])
    shape = np.array([state.mode_shape for state in blade.states])
    lowest, highest = float(frequency.min()), float(frequency.max())
    if highest > settings.max_frequency_span * lowest:
        found = f"{lowest:g} to {highest:g} Hz"
        most = settings.max_frequency_span
        raise TooLarge("blade.states", found, f"leave out modes {most:g} times above the first")
    slowest, fastest = int(np.argmin(speed_hz)), int(np.argmax(speed_hz))
    for i in (slowest, fastest):
        try:
            blade.at_speeds(speed_hz[i : i + 1])
        except OutOfSpeedRange as error:
            raise OutOfSpeedRange(f"speed_hz[{i}]", error.value, error.remedy) from None
    least = highest / settings.max_vibrations_per_revolution
    if speed_hz[slowest] < least:
        raise TooLarge(
            f"speed_hz[{slowest}]",
            float(speed_hz[slowest]),
            f"give at least {least:.6g} Hz for a natural frequency of {highest:g} Hz, or leave out the mode",
        )
    g_jj = (shape**2 * contact.weight_vector(blade.tip_nodes)).sum(axis=2)
    softest = float((g_jj / (2 * np.pi * frequency) ** 2).max())
    if ke * softest > settings.max_contact_ratio:
        most = settings.max_contact_ratio / softest
        raise TooLarge(
            ke_field, ke, f"give at most {most:.6g} N/m: the contact is far stiffer than the blade"
        )


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

    def check_room(self) -> None:
        """Raise `Busy` when no further call may wait."""
        waiting = self._limiter.statistics().tasks_waiting
        if waiting >= self._max_waiting:
            raise Busy("service", f"{waiting} requests waiting", "send the request again later")

    async def run(self, work: Callable[[], T], request: Request) -> T:
        """The outcome of `work`, from a thread.

        Raises
        ------
        TooMuchWork
            When the time is up.
        Cancelled
            When the client has gone or the service closes.
        """
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

"""Work shared by threads: compiled kernels leave Python's lock alone, and nothing has to be sent about."""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import TypeVar

from sdm_core.errors import Cancelled
from sdm_core.interruption import checkpoint, interruptible

_LONGEST_WAIT = 0.1  # s between checkpoints of the calling thread

Part = TypeVar("Part")
Result = TypeVar("Result")


def in_threads(
    work: Callable[[Part], Result], parts: Sequence[Part], workers: int
) -> Generator[tuple[int, Result], None, None]:
    """(index, result) of each part as they come; for work that leaves Python's lock alone.

    When the caller gives up or a part fails, parts not begun are dropped, and those begun stop at their next
    checkpoint.
    """
    given_up = threading.Event()

    def check() -> None:
        if given_up.is_set():
            raise Cancelled("the caller gave up")

    def watched(part: Part) -> Result:
        with interruptible(check):
            return work(part)

    with ThreadPoolExecutor(workers, thread_name_prefix="revolutions") as pool:
        pending: dict[Future[Result], int] = {}
        try:
            pending = {pool.submit(watched, part): i for i, part in enumerate(parts)}
            while pending:
                done, _ = wait(pending, _LONGEST_WAIT, FIRST_COMPLETED)
                checkpoint()
                for future in done:
                    i = pending.pop(future)
                    yield i, future.result()
        finally:
            given_up.set()
            for future in pending:
                future.cancel()

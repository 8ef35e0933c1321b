"""Work shared by threads: array operations of numpy let other threads run meanwhile."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextvars import copy_context
from typing import TypeVar

from sdm_core.interruption import checkpoint

Part = TypeVar("Part")
Result = TypeVar("Result")

_LONGEST_WAIT = 0.1  # s between checkpoints of the calling thread


def available_cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on Windows or macOS
        return os.cpu_count() or 1


def in_threads(work: Callable[[Part], Result], parts: Sequence[Part], threads: int) -> Iterator[Result]:
    """Results of each part as they come, in any order.

    Threads see the caller's context, so that what stops the caller stops them. When one part
    fails, or the caller gives up, parts not begun are dropped and the others waited for.
    """
    if threads <= 1 or len(parts) <= 1:
        for part in parts:
            checkpoint()
            yield work(part)
        return
    with ThreadPoolExecutor(min(threads, len(parts)), "solve") as pool:
        pending: set[Future[Result]] = {pool.submit(copy_context().run, work, part) for part in parts}
        try:
            while pending:
                done, pending = wait(pending, _LONGEST_WAIT, FIRST_COMPLETED)
                checkpoint()
                for future in done:
                    yield future.result()
        finally:
            pool.shutdown(cancel_futures=True)

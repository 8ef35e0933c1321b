"""Whether anybody still waits for what a worker computes; where nobody does, the work stops by itself.

A thread that computes cannot be stopped from outside. But dask tells a worker when a task of its is no longer
asked for: its job was cancelled, or the service that asked has gone. The worker then lets it run, and only
forgets the outcome; so the work looks at this mark at its checkpoints. It costs no message to anybody.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sdm_core.errors import Cancelled
from sdm_core.interruption import interruptible

_LOOK_EVERY_S = 0.2


@contextmanager
def while_wanted() -> Iterator[None]:
    """Run the block for as long as its outcome is wanted; outside of a dask worker to its end.

    Raises
    ------
    Cancelled
        At the first checkpoint of the block at which it is wanted no more.
    """
    check = _check_of_task()
    if check is None:
        yield
        return
    with interruptible(check):
        yield


def _check_of_task() -> Callable[[], None] | None:
    from distributed import get_worker

    try:
        worker = get_worker()
        key = worker.get_current_task()
    except (ValueError, KeyError):
        return None
    looked = time.monotonic()

    def check() -> None:
        nonlocal looked
        if time.monotonic() - looked < _LOOK_EVERY_S:  # checkpoints come thousands of times a second
            return
        looked = time.monotonic()
        task = worker.state.tasks.get(key)
        if task is None or task.state == "cancelled":
            raise Cancelled("nobody waits for this work any more")

    return check

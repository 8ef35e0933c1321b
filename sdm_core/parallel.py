"""Work shared by processes: small array operations hold Python's lock, so threads would not help."""

from __future__ import annotations

import logging
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from typing import Any, TypeVar

import numpy as np
from loky import get_reusable_executor

from sdm_core.errors import InvalidInput
from sdm_core.interruption import checkpoint

_log = logging.getLogger(__name__)

Part = TypeVar("Part")
Result = TypeVar("Result")

_LONGEST_WAIT = 0.1  # s between checkpoints of the calling process
_LOOK_EVERY = 1.0  # s, whether the parent is still there
_IDLE_S = 60.0  # after which workers leave
_IN_WORKER = "RUBSCREEN_WORKER"
_ALONE = {_IN_WORKER: "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def available_cores() -> int:
    """Cores that this process may use; one in a worker."""
    if _IN_WORKER in os.environ:
        return 1
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on Windows or macOS
        return os.cpu_count() or 1


def checked_workers(workers: Any) -> int:
    """`workers` where it is a whole number from 1 up, at most the cores there are.

    Raises
    ------
    InvalidInput
        Naming the value and the remedy.
    """
    if isinstance(workers, bool) or not isinstance(workers, int | np.integer) or workers < 1:
        raise InvalidInput("workers", workers, "give a whole number from 1 up, or None for what pays")
    return min(int(workers), max(available_cores(), 2))


def leave_with(parent: int) -> None:
    """Let this process end when the one that started it, `parent`, has ended, however it did."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK_EVERY)
        os._exit(0)

    threading.Thread(target=watch, daemon=True).start()


def shared(
    work: Callable[[Part], Result], parts: Sequence[Part], workers: int
) -> Iterator[tuple[int, Result]]:
    """(index, result) of each part as they come, in any order.

    Worker processes start in about a second and stay for a minute. When the caller gives up (checkpoint)
    or a part fails, parts not begun are dropped. When a worker dies, what is left is done here.

    Parameters
    ----------
    work
        A function at the top level of a module.
    workers
        1 works in this process.
    """
    left = dict(enumerate(parts))
    if workers > 1 and len(parts) > 1:
        pool = get_reusable_executor(
            max_workers=workers,
            timeout=_IDLE_S,
            env=_ALONE,
            initializer=leave_with,
            initargs=(os.getpid(),),
        )
        pending: dict[Future[Result], int] = {}
        try:
            pending = {pool.submit(work, part): i for i, part in left.items()}
            while pending:
                done, _ = wait(pending, _LONGEST_WAIT, FIRST_COMPLETED)
                checkpoint()
                for future in done:
                    i = pending.pop(future)
                    result = future.result()
                    del left[i]
                    yield i, result
        except BrokenExecutor as why:  # a worker was killed, say for memory
            _log.warning("a worker ended (%s): the %d parts left are done in this process", why, len(left))
        finally:
            for future in pending:
                future.cancel()
    for i, part in list(left.items()):
        checkpoint()
        yield i, work(part)

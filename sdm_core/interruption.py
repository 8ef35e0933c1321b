"""Long exact work can be stopped from outside: a deadline, a client that hung up, a service that closes.

Inner loops call `checkpoint()`; whoever starts the work says with `interruptible(check)` what that means.
The check belongs to the context (thread or task) it was set in, so calls beside it are not touched.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_check: ContextVar[Callable[[], None] | None] = ContextVar("check", default=None)


@contextmanager
def interruptible(check: Callable[[], None]) -> Iterator[None]:
    """Run the block with `check` called at every checkpoint; it stops the work by raising.

    Examples
    --------
    >>> from sdm_core.errors import Cancelled
    >>> def stop():
    ...     raise Cancelled("enough")
    >>> with interruptible(stop):
    ...     checkpoint()
    Traceback (most recent call last):
    sdm_core.errors.Cancelled: enough
    """
    token = _check.set(check)
    try:
        yield
    finally:
        _check.reset(token)


def checkpoint() -> None:
    """Raise what the surrounding `interruptible` block wants raised, if anything."""
    check = _check.get()
    if check is not None:
        check()

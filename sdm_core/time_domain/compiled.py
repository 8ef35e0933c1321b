"""Functions compiled by numba, kept on the disk where there is a place for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from numba import njit

Function = TypeVar("Function", bound=Callable)


def compiled(function: Function) -> Function:
    """The function as machine code, compiled at its first call; other threads run meanwhile.

    What was compiled is kept beside the source or in the user's cache. A service that may write to neither
    compiles once a process instead.
    """
    try:
        return njit(cache=True, nogil=True)(function)
    except RuntimeError:  # numba finds no folder that it may write to
        return njit(nogil=True)(function)

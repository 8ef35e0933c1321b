"""Functions compiled by numba, kept on the disk where there is a place for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

Function = TypeVar("Function", bound=Callable)


def compiled(function: Function) -> Function:
    """The function as machine code, compiled at its first call; other threads run meanwhile.

    What was compiled is kept beside the source or in the user's cache. A service that may write to neither
    compiles once a process instead.
    """
    # Called as the function is; numba's own type says less about that.
    machine_code: Any
    try:
        machine_code = njit(cache=True, nogil=True)(function)
    except RuntimeError:  # numba finds no folder that it may write to
        machine_code = njit(nogil=True)(function)
    return machine_code

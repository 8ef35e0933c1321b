"""Worker processes stand back behind what answers people."""

from __future__ import annotations

import os
from functools import cache

_NICE = 10


@cache
def be_modest() -> None:
    """Once a process: with little claim to the processor, and taking one core for all there is."""
    os.environ.setdefault("RUBSCREEN_WORKER", "1")
    if os.environ.get("RUBSCREEN_WORKER_NICE", "1") != "0" and hasattr(os, "nice"):
        os.nice(_NICE)

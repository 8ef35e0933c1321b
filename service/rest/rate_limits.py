"""How many requests a caller may send in a minute, and at the same time."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from sdm_core.errors import InvalidInput

REQUESTS_PER_MINUTE = 6000
CONCURRENT_REQUESTS = 32
# Callers remembered before those are forgotten whose bucket is full again.
_FORGET_FROM = 10_000


class TooManyRequests(InvalidInput):
    """The caller sends more than it may.

    Parameters
    ----------
    retry_after_s
        Whole seconds after which it is worth trying again.
    """

    def __init__(self, field: str, value: object, remedy: str, retry_after_s: int = 1) -> None:
        super().__init__(field, value, remedy)
        self.retry_after_s = retry_after_s

    @property
    def headers(self) -> dict[str, str]:
        """When to come back (RFC 9110 section 10.2.3)."""
        return {"Retry-After": str(self.retry_after_s)}


@dataclass(frozen=True)
class Allowance:
    """What one caller may use; None is as much as it likes."""

    requests_per_minute: int | None
    concurrent_requests: int | None


class RateLimits:
    """Counts the requests of each caller, on this replica.

    A token bucket for each caller holds N tokens, as many as the caller may send requests in a minute, and
    gains N a minute: who never sends more than N in any minute is never refused, and nobody gets more than
    N + NL answered within L minutes. The bucket is kept as the one time at which it will be full again (the
    virtual scheduling form of the generic cell rate algorithm, ITU-T I.371 annex A): a caller whose time has
    passed is as if it had never called, and is forgotten.

    To be used from one thread, that of the event loop.

    Parameters
    ----------
    clock
        Seconds since whenever, never going back.

    Examples
    --------
    >>> limits = RateLimits(clock=lambda: 0.0)
    >>> limits.take("me", 1)
    >>> try:
    ...     limits.take("me", 1)
    ... except TooManyRequests as error:
    ...     error.retry_after_s
    60
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._full_at: dict[str, float] = {}
        self._forget_from = _FORGET_FROM
        self._inside: Counter[str] = Counter()

    def take(self, who: str, per_minute: int | None) -> None:
        """Take a token; a refusal takes none.

        Raises
        ------
        TooManyRequests
            When the bucket is empty.
        """
        if per_minute is None:
            return
        now, each_s = self._clock(), 60.0 / per_minute
        full_at = max(self._full_at.get(who, now), now) + each_s
        wait_s = full_at - now - 60.0
        if wait_s > 1e-6:  # the rounding of sums of 60/N
            remedy = f"wait, or send at most {per_minute} in a minute: ask for more points in each"
            value = f"over {per_minute} in a minute"
            raise TooManyRequests("requests", value, remedy, math.ceil(wait_s))
        self._full_at[who] = full_at
        if len(self._full_at) >= self._forget_from:
            self._forget(now)

    def enter(self, who: str, allowance: Allowance) -> None:
        """Let a request in, which has to `leave` again.

        Raises
        ------
        TooManyRequests
            When the caller has as many inside as it may, or its bucket is empty.
        """
        most = allowance.concurrent_requests
        if most is not None and self._inside[who] >= most:
            remedy = f"send the next one when one of the {most} is answered"
            raise TooManyRequests("requests", f"over {most} at the same time", remedy)
        self.take(who, allowance.requests_per_minute)
        self._inside[who] += 1

    def leave(self, who: str) -> None:
        """Note that a request let in is answered."""
        self._inside[who] -= 1
        if not self._inside[who]:
            del self._inside[who]

    def _forget(self, now: float) -> None:
        self._full_at = {who: full_at for who, full_at in self._full_at.items() if full_at > now}
        # Twice what is left: each call pays for a bounded part of the next look.
        self._forget_from = max(_FORGET_FROM, 2 * len(self._full_at))

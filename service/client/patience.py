"""How long a client waits, and how often it asks again."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Any

import tenacity

from service.client.message import Message
from service.client.problem import ServiceProblem


@dataclass(frozen=True)
class Patience:
    """How often and how long a client asks again when a problem is a passing one.

    After attempt k, counted from 0, it waits a random time up to min(longest_s, first_s·2^k), so that many
    clients do not come back together (full jitter), on top of what the service asks for with Retry-After.

    Attributes
    ----------
    attempts
        Times a request is sent at most; 1 never repeats one.
    first_s, longest_s
        Bounds of the back-off, s.
    total_s
        Time for a whole call with its waits and, of a large question, all its parts, s.

    Examples
    --------
    >>> Patience(attempts=2).total_s
    1800.0
    """

    attempts: int = 5
    first_s: float = 0.5
    longest_s: float = 30.0
    total_s: float = 1800.0

    def options(self, message: Message, left_s: float, base_url: str) -> dict[str, Any]:
        """For `tenacity.Retrying` and `tenacity.AsyncRetrying` alike, with so much of the total time left.

        Raises
        ------
        ServiceProblem
            When none is.
        """
        if left_s <= 0.0:
            raise ServiceProblem.too_late(base_url, self.total_s)
        attempts = self.attempts if message.repeatable else 1
        return {
            "retry": tenacity.retry_if_exception(_may_pass),
            "wait": self._wait,
            # Not begun where the wait would end after the total time: what failed is then said at once.
            "stop": tenacity.stop_after_attempt(attempts) | tenacity.stop_before_delay(left_s),
            "reraise": True,
        }

    def _wait(self, state: tenacity.RetryCallState) -> float:
        error = state.outcome.exception() if state.outcome is not None else None
        asked = getattr(error, "retry_after_s", None) or 0.0
        most = min(self.longest_s, self.first_s * 2.0 ** (state.attempt_number - 1))
        return asked + random.uniform(0.0, most)


def _may_pass(error: BaseException) -> bool:
    return isinstance(error, ServiceProblem) and error.temporary

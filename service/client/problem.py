"""What a client raises: the problem document of the service, or why there was no answer."""

from __future__ import annotations

from typing import Any

import httpx

from sdm_core.errors import RubscreenError
from service.rest.errors import PROBLEM_JSON

Json = dict[str, Any]
# Too many requests; a proxy between without a service behind it; a service that is busy or about to stop.
TEMPORARY = frozenset({429, 502, 503, 504})
# No answer in time is not among them: the service may be at work on it still.
_PASSING = (
    httpx.ConnectError,
    httpx.ConnectTimeout,
    httpx.PoolTimeout,
    httpx.ReadError,
    httpx.WriteError,
    httpx.RemoteProtocolError,
)


class ServiceProblem(RubscreenError):
    """The service refused, or could not be reached.

    Attributes
    ----------
    problem
        The problem document: type, title, status, detail, field, value, remedy, request_id. Where
        no service answered, `status` is None.
    temporary
        Whether the same request may well succeed later.
    retry_after_s
        How long the service asks to wait, s; None where it does not say.
    """

    def __init__(self, problem: Json, temporary: bool = False, retry_after_s: float | None = None) -> None:
        self.problem, self.temporary, self.retry_after_s = problem, temporary, retry_after_s
        super().__init__(problem.get("detail") or problem.get("title") or "no detail")

    def __reduce__(self):
        return type(self), (self.problem, self.temporary, self.retry_after_s)

    @classmethod
    def of(cls, response: httpx.Response) -> ServiceProblem:
        """From an answer that is no success."""
        temporary = response.status_code in TEMPORARY
        return cls(_document(response), temporary, _retry_after_s(response) if temporary else None)

    @classmethod
    def foreign(cls, response: httpx.Response) -> ServiceProblem:
        """From an answer of a proxy in between, or of another service altogether."""
        return cls(_foreign(response))

    @classmethod
    def unreachable(cls, base_url: str, error: Exception) -> ServiceProblem:
        """From an exception of the HTTP client."""
        detail = f"{base_url}: {error or type(error).__name__}; check that the service runs there"
        document = {"status": None, "title": "No answer from the service", "detail": detail}
        return cls(document, isinstance(error, _PASSING))

    @classmethod
    def crowded(cls, base_url: str) -> ServiceProblem:
        """When this client listens to as many streams as it may."""
        detail = f"{base_url}: this client listens to enough jobs already"
        return cls({"status": None, "title": "No further stream", "detail": detail}, temporary=True)

    @classmethod
    def too_late(cls, base_url: str, total_s: float) -> ServiceProblem:
        """When the time for the whole call is up."""
        detail = f"{base_url}: not answered within {total_s:g} s; ask for less, or allow more"
        return cls({"status": None, "title": "No answer in time", "detail": detail})


def _document(response: httpx.Response) -> Json:
    if response.headers.get("content-type", "").startswith(PROBLEM_JSON):
        try:
            document = response.json()
        except ValueError:
            return _foreign(response)
        if isinstance(document, dict):
            return document
    return _foreign(response)


def _foreign(response: httpx.Response) -> Json:
    title = f"{response.status_code} {response.reason_phrase}"
    detail = f"{response.url}: {title}, but not from rubscreen; check the address"
    return {"status": response.status_code, "title": title, "detail": detail}


def _retry_after_s(response: httpx.Response) -> float | None:
    # Seconds, as the service writes it; a date, which some proxies write, is left to the back-off.
    said = response.headers.get("retry-after", "").strip()
    return float(said) if said.isascii() and said.isdigit() else None

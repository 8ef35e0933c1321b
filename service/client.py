"""A client of the service that answers like a `training.screening.Screener`."""

from __future__ import annotations

import os
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self, TypeVar

import httpx
import numpy as np
import orjson

from sdm_core.blade import Blade, blade_to_dict
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import DamagedFile, InvalidInput, RubscreenError
from service.rest import replies
from service.rest.errors import PROBLEM_JSON
from training.answers import BoundaryAnswers, MapAnswers, PointAnswers, SensitivityAnswers

Json = dict[str, Any]
T = TypeVar("T")


class ServiceProblem(RubscreenError):
    """The service refused, or could not be reached.

    Attributes
    ----------
    problem
        The problem document: type, title, status, detail, field, value, remedy, request_id. Where
        no service answered, `status` is None.
    """

    def __init__(self, problem: Json) -> None:
        self.problem = problem
        super().__init__(problem.get("detail") or problem.get("title") or "no detail")

    def __reduce__(self):
        return type(self), (self.problem,)


class Client:
    """Asks a running service; a context manager.

    Parameters
    ----------
    base_url
        Where it listens, e.g. ``http://127.0.0.1:8000``.
    timeout
        Seconds for one answer. Exact maps take long.
    key
        The API key, of a service that asks for one; RUBSCREEN_API_KEY when left out.
    http
        An HTTP client of one's own (certificates, proxies, tests) in place of `timeout`.

    Examples
    --------
    >>> with Client("http://127.0.0.1:8000") as client:
    ...     client.base_url
    'http://127.0.0.1:8000'
    """

    def __init__(
        self,
        base_url: str,
        timeout: float = 300.0,
        *,
        key: str | None = None,
        http: httpx.Client | None = None,
    ) -> None:
        self.base_url = base_url.rstrip("/")
        self._key = _sendable(os.environ.get("RUBSCREEN_API_KEY") if key is None else key)
        self._http = http or httpx.Client(timeout=timeout)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def points(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> PointAnswers:
        """Verdicts at points (``POST /v1/stability``).

        Raises
        ------
        ServiceProblem
            When the service refuses or cannot be reached.
        """
        speed, stiffness = np.asarray(speed_hz, dtype=float), np.asarray(ke, dtype=float)
        question = _question(blade, contact, policy, alpha, speed_hz=speed, ke=stiffness)
        return self._ask(
            "POST", "/v1/stability", question, lambda reply: replies.points_from_dict(reply, speed, stiffness)
        )

    stability = points

    def boundary(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke_max: float,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> BoundaryAnswers:
        """First crossings (``POST /v1/boundary``); raises like `points`."""
        speed = np.asarray(speed_hz, dtype=float)
        question = _question(blade, contact, policy, alpha, speed_hz=speed, ke_max=ke_max)
        return self._ask(
            "POST", "/v1/boundary", question, lambda reply: replies.boundary_from_dict(reply, speed, ke_max)
        )

    def sensitivities(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke_max: float,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> SensitivityAnswers:
        """What moves the first crossings (``POST /v1/sensitivities``); raises like `points`."""
        speed = np.asarray(speed_hz, dtype=float)
        question = _question(blade, contact, policy, alpha, speed_hz=speed, ke_max=ke_max)
        return self._ask(
            "POST",
            "/v1/sensitivities",
            question,
            lambda reply: replies.sensitivities_from_dict(reply, speed, ke_max),
        )

    def map(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> MapAnswers:
        """Verdicts on a grid (``POST /v1/map``, as npz); raises like `points`."""
        speed, stiffness = np.asarray(speed_hz, dtype=float), np.asarray(ke, dtype=float)
        question = _question(blade, contact, policy, alpha, speed_hz=speed, ke=stiffness)
        response = self._response("POST", "/v1/map", question, "application/x-npz")
        try:
            return replies.map_from_npz(response.content)
        except DamagedFile:
            raise ServiceProblem(_foreign(response)) from None

    def models(self) -> list[Json]:
        """The models of the service (``GET /v1/models``), the active one marked."""
        return self._ask("GET", "/v1/models", None, lambda reply: list(reply["models"]))

    def ready(self) -> bool:
        """Whether the service answers questions now (``GET /readyz``)."""
        try:
            self._response("GET", "/readyz")
        except ServiceProblem:
            return False
        return True

    def _ask(self, method: str, path: str, question: Json | None, read: Callable[[Json], T]) -> T:
        response = self._response(method, path, question)
        try:
            return read(orjson.loads(response.content))
        except (ValueError, KeyError, TypeError):
            raise ServiceProblem(_foreign(response)) from None

    def _response(
        self, method: str, path: str, question: Json | None = None, accept: str = "application/json"
    ) -> httpx.Response:
        body = None if question is None else replies.to_json(question)
        headers = {"Accept": accept, "Content-Type": "application/json"}
        if self._key:
            headers["Authorization"] = f"Bearer {self._key}"
        try:
            response = self._http.request(method, self.base_url + path, content=body, headers=headers)
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise ServiceProblem(_unreachable(self.base_url, error)) from None
        if response.is_success:
            return response
        raise ServiceProblem(_problem(response))


def _question(
    blade: Blade, contact: ContactConfiguration, policy: str, alpha: float | None, **asked: Any
) -> Json:
    said = {"policy": policy} if alpha is None else {"policy": policy, "alpha": alpha}
    return {"blade": blade_to_dict(blade), "contact": contact.to_dict(), **said, **asked}


def _sendable(key: str | None) -> str | None:
    """A key without the line break of the file it came from.

    Raises
    ------
    InvalidInput
        When no header can carry it; httpx would quote it in its own error.
    """
    key = None if key is None else key.strip()
    if key and not (key.isascii() and key.isprintable()):
        remedy = "give the key as `rubscreen keys create` printed it"
        raise InvalidInput("key", "characters that no key has", remedy)
    return key or None


def _problem(response: httpx.Response) -> Json:
    if response.headers.get("content-type", "").startswith(PROBLEM_JSON):
        return response.json()
    return _foreign(response)


def _foreign(response: httpx.Response) -> Json:
    """A proxy in between, or another service altogether."""
    title = f"{response.status_code} {response.reason_phrase}"
    detail = f"{response.url}: {title}, but not from rubscreen; check the address"
    return {"status": response.status_code, "title": title, "detail": detail}


def _unreachable(base_url: str, error: Exception) -> Json:
    detail = f"{base_url}: {error or type(error).__name__}; check that the service runs there"
    return {"status": None, "title": "No answer from the service", "detail": detail}

"""The client that waits for its answers."""

from __future__ import annotations

import time
from threading import BoundedSemaphore
from types import TracebackType
from typing import Any, Self, TypeVar

import httpx
import numpy as np
import tenacity
from httpx_sse import EventSource

from sdm_core.blade import Blade
from sdm_core.blade.profile import BladeProfile
from sdm_core.contact import ContactConfiguration
from service.client import conversations, model_conversations
from service.client.conversations import BladeAnswer, Progress, numbers
from service.client.message import (
    MOST_STREAMS,
    Address,
    Conversation,
    Listening,
    Message,
    Pause,
    Step,
    checked,
)
from service.client.patience import Patience
from service.client.problem import ServiceProblem
from service.client.questions import Boundary, Map, Points, Sensitivities
from service.client.sync_jobs import ClientOfJobs
from service.rest.model_schemas import ModelChange, ModelHistory
from service.rest.schemas import Model
from training.answers import BoundaryAnswers, MapAnswers, PointAnswers, SensitivityAnswers

T = TypeVar("T")


class Client(ClientOfJobs):
    """Asks a running service, and answers like a `training.screening.Screener`; a context manager.

    Large questions are sent as npz and in parts, and put together again. A request that could not be
    answered just now (429, 503, a connection lost) is sent again, as `patience` says.

    Parameters
    ----------
    base_url
        Where it listens, e.g. ``http://127.0.0.1:8000``.
    timeout
        Seconds for one answer. Exact maps take long.
    key
        API key; left out, that of the environment (``RUBSCREEN_API_KEY``).
    patience
        How long and how often it asks again.
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
        patience: Patience = Patience(),
        http: httpx.Client | None = None,
    ) -> None:
        self._address = Address.of(base_url, key)
        self._patience = patience
        self._streams = BoundedSemaphore(MOST_STREAMS)
        self._http = http or httpx.Client(timeout=timeout)

    @property
    def base_url(self) -> str:
        """Where the service listens."""
        return self._address.base_url

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
        *,
        progress: Progress | None = None,
    ) -> PointAnswers:
        """Verdicts at points (``POST /v1/stability``).

        Parameters
        ----------
        progress
            Told how many answers have come, of how many (`service.client.progress_bar` shows it).

        Raises
        ------
        ServiceProblem
            When the service refuses or cannot be reached.
        """
        asked = Points(blade, contact, numbers(speed_hz), policy, alpha, numbers(ke))
        return self.run(conversations.answers(asked, progress))

    stability = points

    def boundary(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke_max: float,
        policy: str = "auto",
        alpha: float | None = None,
        *,
        progress: Progress | None = None,
    ) -> BoundaryAnswers:
        """First crossings (``POST /v1/boundary``); as `points`."""
        asked = Boundary(blade, contact, numbers(speed_hz), policy, alpha, ke_max)
        return self.run(conversations.answers(asked, progress))

    def sensitivities(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke_max: float,
        policy: str = "auto",
        alpha: float | None = None,
        *,
        progress: Progress | None = None,
    ) -> SensitivityAnswers:
        """What moves the first crossings (``POST /v1/sensitivities``); as `points`."""
        asked = Sensitivities(blade, contact, numbers(speed_hz), policy, alpha, ke_max)
        return self.run(conversations.answers(asked, progress))

    def map(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray,
        policy: str = "auto",
        alpha: float | None = None,
        *,
        progress: Progress | None = None,
    ) -> MapAnswers:
        """Verdicts on a grid (``POST /v1/map``, as npz); as `points`."""
        asked = Map(blade, contact, numbers(speed_hz), policy, alpha, numbers(ke))
        return self.run(conversations.answers(asked, progress))

    def check_blade(self, blade: Blade) -> BladeAnswer:
        """A blade as the service understands it, and what is odd about it (``POST /v1/blades``)."""
        return self.run(conversations.checked_blade(blade))

    def build_blade(self, profile: BladeProfile, *, verify: bool = True) -> BladeAnswer:
        """A blade built from its shape (``POST /v1/blades``); `verify` also measures the reduction."""
        return self.run(conversations.built_blade(profile, verify))

    def models(self) -> list[dict[str, Any]]:
        """The models of the service (``GET /v1/models``), the one that answers first and marked."""
        return self.run(model_conversations.models())

    def model(self, model_id: str) -> Model:
        """One model with its whole card (``GET /v1/models/{id}``)."""
        return self.run(model_conversations.model(model_id))

    def model_history(self) -> ModelHistory:
        """Which model was active when (``GET /v1/models/history``)."""
        return self.run(model_conversations.history())

    def promote(self, model_id: str, *, force: bool = False) -> ModelChange:
        """Make a model the active one (``POST /v1/models/{id}/promote``), unless it is worse."""
        return self.run(model_conversations.promote(model_id, force))

    def rollback(self) -> ModelChange:
        """Make the model active again that was so before (``POST /v1/models/rollback``); never sent twice."""
        return self.run(model_conversations.rollback())

    def ready(self) -> bool:
        """Whether the service answers questions now (``GET /readyz``)."""
        return self.run(conversations.ready())

    def run(self, conversation: Conversation[T], *, within_s: float | None = None) -> T:
        """The outcome of a conversation with the service.

        Parameters
        ----------
        within_s
            Time for all of it; None is `total_s` of the patience.

        Raises
        ------
        ServiceProblem
            What it did not expect.
        """
        end = time.monotonic() + (self._patience.total_s if within_s is None else within_s)
        try:
            step = next(conversation)
            while True:
                try:
                    reply = self._taken(step, end)
                except ServiceProblem as problem:
                    step = conversation.throw(problem)
                else:
                    step = conversation.send(reply)
        except StopIteration as finished:
            return finished.value

    def _taken(self, step: Step, end: float) -> httpx.Response | None:
        if isinstance(step, Message):
            return self._answered(step, end)
        if isinstance(step, Pause):
            time.sleep(step.seconds)
        elif not self._streams.acquire(blocking=False):
            raise ServiceProblem.crowded(self.base_url)
        else:
            try:
                self._heard(step)
            finally:
                self._streams.release()
        return None

    def _heard(self, step: Listening) -> None:
        try:
            with self._http.stream(**self._address.listening(step)) as response:
                if not response.is_success:
                    response.read()
                checked(response)
                for event in EventSource(response).iter_sse():
                    if step.hear(event.data):
                        return
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise ServiceProblem.unreachable(self.base_url, error) from None

    def _answered(self, message: Message, end: float) -> httpx.Response:
        options = self._patience.options(message, end - time.monotonic(), self.base_url)
        return tenacity.Retrying(**options)(self._sent, message)

    def _sent(self, message: Message) -> httpx.Response:
        try:
            return checked(self._http.request(**self._address.request(message)))
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise ServiceProblem.unreachable(self.base_url, error) from None

"""The client whose answers are awaited."""

from __future__ import annotations

import asyncio
import time
from contextlib import aclosing
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
from service.client.async_jobs import AsyncClientOfJobs
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
from service.rest.model_schemas import ModelChange, ModelHistory
from service.rest.schemas import Model
from training.answers import BoundaryAnswers, MapAnswers, PointAnswers, SensitivityAnswers

T = TypeVar("T")


class AsyncClient(AsyncClientOfJobs):
    """As `Client`, parameter by parameter and method by method; an asynchronous context manager.

    Several questions may be awaited at the same time.

    Examples
    --------
    >>> import asyncio
    >>> async def there() -> bool:
    ...     async with AsyncClient("http://127.0.0.1:8000") as client:
    ...         return await client.ready()
    >>> answered = asyncio.run(there())
    """

    def __init__(
        self,
        base_url: str,
        timeout: float = 300.0,
        *,
        key: str | None = None,
        patience: Patience = Patience(),
        http: httpx.AsyncClient | None = None,
    ) -> None:
        self._address = Address.of(base_url, key)
        self._patience = patience
        self._streams = BoundedSemaphore(MOST_STREAMS)
        self._http = http or httpx.AsyncClient(timeout=timeout)

    @property
    def base_url(self) -> str:
        """Where the service listens."""
        return self._address.base_url

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def close(self) -> None:
        """Close the connections."""
        await self._http.aclose()

    async def points(
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
        """Verdicts at points; as `Client.points`."""
        asked = Points(blade, contact, numbers(speed_hz), policy, alpha, numbers(ke))
        return await self.run(conversations.answers(asked, progress))

    stability = points

    async def boundary(
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
        """First crossings; as `Client.boundary`."""
        asked = Boundary(blade, contact, numbers(speed_hz), policy, alpha, ke_max)
        return await self.run(conversations.answers(asked, progress))

    async def sensitivities(
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
        """What moves the first crossings; as `Client.sensitivities`."""
        asked = Sensitivities(blade, contact, numbers(speed_hz), policy, alpha, ke_max)
        return await self.run(conversations.answers(asked, progress))

    async def map(
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
        """Verdicts on a grid; as `Client.map`."""
        asked = Map(blade, contact, numbers(speed_hz), policy, alpha, numbers(ke))
        return await self.run(conversations.answers(asked, progress))

    async def check_blade(self, blade: Blade) -> BladeAnswer:
        """A blade as the service understands it; as `Client.check_blade`."""
        return await self.run(conversations.checked_blade(blade))

    async def build_blade(self, profile: BladeProfile, *, verify: bool = True) -> BladeAnswer:
        """A blade built from its shape; as `Client.build_blade`."""
        return await self.run(conversations.built_blade(profile, verify))

    async def models(self) -> list[dict[str, Any]]:
        """The models of the service; as `Client.models`."""
        return await self.run(model_conversations.models())

    async def model(self, model_id: str) -> Model:
        """One model; as `Client.model`."""
        return await self.run(model_conversations.model(model_id))

    async def model_history(self) -> ModelHistory:
        """Which model was active when; as `Client.model_history`."""
        return await self.run(model_conversations.history())

    async def promote(self, model_id: str, *, force: bool = False) -> ModelChange:
        """Make a model the active one; as `Client.promote`."""
        return await self.run(model_conversations.promote(model_id, force))

    async def rollback(self) -> ModelChange:
        """Make the model active again that was so before; as `Client.rollback`."""
        return await self.run(model_conversations.rollback())

    async def ready(self) -> bool:
        """Whether the service answers questions now; as `Client.ready`."""
        return await self.run(conversations.ready())

    async def run(self, conversation: Conversation[T], *, within_s: float | None = None) -> T:
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
                    reply = await self._taken(step, end)
                except ServiceProblem as problem:
                    step = conversation.throw(problem)
                else:
                    step = conversation.send(reply)
        except StopIteration as finished:
            return finished.value

    async def _taken(self, step: Step, end: float) -> httpx.Response | None:
        if isinstance(step, Message):
            return await self._answered(step, end)
        if isinstance(step, Pause):
            await asyncio.sleep(step.seconds)
        elif not self._streams.acquire(blocking=False):
            raise ServiceProblem.crowded(self.base_url)
        else:
            try:
                await self._heard(step)
            finally:
                self._streams.release()
        return None

    async def _heard(self, step: Listening) -> None:
        try:
            async with self._http.stream(**self._address.listening(step)) as response:
                if not response.is_success:
                    await response.aread()
                checked(response)
                async with aclosing(EventSource(response).aiter_sse()) as events:
                    async for event in events:
                        if step.hear(event.data):
                            return
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise ServiceProblem.unreachable(self.base_url, error) from None

    async def _answered(self, message: Message, end: float) -> httpx.Response:
        options = self._patience.options(message, end - time.monotonic(), self.base_url)
        return await tenacity.AsyncRetrying(**options)(self._sent, message)

    async def _sent(self, message: Message) -> httpx.Response:
        try:
            return checked(await self._http.request(**self._address.request(message, awaited=True)))
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise ServiceProblem.unreachable(self.base_url, error) from None

"""What `AsyncClient` does about simulations."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from sdm_core.blade import Blade
from service.client import job_conversations, simulation_conversations
from service.client.job_conversations import SIMULATIONS, Watch
from service.client.job_status import JobStatus
from service.client.message import Conversation
from service.client.simulation_conversations import SimulationResults

if TYPE_CHECKING:
    from sdm_core.time_domain.liner.abradable_liner import Friction
    from service.simulation.constants import CasingConstants, LinerConstants

T = TypeVar("T")


class AsyncClientOfSimulations(ABC):
    """As `ClientOfSimulations`, method by method, awaited."""

    @abstractmethod
    async def run(self, conversation: Conversation[T], *, within_s: float | None = None) -> T:
        """The outcome of a conversation."""

    @abstractmethod
    def _pages(self, path: str, state: str | Iterable[str] | None) -> AsyncIterator[JobStatus]:
        """Jobs of a list."""

    @abstractmethod
    async def _wait(
        self, path: str, job_id: str, progress: Watch | None, timeout_s: float | None
    ) -> JobStatus:
        """Wait for the end of a job."""

    async def submit_simulation(
        self,
        blade: Blade | Mapping[str, Any],
        speed_hz: Sequence[float] | np.ndarray | float,
        nodes: Sequence[str] | None = None,
        *,
        revolutions: int | None = None,
        liner: LinerConstants | Mapping[str, Any] | None = None,
        casing: CasingConstants | Mapping[str, Any] | None = None,
        friction: Friction | Mapping[str, Any] | None = None,
        cells: int | None = None,
        steps_per_cell: int | None = None,
        name: str | None = None,
        priority: int | None = None,
        idempotency_key: str | None = None,
    ) -> JobStatus:
        """Integrate a blade's rub of its liner in time, as a job; as `Client.submit_simulation`."""
        parts = {
            "nodes": None if nodes is None else list(nodes),
            "revolutions": revolutions,
            "liner": liner,
            "casing": casing,
            "friction": friction,
            "cells": cells,
            "steps_per_cell": steps_per_cell,
            "name": name,
            "priority": priority,
        }
        return await self.run(simulation_conversations.submitted(blade, speed_hz, parts, idempotency_key))

    async def simulation(self, job_id: str) -> JobStatus:
        """A simulation; as `Client.simulation`."""
        return await self.run(job_conversations.job(SIMULATIONS, job_id))

    def simulations(self, state: str | Iterable[str] | None = None) -> AsyncIterator[JobStatus]:
        """Simulations in the state or states named, or all, newest first; as `Client.simulations`."""
        return self._pages(SIMULATIONS, state)

    async def wait_simulation(
        self, job_id: str, progress: Watch | None = None, *, timeout_s: float | None = None
    ) -> JobStatus:
        """Wait until a simulation is done; as `Client.wait_simulation`."""
        return await self._wait(SIMULATIONS, job_id, progress, timeout_s)

    async def simulation_results(self, job_id: str) -> SimulationResults:
        """Figures and arrays; as `Client.simulation_results`."""
        return await self.run(simulation_conversations.results(job_id))

    async def simulation_chart(self, job_id: str, chart: str, node: str | None = None) -> bytes:
        """A PNG; as `Client.simulation_chart`."""
        return await self.run(simulation_conversations.chart(job_id, chart, node))

    async def cancel_simulation(self, job_id: str) -> JobStatus:
        """Let a simulation stop; as `Client.cancel_simulation`."""
        return await self.run(job_conversations.cancel(SIMULATIONS, job_id))

    async def retry_simulation(self, job_id: str) -> JobStatus:
        """Run a simulation that is over once more; as `Client.retry_simulation`."""
        return await self.run(job_conversations.retry(SIMULATIONS, job_id))

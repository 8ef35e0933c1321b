"""What `Client` does about simulations."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
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


class ClientOfSimulations(ABC):
    """Simulations over REST."""

    @abstractmethod
    def run(self, conversation: Conversation[T], *, within_s: float | None = None) -> T:
        """The outcome of a conversation."""

    @abstractmethod
    def _pages(self, path: str, state: str | Iterable[str] | None) -> Iterator[JobStatus]:
        """Jobs of a list."""

    @abstractmethod
    def _wait(self, path: str, job_id: str, progress: Watch | None, timeout_s: float | None) -> JobStatus:
        """Wait for the end of a job."""

    def submit_simulation(
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
        """Integrate a blade's rub of its liner in time, as a job (``POST /v1/simulations``).

        It is on the service's disk when this returns. What is left out is as the service takes it.

        Parameters
        ----------
        speed_hz
            One for its response, many rising ones for wear and spectrum maps, Hz.
        nodes
            Tip nodes that can touch; the leading edge where left out.
        liner, casing
            Their constants, e.g. ``{"ke": 1e4}`` and ``{"clearance_m": 2e-4, "ovalisation_m": 3e-4}``.
        friction
            Of the tip on the liner.
        idempotency_key
            As in `submit_screening`.

        Raises
        ------
        ServiceProblem
            When the service refuses, with the field, or cannot be reached.
        """
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
        return self.run(simulation_conversations.submitted(blade, speed_hz, parts, idempotency_key))

    def simulation(self, job_id: str) -> JobStatus:
        """A simulation: its state and how far it is."""
        return self.run(job_conversations.job(SIMULATIONS, job_id))

    def simulations(self, state: str | Iterable[str] | None = None) -> Iterator[JobStatus]:
        """Simulations in the state or states named, or all, newest first."""
        return self._pages(SIMULATIONS, state)

    def wait_simulation(
        self, job_id: str, progress: Watch | None = None, *, timeout_s: float | None = None
    ) -> JobStatus:
        """Wait until a simulation is done; as `wait`."""
        return self._wait(SIMULATIONS, job_id, progress, timeout_s)

    def simulation_results(self, job_id: str) -> SimulationResults:
        """Figures and arrays; of the speeds there are while the job runs."""
        return self.run(simulation_conversations.results(job_id))

    def simulation_chart(self, job_id: str, chart: str, node: str | None = None) -> bytes:
        """A PNG: ``wear_map`` (of a contact node) or ``spectrum`` of many speeds, ``response`` or
        ``worn_profile`` of one."""
        return self.run(simulation_conversations.chart(job_id, chart, node))

    def cancel_simulation(self, job_id: str) -> JobStatus:
        """Let a simulation stop; speeds that are there stay."""
        return self.run(job_conversations.cancel(SIMULATIONS, job_id))

    def retry_simulation(self, job_id: str) -> JobStatus:
        """Run a simulation that is over once more: speeds that are stored are not simulated again."""
        return self.run(job_conversations.retry(SIMULATIONS, job_id))

"""What `AsyncClient` does about jobs: batches of blades, trainings, simulations."""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import AsyncIterator, Iterable, Mapping, Sequence
from typing import TypeVar

from service.client import (
    job_conversations,
    screening_order,
    screening_results,
    training_conversations,
    uploading,
)
from service.client.async_simulations import AsyncClientOfSimulations
from service.client.job_conversations import SCREENINGS, TRAININGS, Watch
from service.client.job_status import JobStatus
from service.client.message import Conversation
from service.client.patience import Patience
from service.client.screening_order import Contacts
from service.client.screening_results import ScreeningResults
from service.client.uploading import BladeLike
from service.jobs.screening.request import Criteria
from service.rest.job_schemas import ScheduleReply, TrainedReply, UploadReply
from service.rest.training_question import TrainingQuestion
from service.screening.screen import KE_MAX

T = TypeVar("T")


class AsyncClientOfJobs(AsyncClientOfSimulations):
    """As `ClientOfJobs`, parameter by parameter and method by method, awaited."""

    _patience: Patience

    @abstractmethod
    async def run(self, conversation: Conversation[T], *, within_s: float | None = None) -> T:
        """The outcome of a conversation, within so much time; None is that of the client's patience."""

    async def upload(
        self, source: str | os.PathLike[str] | bytes | Iterable[BladeLike], name: str | None = None
    ) -> UploadReply:
        """Send a file of blades ahead; as `Client.upload`."""
        return await self.run(uploading.upload(source, name))

    async def delete_upload(self, upload_id: str) -> None:
        """Delete a file sent ahead; as `Client.delete_upload`."""
        await self.run(uploading.delete(upload_id))

    async def submit_screening(
        self,
        blades: Iterable[BladeLike] | BladeLike,
        contacts: Contacts | None = None,
        *,
        speed_range_hz: Sequence[float] | None = None,
        speed_range_ratio: Sequence[float] | None = None,
        ke_max: float = KE_MAX,
        ke_liner: float | None = None,
        criteria: Criteria | Mapping[str, float | None] | None = None,
        map_shape: Sequence[int] | None = None,
        policy: str = "auto",
        alpha: float | None = None,
        bad_blades: str = "refuse",
        name: str | None = None,
        priority: int = 5,
        idempotency_key: str | None = None,
    ) -> JobStatus:
        """Screen many blades under many contacts, as a job; as `Client.submit_screening`."""
        rest = screening_order.rest_of(
            contacts,
            speed_range_hz,
            speed_range_ratio,
            criteria,
            ke_max=ke_max,
            ke_liner=ke_liner,
            map_shape=map_shape,
            policy=policy,
            alpha=alpha,
            bad_blades=bad_blades,
            name=name,
            priority=priority,
        )
        return await self.run(screening_order.submitted(blades, rest, idempotency_key))

    async def screening(self, job_id: str) -> JobStatus:
        """A screening: its state and how far it is; as `Client.screening`."""
        return await self.run(job_conversations.job(SCREENINGS, job_id))

    def screenings(self, state: str | Iterable[str] | None = None) -> AsyncIterator[JobStatus]:
        """Screenings, newest first, to be taken with ``async for``; as `Client.screenings`."""
        return self._pages(SCREENINGS, state)

    async def wait(
        self, job_id: str, progress: Watch | None = None, *, timeout_s: float | None = None
    ) -> JobStatus:
        """Wait until a screening is done, beside others; as `Client.wait`."""
        return await self._wait(SCREENINGS, job_id, progress, timeout_s)

    async def screening_results(
        self,
        job_id: str,
        *,
        contact: str | None = None,
        verdict: str | None = None,
        meets_criteria: bool | None = None,
    ) -> ScreeningResults:
        """The ranking, safest first; as `Client.screening_results`."""
        return await self.run(screening_results.results(job_id, contact, verdict, meets_criteria))

    async def screening_report(self, job_id: str, *, sheets: int | None = None) -> bytes:
        """One HTML page to read and print; as `Client.screening_report`."""
        return await self.run(screening_results.report(job_id, sheets))

    async def screening_map(self, job_id: str, index: int, contact: str) -> bytes:
        """The stability map of one blade under one contact, PNG; as `Client.screening_map`."""
        return await self.run(screening_results.map_picture(job_id, index, contact))

    async def screening_boundaries(self, job_id: str, index: int) -> bytes:
        """The first crossings of one blade under every contact, PNG; as `Client.screening_boundaries`."""
        return await self.run(screening_results.boundaries_picture(job_id, index))

    async def cancel(self, job_id: str) -> JobStatus:
        """Let a screening stop; as `Client.cancel`."""
        return await self.run(job_conversations.cancel(SCREENINGS, job_id))

    async def retry(self, job_id: str) -> JobStatus:
        """Run a screening that is over once more; as `Client.retry`."""
        return await self.run(job_conversations.retry(SCREENINGS, job_id))

    async def submit_training(
        self, training: TrainingQuestion | None = None, *, idempotency_key: str | None = None
    ) -> JobStatus:
        """Train a model, as a job; as `Client.submit_training`."""
        return await self.run(training_conversations.submitted(training, idempotency_key))

    async def training(self, job_id: str) -> JobStatus:
        """A training: its state and how far it is; as `Client.training`."""
        return await self.run(job_conversations.job(TRAININGS, job_id))

    def trainings(self, state: str | Iterable[str] | None = None) -> AsyncIterator[JobStatus]:
        """Trainings; as `Client.trainings`."""
        return self._pages(TRAININGS, state)

    async def wait_training(
        self, job_id: str, progress: Watch | None = None, *, timeout_s: float | None = None
    ) -> JobStatus:
        """Wait until a training is done; as `Client.wait_training`."""
        return await self._wait(TRAININGS, job_id, progress, timeout_s)

    async def training_result(self, job_id: str) -> TrainedReply:
        """What came of a training; as `Client.training_result`."""
        return await self.run(training_conversations.result(job_id))

    async def cancel_training(self, job_id: str) -> JobStatus:
        """Let a training stop; as `Client.cancel_training`."""
        return await self.run(job_conversations.cancel(TRAININGS, job_id))

    async def retry_training(self, job_id: str) -> JobStatus:
        """Run a training that is over once more; as `Client.retry_training`."""
        return await self.run(job_conversations.retry(TRAININGS, job_id))

    async def schedule_trainings(
        self, cron: str, timezone: str = "UTC", training: TrainingQuestion | None = None
    ) -> ScheduleReply:
        """Train by the calendar; as `Client.schedule_trainings`."""
        return await self.run(training_conversations.put_schedule(cron, timezone, training))

    async def training_schedule(self) -> ScheduleReply:
        """When trainings are; as `Client.training_schedule`."""
        return await self.run(training_conversations.schedule())

    async def unschedule_trainings(self) -> ScheduleReply:
        """Train by the calendar no longer; as `Client.unschedule_trainings`."""
        return await self.run(training_conversations.drop_schedule())

    async def _pages(self, path: str, state: str | Iterable[str] | None) -> AsyncIterator[JobStatus]:
        coming: str | None = job_conversations.first_page(path, state)
        while coming is not None:
            page = await self.run(job_conversations.page(coming))
            for job in page.jobs:
                yield job
            coming = page.next

    async def _wait(
        self, path: str, job_id: str, progress: Watch | None, timeout_s: float | None
    ) -> JobStatus:
        patience_s = self._patience.total_s
        told = job_conversations.until_over(path, job_id, progress, timeout_s, patience_s)
        return await self.run(told, within_s=float("inf"))

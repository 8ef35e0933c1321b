"""What `Client` does about jobs: batches of blades, trainings, simulations."""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TypeVar

from service.client import (
    job_conversations,
    screening_order,
    screening_results,
    training_conversations,
    uploading,
)
from service.client.job_conversations import SCREENINGS, TRAININGS, Watch
from service.client.job_status import JobStatus
from service.client.message import Conversation
from service.client.patience import Patience
from service.client.screening_order import Contacts
from service.client.screening_results import ScreeningResults
from service.client.sync_simulations import ClientOfSimulations
from service.client.uploading import BladeLike
from service.jobs.screening.request import Criteria
from service.rest.job_schemas import ScheduleReply, TrainedReply, UploadReply
from service.rest.training_question import TrainingQuestion
from service.screening.screen import KE_MAX

T = TypeVar("T")


class ClientOfJobs(ClientOfSimulations):
    """Jobs over REST."""

    _patience: Patience

    @abstractmethod
    def run(self, conversation: Conversation[T], *, within_s: float | None = None) -> T:
        """The outcome of a conversation, within so much time; None is that of the client's patience."""

    def upload(
        self, source: str | os.PathLike[str] | bytes | Iterable[BladeLike], name: str | None = None
    ) -> UploadReply:
        """Send a file of blades ahead (``POST /v1/uploads``).

        Parameters
        ----------
        source
            A file, read while it is sent: ``.json`` (a blade or a list), ``.ndjson`` or ``.jsonl`` (one a
            line), ``.zip`` (of ``*.json``); the content of one, with its `name`; or blades and profiles.
        name
            What it is called in results.

        Raises
        ------
        InvalidInput
            For a file that cannot be read or has none of these forms.
        ServiceProblem
        """
        return self.run(uploading.upload(source, name))

    def delete_upload(self, upload_id: str) -> None:
        """Delete a file sent ahead; screenings made of it keep what they need."""
        self.run(uploading.delete(upload_id))

    def submit_screening(
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
        """Screen many blades under many contacts, as a job (``POST /v1/screenings``).

        It is on the service's disk when this returns. Many blades are sent ahead as uploads, in parts.

        Parameters
        ----------
        blades
            Blades, profiles, documents of either, uploads or their ids, names of shipped examples; mixed.
            They may be made while they are taken.
        contacts
            By name, or a list; None is leading edge, trailing edge and both of each blade.
        speed_range_hz, speed_range_ratio
            Rotor speeds, in Hz or over each blade's first frequency at rest; neither is each blade's own.
        ke_max, ke_liner
            Largest K_e looked at, and the liner's, N/m.
        criteria
            What each blade has to meet.
        map_shape
            Speeds and stiffnesses of each map; None is 100 x 100.
        policy, alpha
            Who answers the maps, and the false-stable rate that holds.
        bad_blades
            ``refuse`` the whole order for a blade that cannot be screened, or ``skip`` and report it.
        name
            In lists and reports.
        priority
            1 is first, 9 last.
        idempotency_key
            The same order under the same key is the same job, also from another process. None makes a key,
            kept when a request has to be sent again.

        Raises
        ------
        ServiceProblem
            When the service refuses, with the place in `blades`, or cannot be reached.
        """
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
        return self.run(screening_order.submitted(blades, rest, idempotency_key))

    def screening(self, job_id: str) -> JobStatus:
        """A screening: its state and how far it is."""
        return self.run(job_conversations.job(SCREENINGS, job_id))

    def screenings(self, state: str | Iterable[str] | None = None) -> Iterator[JobStatus]:
        """Screenings in the state or states named, or all, newest first; fetched as they are taken."""
        return self._pages(SCREENINGS, state)

    def wait(
        self, job_id: str, progress: Watch | None = None, *, timeout_s: float | None = None
    ) -> JobStatus:
        """Wait until a screening is done.

        The service tells of every change. Where the connection breaks, or the service is started again, the
        client comes back; where no events come through, it asks every few seconds.

        Parameters
        ----------
        progress
            Told the job at every change (`service.client.job_bar` shows it).
        timeout_s
            None waits as long as it takes.

        Raises
        ------
        JobNotDone
            When it failed, with the reason, or was cancelled.
        StillUnderWay
            When it is not over after `timeout_s`.
        ServiceProblem
            When there is no such job, or the service is away for longer than the client's patience.
        """
        return self._wait(SCREENINGS, job_id, progress, timeout_s)

    def screening_results(
        self,
        job_id: str,
        *,
        contact: str | None = None,
        verdict: str | None = None,
        meets_criteria: bool | None = None,
    ) -> ScreeningResults:
        """The ranking, safest first, whole; of what is there while the job runs.

        Parameters
        ----------
        contact, verdict, meets_criteria
            Only rows of this contact, verdict or outcome.
        """
        return self.run(screening_results.results(job_id, contact, verdict, meets_criteria))

    def screening_report(self, job_id: str, *, sheets: int | None = None) -> bytes:
        """One HTML page to read and print, with sheets for the riskiest blades (50)."""
        return self.run(screening_results.report(job_id, sheets))

    def screening_map(self, job_id: str, index: int, contact: str) -> bytes:
        """The stability map of one blade (`blade_index` of a row) under one contact, PNG."""
        return self.run(screening_results.map_picture(job_id, index, contact))

    def screening_boundaries(self, job_id: str, index: int) -> bytes:
        """The first crossings of one blade under every contact, PNG."""
        return self.run(screening_results.boundaries_picture(job_id, index))

    def cancel(self, job_id: str) -> JobStatus:
        """Let a screening stop; its results stay, and one that is over stays as it is."""
        return self.run(job_conversations.cancel(SCREENINGS, job_id))

    def retry(self, job_id: str) -> JobStatus:
        """Run a screening that is over once more: what is stored and whole is not computed again."""
        return self.run(job_conversations.retry(SCREENINGS, job_id))

    def submit_training(
        self, training: TrainingQuestion | None = None, *, idempotency_key: str | None = None
    ) -> JobStatus:
        """Train a model, as a job (``POST /v1/trainings``); left out, as large as the shipped one's."""
        return self.run(training_conversations.submitted(training, idempotency_key))

    def training(self, job_id: str) -> JobStatus:
        """A training: its state and how far it is."""
        return self.run(job_conversations.job(TRAININGS, job_id))

    def trainings(self, state: str | Iterable[str] | None = None) -> Iterator[JobStatus]:
        """Trainings; as `screenings`."""
        return self._pages(TRAININGS, state)

    def wait_training(
        self, job_id: str, progress: Watch | None = None, *, timeout_s: float | None = None
    ) -> JobStatus:
        """Wait until a training is done; as `wait`."""
        return self._wait(TRAININGS, job_id, progress, timeout_s)

    def training_result(self, job_id: str) -> TrainedReply:
        """The model that came of a training, whether it was promoted, and its figures."""
        return self.run(training_conversations.result(job_id))

    def cancel_training(self, job_id: str) -> JobStatus:
        """Let a training stop; its labels stay."""
        return self.run(job_conversations.cancel(TRAININGS, job_id))

    def retry_training(self, job_id: str) -> JobStatus:
        """Run a training that is over once more, from the labels that are there."""
        return self.run(job_conversations.retry(TRAININGS, job_id))

    def schedule_trainings(
        self, cron: str, timezone: str = "UTC", training: TrainingQuestion | None = None
    ) -> ScheduleReply:
        """Train by the calendar: five fields, e.g. ``0 3 * * SUN``, in an IANA time zone."""
        return self.run(training_conversations.put_schedule(cron, timezone, training))

    def training_schedule(self) -> ScheduleReply:
        """When trainings are; all None where there is no schedule."""
        return self.run(training_conversations.schedule())

    def unschedule_trainings(self) -> ScheduleReply:
        """Train by the calendar no longer."""
        return self.run(training_conversations.drop_schedule())

    def _pages(self, path: str, state: str | Iterable[str] | None) -> Iterator[JobStatus]:
        coming: str | None = job_conversations.first_page(path, state)
        while coming is not None:
            page = self.run(job_conversations.page(coming))
            yield from page.jobs
            coming = page.next

    def _wait(self, path: str, job_id: str, progress: Watch | None, timeout_s: float | None) -> JobStatus:
        patience_s = self._patience.total_s
        told = job_conversations.until_over(path, job_id, progress, timeout_s, patience_s)
        return self.run(told, within_s=float("inf"))

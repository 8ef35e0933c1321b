"""What the running service holds: its settings, its model and what is wrong with it, its workers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from threading import Event
from typing import Any

from sdm_core.errors import InvalidInput
from service.answerer import Answerer
from service.audit.auditor import Auditor
from service.jobs.screening.watched import watching
from service.operation.counted_answers import CountedAnswerer
from service.operation.metrics import Metrics
from service.records.database import Database, open_database
from service.rest.active_model import ActiveModel, Answering, WatchedModel
from service.rest.errors import NotReady
from service.rest.gate import Access
from service.rest.job_desk import JobDesk
from service.rest.limits import WorkQueue
from service.rest.models_folder import models_folder, prepare_models
from service.rest.self_check import self_check
from service.screening.screen import ScreeningResult
from service.settings import Settings
from training.observers import OnExact
from training.registry import ModelEntry, list_models, load_model
from training.served_answers import ServedAnswers


@dataclass(frozen=True)
class Desk:
    """The state of the service from start to stop.

    Attributes
    ----------
    model
        What answers, and what is wrong with the model that should.
    work
        Where answers are computed.
    kept
        Where exact answers go for retraining; None where they are not kept.
    database
        Keys, jobs and audits; None without a data folder.
    access
        Who may come in, and how often.
    jobs
        Batches and trainings; None without a data folder.
    closing
        Set when the service stops: what has no end of its own ends then.
    metrics
        Where answers are counted.
    auditor
        What holds confident answers to the exact core; None where that is off, or `screener` was given.
    """

    settings: Settings
    model: ActiveModel
    work: WorkQueue
    kept: ServedAnswers | None
    database: Database | None
    access: Access
    jobs: JobDesk | None
    closing: Event
    metrics: Metrics
    auditor: Auditor | None

    @classmethod
    def opened(
        cls,
        settings: Settings,
        screener: Answerer | None = None,
        metrics: Metrics | None = None,
        closing: Event | None = None,
    ) -> Desk:
        """The desk with `screener`, or with the active model of the settings' folder, and what replaces it.

        Raises
        ------
        InvalidInput
            When the folder for exact answers or for data cannot be made, the database cannot be used, or keys
            are asked for without it.
        """
        folder = settings.data_folder
        database = None if folder is None else open_database(folder, settings.database_url)
        access = Access.opened(settings, database)
        prepare_models(settings)
        kept, auditor, draw, model = (
            None,
            None,
            None,
            ActiveModel(Answering(screener)) if screener is not None else None,
        )
        if model is None:
            if settings.served_answers_folder is not None:
                kept = ServedAnswers(settings.served_answers_folder)
            keep = None if kept is None else kept.keep
            auditor = _auditor(settings, database, keep)
            draw = None if auditor is None else auditor.draw
            model = WatchedModel(models_folder(settings), settings.models_poll_s, keep, draw)
        work = WorkQueue(settings.worker_threads, settings.max_waiting, settings.deadline_s)
        closing, metrics = closing or Event(), metrics or Metrics()
        jobs = None
        if database is not None and folder is not None:
            on_stored = watching(_counting(metrics), (lambda answers: None) if draw is None else draw)
            jobs = JobDesk.opened(settings, database, folder, models_folder(settings), on_stored)
        return cls(settings, model, work, kept, database, access, jobs, closing, metrics, auditor)

    def close(self) -> None:
        """Stop what still runs, and write what is to be kept."""
        self.closing.set()
        self.work.close()
        if self.jobs is not None:
            self.jobs.close()
        self.model.close()
        if self.auditor is not None:  # before those it writes to
            self.auditor.close()
        if self.kept is not None:
            self.kept.close()
        self.access.close()
        if self.database is not None:
            self.database.close()

    def models(self) -> list[ModelEntry]:
        """The models of the registry, the one that answers marked and first."""
        # Not the registry's own mark, which may have moved since this service started.
        answering = self.answering
        entries = [
            replace(entry, active=entry.id == answering)
            for entry in list_models(models_folder(self.settings))
        ]
        return sorted(entries, key=lambda entry: (not entry.active, entry.id))

    @property
    def answering(self) -> str | None:
        """Identifier of the model that answers."""
        return self.model.now.model_id

    @property
    def fault(self) -> str | None:
        """Why the model that the folder names does not answer; None where it does."""
        return None if self.model.fault is None else str(self.model.fault)

    def answerer(self, policy: str) -> Answerer:
        """What answers under `policy`.

        Raises
        ------
        NotReady
            When the surrogate is needed and there is none. Under `auto` too: the exact core alone
            is right but a thousand times slower, which a client should choose, not run into.
        """
        return CountedAnswerer(self.answering_now(policy).screener, self.metrics)

    def answering_now(self, policy: str) -> Answering:
        """The same with what stands beside it, not counted; raises as `answerer`."""
        now = self.model.now
        if now.fault is not None and policy != "exact":
            remedy = f'{now.fault.remedy}; until then policy "exact" answers'
            raise NotReady(now.fault.field, now.fault.value, remedy)
        return now

    def model_for_jobs(self, policy: str) -> str | None:
        """The surrogate that a job accepted now is screened with; raises as `answerer`."""
        return None if policy == "exact" else self.answering_now(policy).model_id

    def check_alpha(self, policy: str, alpha: float | None) -> None:
        """Refuse a rate that the model has no certificate for, before many blades are asked about.

        Raises
        ------
        InvalidInput
        """
        if alpha is not None:
            self_check(self.answering_now(policy).screener, policy, alpha)

    def card(self, model_id: str | None) -> dict[str, Any] | None:
        """The card of a model; None where there is no such model any more."""
        if model_id is None:
            return None
        try:
            return load_model(model_id, models_folder(self.settings)).card
        except InvalidInput:
            return None


def _counting(metrics: Metrics) -> Callable[[ScreeningResult], None]:
    def count(result: ScreeningResult) -> None:
        metrics.count_answers("screening", result.contact, result.map.source, result.map.reason)

    return count


def _auditor(settings: Settings, database: Database | None, keep: OnExact | None) -> Auditor | None:
    if not settings.audit_share_of_time or not settings.audit_points_per_request:
        return None
    return Auditor(settings.audit_share_of_time, settings.audit_points_per_request, database, keep)

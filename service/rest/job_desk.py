"""The jobs of the running service: opened with it, closed with it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sdm_core.errors import InvalidInput
from service.jobs.engine import DaskEngine, Engine, Tls, checked_scheduler
from service.jobs.job import SCREENING, SIMULATION, TRAINING
from service.jobs.job_folder import SCRATCH
from service.jobs.jobs import Jobs, JobSettings, Kind, alone
from service.jobs.retention import Keep
from service.jobs.screening.checks import limits_of
from service.jobs.screening.kind import ScreeningKind
from service.jobs.screening.rankings import Rankings
from service.jobs.screening.watched import OnStored
from service.jobs.simulation.kind import SimulationKind
from service.jobs.training.kind import TrainingKind
from service.jobs.uploads import Uploads
from service.records.database import Database, open_database
from service.rest.accepting import train_when_due
from service.settings import Settings


@dataclass(frozen=True)
class JobDesk:
    """Jobs, the files sent ahead of them, and their rankings."""

    jobs: Jobs
    uploads: Uploads
    engine: Engine
    rankings: Rankings

    @classmethod
    def opened(
        cls,
        settings: Settings,
        database: Database,
        data_folder: Path,
        models_folder: Path,
        on_stored: OnStored,
    ) -> JobDesk:
        """The jobs of the data folder; `on_stored` is told of every chunk of a screening.

        Raises
        ------
        InvalidInput
            For a scheduler's address that is none, files that are not there, or a data folder in use.
        """
        tls = _tls(settings)
        address = checked_scheduler(settings.scheduler, tls)
        engine = DaskEngine(address, settings.engine_workers, data_folder / SCRATCH, tls)
        kinds: dict[str, Kind] = {
            SCREENING: ScreeningKind(
                engine, limits_of(settings), settings.min_free_bytes, models_folder, on_stored
            ),
            TRAINING: TrainingKind(models_folder, settings.served_answers_folder, settings.min_free_bytes),
            SIMULATION: SimulationKind(engine, settings.min_free_bytes),
        }
        many = settings.jobs_at_once
        at_once = {SCREENING: many, TRAINING: 1, SIMULATION: many} if settings.run_jobs else {}
        keep = Keep(settings.keep_jobs_days, settings.keep_uploads_days)
        how = JobSettings(at_once, settings.job_lease_s, settings.min_free_bytes, keep)
        jobs = Jobs(database, data_folder, kinds, how, train_when_due)
        uploads = Uploads(
            jobs.folders.uploads,
            settings.max_upload_bytes,
            settings.min_free_bytes,
            settings.max_uploads_bytes,
        )
        return cls(jobs, uploads, engine, Rankings())

    def close(self) -> None:
        """Stop: what runs is handed back."""
        self.jobs.close()
        self.engine.close()


def _tls(settings: Settings) -> Tls | None:
    files = {
        "scheduler_tls_ca": settings.scheduler_tls_ca,
        "scheduler_tls_cert": settings.scheduler_tls_cert,
        "scheduler_tls_key": settings.scheduler_tls_key,
    }
    if not any(files.values()):
        return None
    for name, path in files.items():
        if path is None or not path.is_file():
            raise InvalidInput(name, str(path or "left out"), "give the file: all three go together")
    ca, cert, key = files.values()
    assert ca is not None and cert is not None and key is not None
    return Tls(ca, cert, key)


def preflight(settings: Settings) -> None:
    """Refuse what the service could not start with, before it listens.

    Raises
    ------
    InvalidInput
        Naming the setting, its value and the remedy.
    """
    checked_scheduler(settings.scheduler, _tls(settings))
    if settings.models_folder is not None and not settings.models_folder.is_dir():
        found = str(settings.models_folder)
        raise InvalidInput(
            "models_folder", found, "give a folder of models, or leave it out for the shipped one"
        )
    if settings.data_folder is None:
        return
    database = open_database(settings.data_folder, settings.database_url)
    try:
        if not database.shared:
            alone(settings.data_folder).release()
    finally:
        database.close()

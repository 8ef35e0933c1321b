"""Every setting of the service, read once."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le
from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

Count = Annotated[int, Gt(0)]
Seconds = Annotated[float, Gt(0)]
Ratio = Annotated[float, Gt(0)]


def cores() -> int:
    """Of this machine."""
    return os.cpu_count() or 1


class Settings(BaseSettings):
    """Settings of the service; each is also an environment variable, e.g. ``RUBSCREEN_MAX_POINTS``.

    Attributes
    ----------
    models_folder
        Where the models are; None is the one that came with the package.
    models_poll_s
        How often the service looks whether another model has become active, s; 0 is never.
    served_answers_folder
        Where exact answers are kept for retraining; None keeps none.
    data_folder
        Where jobs, uploads and the database are; None runs no jobs and keeps no keys. The command line puts
        ``~/.local/share/rubscreen`` in the place of None.
    database_url
        ``postgresql://USER:PASSWORD@HOST/DATABASE``, which several replicas may share; None is SQLite in the
        data folder.
    auth
        ``on`` asks for keys, ``off`` lets everybody in. ``auto`` lets in whoever is on this machine while the
        service listens on the loopback alone, and asks for keys otherwise.
    requests_per_minute
        Requests of one key in a minute, on each replica; without keys, of one address. None is 6000, and as
        many as it likes for this machine itself while no keys are asked for.
    max_concurrent_requests
        Requests of one key, or address, answered at the same time on each replica. None is 32, likewise.
    max_active_jobs
        Jobs of one key that wait or run.
    max_queued_jobs
        Jobs of all keys that wait or run.
    run_jobs
        Whether this process runs jobs; without, it takes them for others that share the database.
    jobs_at_once
        Screenings, and as many simulations, this process runs at the same time; they share its workers by
        priority.
    job_lease_s
        Time after which the jobs of a replica that says nothing any more are taken over, s.
    engine_workers
        Processes that compute the chunks of jobs, where there is no `scheduler`.
    scheduler
        A dask scheduler that computes them instead, ``tcp://HOST:PORT`` or ``tls://HOST:PORT``.
    scheduler_tls_ca, scheduler_tls_cert, scheduler_tls_key
        Files (PEM) by which the scheduler and this service know each other.
    min_free_bytes
        Room left free on the data folder's disk: jobs wait, and new ones are refused, before it is used up.
    max_upload_bytes
        Size of one file of blades.
    max_uploads_bytes
        Size of all files of blades of one key together; 0 is as many as the disk holds, as without keys.
    max_job_blades
        Blades of one screening.
    max_job_contacts
        Contacts of one screening.
    max_job_results
        Blades times contacts of one screening.
    max_simulation_speeds, max_simulation_revolutions
        Of one simulation.
    max_simulation_steps
        Steps of one simulation in all: speeds × revolutions × cells × steps a cell; 1e9 take some minutes.
    max_simulation_values
        Numbers kept of one speed while it is simulated: 8 bytes each.
    keep_jobs_days, keep_uploads_days
        Jobs that are over, and uploads, are deleted after so many days; 0 keeps them for good.
    max_body_bytes
        Largest request body; longer ones are refused while they arrive.
    body_timeout_s
        Time a client has to send a whole body, and each part of an upload, s.
    max_points
        Points of one stability request, and speeds times stiffnesses of one map.
    max_boundary_speeds
        Speeds of one boundary request.
    max_modes, max_tip_nodes, max_states
        Largest blade that is taken.
    max_mesh_nodes
        Nodes of the mesh of a profile to be built.
    max_arcs
        Arcs of engagement of a contact.
    max_vibrations_per_revolution
        Highest natural frequency over rotor speed: the exact core's work grows with it.
    max_frequency_span
        Highest natural frequency over the lowest.
    max_contact_ratio
        Stiffness of the contact over the blade's own, K_e·max_j G_jj/ω_j²; rubbing blades stay below 1.
    max_name_length
        Characters in the name of a blade or of a tip node.
    worker_threads
        Requests computed at the same time; the others wait.
    max_waiting
        Requests that may wait; one more is told to come back (503).
    deadline_s
        Time the computation of one answer may take, s.
    shutdown_s
        Time the requests being answered have to finish when the service is asked to stop, s.
    drain_s
        How long the service goes on answering after SIGTERM while it says that it is not ready, s; 0 stops
        at once. Longer than a balancer takes to notice.
    audit_share_of_time
        Share of one core for re-solving confident answers exactly in the background; 0 audits nothing.
    audit_points_per_request
        Confident answers drawn for that from each request at most; 0 audits nothing.
    otel_endpoint
        OTLP collector (HTTP) that spans are sent to; None sends none.
    log_level
        Least level of lines from the loggers under ``rubscreen``, access log included.
    log_format
        ``json`` lines or ``text``; ``auto`` is text on a terminal.

    Examples
    --------
    >>> Settings(max_points=10_000).max_points
    10000
    """

    model_config = SettingsConfigDict(env_prefix="RUBSCREEN_", frozen=True, extra="forbid")

    models_folder: Path | None = None
    models_poll_s: Annotated[float, Ge(0)] = 1.0
    served_answers_folder: Path | None = None
    data_folder: Path | None = None
    database_url: str | None = None
    auth: Literal["auto", "on", "off"] = "auto"
    requests_per_minute: Count | None = None
    max_concurrent_requests: Count | None = None
    max_active_jobs: Count = 20
    max_queued_jobs: Count = 1000
    run_jobs: bool = True
    jobs_at_once: Count = 4
    job_lease_s: Seconds = 30.0
    engine_workers: Count = Field(default_factory=cores)
    scheduler: str | None = None
    scheduler_tls_ca: Path | None = None
    scheduler_tls_cert: Path | None = None
    scheduler_tls_key: Path | None = None
    min_free_bytes: Annotated[int, Ge(0)] = 256 * 2**20
    max_upload_bytes: Count = 512 * 2**20
    max_uploads_bytes: Annotated[int, Ge(0)] = 4 * 2**30
    max_job_blades: Count = 20_000
    max_job_contacts: Count = 20
    max_job_results: Count = 100_000
    max_simulation_speeds: Count = 1000
    max_simulation_revolutions: Count = 1000
    max_simulation_steps: Count = 20_000_000_000
    max_simulation_values: Count = 20_000_000
    keep_jobs_days: Annotated[float, Ge(0)] = 90.0
    keep_uploads_days: Annotated[float, Ge(0)] = 7.0
    max_body_bytes: Count = 16 * 2**20
    body_timeout_s: Seconds = 60.0
    max_points: Count = 250_000
    max_boundary_speeds: Count = 10_000
    max_modes: Count = 64
    max_tip_nodes: Count = 256
    max_states: Count = 64
    max_mesh_nodes: Count = 12_000
    max_arcs: Count = 64
    max_vibrations_per_revolution: Ratio = 1000.0
    max_frequency_span: Ratio = 1e4
    max_contact_ratio: Ratio = 10.0
    max_name_length: Count = 200
    worker_threads: Count = Field(default_factory=cores)
    max_waiting: Count = 64
    deadline_s: Seconds = 300.0
    shutdown_s: Count = 30
    drain_s: Annotated[float, Ge(0)] = 5.0
    audit_share_of_time: Annotated[float, Ge(0), Le(1)] = 0.02
    audit_points_per_request: Annotated[int, Ge(0)] = 8
    otel_endpoint: str | None = None
    log_level: Literal["DEBUG", "INFO", "WARNING", "ERROR"] = "INFO"
    log_format: Literal["auto", "json", "text"] = "auto"


def default_data_folder() -> Path:
    """Where the command line keeps data unless it is told: ``rubscreen`` below ``XDG_DATA_HOME``.

    As the XDG base directory specification says, a relative XDG_DATA_HOME does not count.
    """
    told = Path(os.environ.get("XDG_DATA_HOME", ""))
    return (told if told.is_absolute() else Path.home() / ".local" / "share") / "rubscreen"

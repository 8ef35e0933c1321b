"""Clients of the service: `Client`, and `AsyncClient` with the same methods to be awaited."""

from service.client.async_client import AsyncClient
from service.client.job_status import JobNotDone, JobStatus, StillUnderWay
from service.client.patience import Patience
from service.client.problem import ServiceProblem
from service.client.progress import job_bar, progress_bar
from service.client.screening_results import NotScreened, ScreeningResults, ScreeningRow
from service.client.simulation_conversations import SimulationResults
from service.client.sync_client import Client
from service.rest.training_question import TrainingQuestion

__all__ = [
    "AsyncClient",
    "Client",
    "JobNotDone",
    "JobStatus",
    "NotScreened",
    "Patience",
    "ScreeningResults",
    "ScreeningRow",
    "ServiceProblem",
    "SimulationResults",
    "StillUnderWay",
    "TrainingQuestion",
    "job_bar",
    "progress_bar",
]

"""Clients of the service: `Client`, and `AsyncClient` with the same methods to be awaited."""

from service.client.async_client import AsyncClient
from service.client.patience import Patience
from service.client.problem import ServiceProblem
from service.client.progress import progress_bar
from service.client.sync_client import Client

__all__ = ["AsyncClient", "Client", "Patience", "ServiceProblem", "progress_bar"]

"""Where chunks are computed: worker processes behind the standard Executor, by dask.distributed."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from sdm_core.errors import Cancelled, InvalidInput, RubscreenError

Work = Callable[[bytes], bytes]
logger = logging.getLogger("rubscreen.jobs")

_CONNECT_S = 15.0
# Of a worker that is killed or runs out of memory, how often its chunk is tried before it is blamed.
_MOST_DEATHS = 3


class EngineGone(RubscreenError):
    """The workers cannot be reached; what was asked of them has to be asked again."""


class WorkerKilled(RubscreenError):
    """Every worker that took the work ended without an answer."""


class Engine(Protocol):
    """Computes bytes from bytes, somewhere else."""

    def slots(self) -> int:
        """How much is computed at once; 0 where there is no worker now.

        Raises
        ------
        EngineGone
        """
        ...

    def submit(self, work: Work, payload: bytes, priority: int) -> Future[bytes]:
        """Begin `work`, lower `priority` first.

        Raises
        ------
        EngineGone
        """
        ...

    def result(self, future: Future[bytes]) -> bytes:
        """The outcome of what is done.

        Raises
        ------
        EngineGone, WorkerKilled
            And whatever the work raised.
        """
        ...

    def close(self) -> None:
        """Let the workers go."""
        ...


@dataclass(frozen=True)
class Tls:
    """Files by which scheduler, workers and clients know each other (PEM)."""

    ca_file: Path
    cert_file: Path
    key_file: Path


class DaskEngine:
    """Workers of a local cluster of one's own, or of a scheduler that runs elsewhere: the same path to both.

    Workers start with the first work. What goes to and fro between one's own processes is pickled by dask, so
    nobody else may reach its scheduler: the local cluster makes certificates that its own processes alone
    know; for another give `tls`.

    Parameters
    ----------
    scheduler
        Address of a scheduler, ``tcp://HOST:PORT`` or ``tls://HOST:PORT``; None starts a local cluster.
    workers
        Processes of the local cluster.
    scratch
        Where local workers keep what they have to.
    """

    def __init__(self, scheduler: str | None, workers: int, scratch: Path, tls: Tls | None = None) -> None:
        self._address, self._workers, self._scratch, self._tls = scheduler, workers, scratch, tls
        self._lock = threading.Lock()
        self._client: Any = None
        self._executor: Any = None
        self._cluster: Any = None
        self._closed = False

    @property
    def where(self) -> str:
        """In words."""
        return self._address or f"{self._workers} workers on this machine"

    def slots(self) -> int:
        """How much is computed at once."""
        client = self._connected()
        try:
            return sum(client.nthreads().values())
        except Exception as error:
            raise self._gone(error) from None

    def submit(self, work: Work, payload: bytes, priority: int) -> Future[bytes]:
        """Begin `work`; raises `EngineGone`."""
        self._connected()
        try:
            # dask's own priorities are the other way round. Not pure: two jobs may ask for the same.
            return self._executor.submit(work, payload, priority=-priority, pure=False)
        except Exception as error:
            raise self._gone(error) from None

    def result(self, future: Future[bytes]) -> bytes:
        """The outcome of what is done."""
        from distributed import KilledWorker
        from distributed.comm import CommClosedError

        try:
            return future.result(timeout=0)
        except KilledWorker as error:
            raise WorkerKilled(str(error)) from None
        except (CancelledError, CommClosedError, Cancelled) as error:
            # Stopped on the worker's side, and not by who asks here: it has to be asked again.
            raise self._gone(error) from None

    def close(self) -> None:
        """Let the workers go; what runs is dropped."""
        with self._lock:
            self._closed = True
            self._drop()

    def _connected(self) -> Any:
        with self._lock:
            if self._closed:
                raise EngineGone("the engine is closed")
            if self._client is not None and self._client.status != "running":
                self._drop()
            if self._client is None:
                try:
                    self._connect()
                except (OSError, TimeoutError, RuntimeError, ValueError) as error:
                    self._drop()
                    raise EngineGone(f"{self.where}: {error or type(error).__name__}") from None
            return self._client

    def _connect(self) -> None:
        import dask
        from distributed import Client, LocalCluster
        from distributed.security import Security

        settings = {
            "distributed.scheduler.allowed-failures": _MOST_DEATHS,
            "distributed.comm.timeouts.connect": f"{_CONNECT_S}s",
            # Samples of what workers do, kept as they run: nobody looks at them, and workers grew meanwhile.
            "distributed.worker.profile.enabled": False,
            # The last thousand messages to each worker, kept whole: with chunks in them, hundreds of MiB.
            "distributed.admin.low-level-log-length": 0,
        }
        security = None
        if self._tls is not None:
            files = {"tls_ca_file": self._tls.ca_file}
            for role in ("client", "scheduler", "worker"):
                files |= {f"tls_{role}_cert": self._tls.cert_file, f"tls_{role}_key": self._tls.key_file}
            security = Security(require_encryption=True, **{name: str(path) for name, path in files.items()})
        # For good: workers that take the place of dead ones are to have them too.
        dask.config.set(settings)
        if self._address is None:
            self._scratch.mkdir(parents=True, exist_ok=True)
            # Other users of this machine reach the loopback too: they have none of these certificates.
            security = Security.temporary()
            self._cluster = LocalCluster(
                n_workers=self._workers,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                local_directory=str(self._scratch),
                silence_logs=logging.CRITICAL,
                security=security,
            )
        where = self._cluster if self._address is None else self._address
        self._client = Client(where, security=security, timeout=_CONNECT_S, set_as_default=False)
        self._executor = self._client.get_executor()
        logger.info("chunks are computed by %s", self.where)

    def _drop(self) -> None:
        for held in (self._client, self._cluster):
            if held is not None:
                try:
                    held.close(timeout=5)
                except Exception as error:  # it is gone already
                    logger.debug("closing the engine: %s", error)
        self._client = self._executor = self._cluster = None

    def _gone(self, error: Exception) -> EngineGone:
        return EngineGone(f"{self.where}: {error or type(error).__name__}")


def checked_scheduler(address: str | None, tls: Tls | None) -> str | None:
    """The address, where it is one.

    Raises
    ------
    InvalidInput
        Naming the setting and the remedy.
    """
    if address is None:
        return None
    scheme, _, rest = address.partition("://")
    if scheme not in ("tcp", "tls") or ":" not in rest:
        raise InvalidInput("scheduler", address, "give tcp://HOST:PORT or tls://HOST:PORT")
    if scheme == "tls" and tls is None:
        raise InvalidInput("scheduler", address, "give scheduler_tls_ca, _cert and _key too")
    return address

"""What is counted while requests are answered, for Prometheus; a registry of its own for each application."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from prometheus_client import (
    CONTENT_TYPE_LATEST,
    CollectorRegistry,
    Counter,
    Gauge,
    GCCollector,
    Histogram,
    PlatformCollector,
    ProcessCollector,
    generate_latest,
)
from prometheus_client.registry import Collector

from sdm_core.contact import ContactConfiguration
from training.contact_class import contact_class

# From a probe (half a millisecond) over one point (1 ms) and a map (0.3 s) to `deadline_s`.
BUCKETS_S = (
    *(0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5),
    *(1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 120.0, 300.0),
)
CONTENT_TYPE = CONTENT_TYPE_LATEST
# What a client invents must not become a label: every new value of one is kept for ever.
_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
_OTHER = "other"


class Metrics:
    """Requests and answers of one application.

    Examples
    --------
    >>> metrics = Metrics()
    >>> metrics.answered("GET", "/healthz", 200, 0.0007)
    >>> b'route="/healthz",status="200"} 1.0' in metrics.exposition()
    True
    """

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        for collector in (ProcessCollector, PlatformCollector, GCCollector):
            collector(registry=self._registry)
        self._seconds = Histogram(
            "rubscreen_request_duration_seconds",
            "Time from a request's first byte to its answer's last.",
            ("method", "route", "status"),
            buckets=BUCKETS_S,
            registry=self._registry,
        )
        self._in_flight = Gauge(
            "rubscreen_requests_in_flight", "Requests being answered.", registry=self._registry
        )
        self._answers = Counter(
            "rubscreen_answers",
            "Points, speeds and cells of maps answered, by who answered them and why.",
            ("question", "contact", "source", "reason"),
            registry=self._registry,
        )

    def observe(self, collector: Collector) -> None:
        """Ask `collector` too, at every scrape."""
        self._registry.register(collector)

    def forget(self, collector: Collector) -> None:
        """Ask it no more."""
        self._registry.unregister(collector)

    def began(self) -> None:
        """A request has come in."""
        self._in_flight.inc()

    def ended(self) -> None:
        """It has been dealt with, however."""
        self._in_flight.dec()

    def answered(self, method: str, route: str | None, status: int | None, seconds: float) -> None:
        """A request has been answered.

        Parameters
        ----------
        route
            Template of the path; None where no route took it.
        status
            None where the client had gone.
        """
        known = method if method in _METHODS else _OTHER
        self._seconds.labels(known, route or _OTHER, str(status or "none")).observe(seconds)

    def count_answers(
        self, question: str, contact: ContactConfiguration, source: np.ndarray, reason: np.ndarray
    ) -> None:
        """Answers given to one question, by source and reason; arrays of one shape."""
        kind = contact_class(contact)
        for (who, why), count in _pairs(source, reason).items():
            self._answers.labels(question, kind, who, why).inc(count)

    def exposition(self) -> bytes:
        """Everything, as Prometheus reads it."""
        return generate_latest(self._registry)


def _pairs(source: np.ndarray, reason: np.ndarray) -> Mapping[tuple[str, str], int]:
    """How often each pair occurs: compared with the few there are, since sorting strings is slow."""
    left, found = np.ones(source.size, dtype=bool), {}
    sources, reasons = source.ravel(), reason.ravel()
    while left.any():
        first: Any = int(np.argmax(left))
        pair = str(sources[first]), str(reasons[first])
        same = left & (sources == sources[first]) & (reasons == reasons[first])
        found[pair] = int(same.sum())
        left &= ~same
    return found

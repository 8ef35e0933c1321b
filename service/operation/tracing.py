"""Spans of every request to an OpenTelemetry collector; off unless an endpoint is set."""

from __future__ import annotations

from collections.abc import MutableMapping
from typing import Any
from urllib.parse import urlsplit

from sdm_core.errors import InvalidInput
from sdm_core.version import __version__

SERVICE_NAME = "rubscreen"
REQUEST_ID = "rubscreen.request_id"
_PATIENCE_S = 2.0
# Probes and scrapes come by the thousand and tell a trace nothing.
_UNTRACED = frozenset({"/healthz", "/readyz", "/metrics"})


class Tracing:
    """Where spans go.

    FastAPI makes the spans itself (`http.route`, status, errors, and inside them dependencies, endpoint and
    serialization); this adds the request's id, so that a trace leads to its log lines.

    Parameters
    ----------
    endpoint
        Of an OTLP collector over HTTP, e.g. ``http://127.0.0.1:4318``; its path ``/v1/traces`` is added where
        there is none.

    Raises
    ------
    InvalidInput
        When it is no such address, or the packages are not installed.
    """

    def __init__(self, endpoint: str) -> None:
        url = urlsplit(endpoint)
        if url.scheme not in ("http", "https") or not url.hostname:
            raise InvalidInput("otel_endpoint", endpoint, "give an address such as http://127.0.0.1:4318")
        try:
            from opentelemetry import trace
            from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
            from opentelemetry.sdk.resources import Resource
            from opentelemetry.sdk.trace import TracerProvider
            from opentelemetry.sdk.trace.export import BatchSpanProcessor
        except ImportError as error:
            remedy = f"install the extra, pip install 'rubscreen[otel]' ({error.name} is missing)"
            raise InvalidInput("otel_endpoint", endpoint, remedy) from None
        whole = endpoint if url.path.strip("/") else f"{endpoint.rstrip('/')}/v1/traces"
        resource = Resource.create({"service.name": SERVICE_NAME, "service.version": __version__})
        # Not the global provider: two applications in a process may go to two collectors.
        self._provider = TracerProvider(resource=resource, shutdown_on_exit=False)
        # A collector that is away must not keep the service from stopping.
        exporter = OTLPSpanExporter(endpoint=whole, timeout=_PATIENCE_S)
        self._provider.add_span_processor(BatchSpanProcessor(exporter))
        self._trace = trace

    def for_fastapi(self) -> dict[str, Any]:
        """The `telemetry` of a FastAPI application: spans only, since Prometheus has the metrics."""
        return {
            "tracer_provider": self._provider,
            "metrics": False,
            "logs": False,
            "auto_configure": False,
            "exclude": _untraced,
        }

    def mark(self, request_id: str) -> dict[str, str]:
        """Put the request's id into its span; what its log lines should carry in return."""
        span = self._trace.get_current_span()
        context = span.get_span_context()
        if not context.is_valid:
            return {}
        span.set_attribute(REQUEST_ID, request_id)
        return {"trace_id": f"{context.trace_id:032x}", "span_id": f"{context.span_id:016x}"}

    def close(self) -> None:
        """Send what is left, and stop."""
        self._provider.shutdown()


def _untraced(scope: MutableMapping[str, Any]) -> bool:
    return scope.get("path") in _UNTRACED

"""Traces, for those who collect them: each request a span with its route, and the id its log lines carry."""

from __future__ import annotations

import gzip
import io
import json
import logging
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer

import httpx
import pytest

from sdm_core.errors import InvalidInput
from service.app import create_app
from service.operation import logs
from service.operation.tracing import Tracing
from service.settings import Settings


class Collector(HTTPServer):
    """An OTLP collector of the loopback that keeps the spans it is sent."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Post)
        self.requests: list[tuple[str, bytes]] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"

    def spans(self) -> list[tuple[str, dict]]:
        """(name, attributes) of every span."""
        proto = pytest.importorskip("opentelemetry.proto.collector.trace.v1.trace_service_pb2")
        found = []
        for _, body in self.requests:
            message = proto.ExportTraceServiceRequest.FromString(body)
            for resource in message.resource_spans:
                about = {a.key: a.value.string_value for a in resource.resource.attributes}
                for scope in resource.scope_spans:
                    for span in scope.spans:
                        said = {a.key: a.value.string_value or a.value.int_value for a in span.attributes}
                        found.append((span.name, about | said | {"trace_id": span.trace_id.hex()}))
        return found


class _Post(BaseHTTPRequestHandler):
    server: Collector

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["content-length"]))
        if self.headers.get("content-encoding") == "gzip":
            body = gzip.decompress(body)
        self.server.requests.append((self.path, body))
        self.send_response(200)
        self.end_headers()

    def log_message(self, *line: object) -> None:
        """Nothing."""


@pytest.fixture
def collector() -> Iterator[Collector]:
    pytest.importorskip("opentelemetry.exporter.otlp.proto.http")
    with Collector() as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def test_a_request_is_a_span_with_its_route_and_its_id(serving, screener, question, collector):
    app = create_app(Settings(otel_endpoint=collector.url), screener=screener)
    with serving(app) as url, httpx.Client(base_url=url, timeout=20.0) as http:
        sent = {"X-Request-Id": "night-7"}
        assert http.post("/v1/stability", json=question(), headers=sent).status_code == 200
        assert http.get("/v1/nothing").status_code == 404
        for path in ("/healthz", "/readyz", "/metrics"):
            http.get(path)
    assert {path for path, _ in collector.requests} == {"/v1/traces"}
    spans = collector.spans()
    (of_request,) = [about for name, about in spans if name == "POST /v1/stability"]
    assert of_request["service.name"] == "rubscreen"
    assert of_request["http.route"] == "/v1/stability" and of_request["rubscreen.request_id"] == "night-7"
    assert of_request["http.response.status_code"] == 200
    (unmatched,) = [about for _, about in spans if about.get("url.path") == "/v1/nothing"]
    assert "http.route" not in unmatched and unmatched["http.response.status_code"] == 404
    assert not [about for _, about in spans if about.get("url.path") in ("/healthz", "/readyz", "/metrics")]


def test_log_lines_lead_to_the_trace(serving, screener, question, collector):
    stream, log = io.StringIO(), logging.getLogger("rubscreen")
    handler = logs._handler("json", stream)
    log.addHandler(handler)
    try:
        app = create_app(Settings(otel_endpoint=collector.url), screener=screener)
        with serving(app) as url, httpx.Client(base_url=url, timeout=20.0) as http:
            http.post("/v1/stability", json=question())
    finally:
        log.removeHandler(handler)
    (line,) = [json.loads(line) for line in stream.getvalue().splitlines() if "/v1/stability" in line]
    assert line["trace_id"] in {about["trace_id"] for _, about in collector.spans()}


def test_a_collector_that_is_away_costs_no_answer(serving, screener, question):
    pytest.importorskip("opentelemetry.exporter.otlp.proto.http")
    with Collector() as gone:
        endpoint = gone.url
    app = create_app(Settings(otel_endpoint=endpoint), screener=screener)
    with serving(app) as url:
        assert httpx.post(f"{url}/v1/stability", json=question(), timeout=20.0).status_code == 200


def test_without_the_packages_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "opentelemetry.exporter.otlp.proto.http.trace_exporter", None)
    with pytest.raises(InvalidInput) as refused:
        create_app(Settings(otel_endpoint="http://127.0.0.1:4318"))
    assert refused.value.field == "otel_endpoint" and "rubscreen[otel]" in refused.value.remedy


@pytest.mark.parametrize("endpoint", ["127.0.0.1:4318", "ftp://collector", "http://", ""])
def test_an_address_that_is_none_is_refused(endpoint):
    with pytest.raises(InvalidInput, match="otel_endpoint"):
        Tracing(endpoint)

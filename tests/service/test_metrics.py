"""What Prometheus reads is what happened, and no client can make it grow."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest
from nearby_models import nearby
from prometheus_client.parser import text_string_to_metric_families

from service.app import create_app
from service.operation.desk_metrics import DeskMetrics
from service.operation.metrics import Metrics
from service.rest.active_model import ActiveModel, Answering, WatchedModel
from service.rest.limits import WorkQueue
from service.settings import Settings

Samples = dict[tuple[str, frozenset], float]


def read(text: str) -> Samples:
    return {
        (sample.name, frozenset(sample.labels.items())): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def value(samples: Samples, name: str, **labels: str) -> float:
    """The sum over all series of a name that have these labels."""
    wanted = set(labels.items())
    return sum(v for (n, found), v in samples.items() if n == name and wanted <= found)


def scraped(http: httpx.Client) -> Samples:
    answer = http.get("/metrics")
    assert answer.status_code == 200 and answer.headers["content-type"].startswith("text/plain")
    return read(answer.text)


def test_requests_are_timed_by_the_template_of_their_route(own_http, question):
    for _ in range(3):
        own_http.post("/v1/stability", json=question())
    own_http.post("/v1/stability", json={})
    found = scraped(own_http)
    count = "rubscreen_request_duration_seconds_count"
    route = {"method": "POST", "route": "/v1/stability"}
    assert value(found, count, **route, status="200") == 3
    assert value(found, count, **route, status="422") == 1
    seconds = value(found, "rubscreen_request_duration_seconds_sum", **route)
    assert 0 < seconds < 20
    assert value(found, "rubscreen_request_duration_seconds_bucket", **route, le="300.0") == 4


def test_a_scrape_counts_itself_as_the_one_request_in_flight(own_http):
    assert value(scraped(own_http), "rubscreen_requests_in_flight") == 1


def test_paths_and_methods_that_clients_invent_make_no_series_of_their_own(own_http):
    own_http.get("/v1/none")
    own_http.request("BREW", "/v1/none")
    scraped(own_http)  # a scrape has its own series too, from the second one on
    before = len(scraped(own_http))
    for i in range(20):
        assert own_http.get(f"/v1/none/{i}").status_code == 404
        own_http.request(f"BREW{i}", "/v1/none")
    found = scraped(own_http)
    assert len(found) == before
    count = "rubscreen_request_duration_seconds_count"
    assert value(found, count, method="GET", route="other", status="404") == 21
    assert value(found, count, method="other", route="other") == 21


def test_answers_are_counted_point_by_point_by_who_gave_them_and_why(own_http, question):
    asked = question(speed_hz=[200.0] * 5, ke=[1e3, 2e3, 3e3, 2e6, 3e6])
    assert own_http.post("/v1/stability", json=asked).status_code == 200
    grid = question("/v1/map", policy="exact")
    assert own_http.post("/v1/map", json=grid).status_code == 200
    found, name = scraped(own_http), "rubscreen_answers_total"
    assert value(found, name, question="stability", source="surrogate", reason="confident") == 3
    assert value(found, name, question="stability", source="exact", reason="out_of_domain") == 2
    cells = len(grid["speed_hz"]) * len(grid["ke"])
    assert value(found, name, question="map", source="exact", reason="requested") == cells
    assert value(found, name) == 5 + cells


def test_contact_classes_are_told_apart(own_http, question):
    contact = {"weights": {"LE": 1.0}}
    for more in ({}, {"arcs": [[0.0, 0.25]]}):
        asked = question(contact=contact | more)
        assert own_http.post("/v1/stability", json=asked).status_code == 200
    found = scraped(own_http)
    for kind in ("permanent", "arcs"):
        assert value(found, "rubscreen_answers_total", contact=kind) == len(asked["ke"])


def test_probes_are_no_answers(own_http):
    for _ in range(3):
        assert own_http.get("/readyz").status_code == 200
    assert value(scraped(own_http), "rubscreen_answers_total") == 0


def test_who_is_computed_and_who_waits_shows_while_it_lasts(screener, serving, question):
    settings = Settings(worker_threads=1, max_waiting=5)
    with (
        serving(create_app(settings, screener=screener)) as url,
        httpx.Client(base_url=url, timeout=30.0) as http,
        ThreadPoolExecutor(3) as pool,
    ):
        screener.pause.clear()
        working = [pool.submit(http.post, "/v1/map", json=question("/v1/map")) for _ in range(3)]
        try:
            assert screener.entered.wait(10.0)
            while value(found := scraped(http), "rubscreen_work_waiting") < 2:
                pass
        finally:
            screener.pause.set()
        assert value(found, "rubscreen_work_running") == value(found, "rubscreen_work_threads") == 1
        assert value(found, "rubscreen_requests_in_flight") == 4
        assert [done.result().status_code for done in working] == [200] * 3
        found = scraped(http)
        assert value(found, "rubscreen_work_running") == value(found, "rubscreen_work_waiting") == 0


def test_the_model_that_answers_has_its_name_there_and_changes_are_counted(tmp_path):
    first, second = nearby(tmp_path).id, nearby(tmp_path, 1.001).id
    model, metrics = WatchedModel(tmp_path, poll_s=0.0), Metrics()
    metrics.observe(DeskMetrics(model, WorkQueue(1, 1, 1.0), None, None, lambda: False))

    def found() -> Samples:
        return read(metrics.exposition().decode())

    assert value(found(), "rubscreen_model_info", model=first) == 1
    for pointed, switches, refusals in ((second, 1, 0), ("gone", 1, 1), (first, 2, 1)):
        (tmp_path / "active").write_text(pointed + "\n")
        model.follow()
        now = found()
        assert value(now, "rubscreen_model_switches_total") == switches
        assert value(now, "rubscreen_model_refusals_total") == refusals
        assert value(now, "rubscreen_model_fault") == (pointed == "gone")
    assert value(now, "rubscreen_model_info", model=first) == 1
    assert value(now, "rubscreen_model_info") == 1


class Jobs:
    def counts(self) -> dict[tuple[str, str], int]:
        return {("screening", "running"): 2, ("training", "failed"): 1}


def test_jobs_are_counted_when_they_are_asked_for(screener):
    metrics, model = Metrics(), ActiveModel(Answering(screener))
    metrics.observe(DeskMetrics(model, WorkQueue(1, 1, 1.0), None, None, lambda: False, Jobs()))
    found = read(metrics.exposition().decode())
    assert value(found, "rubscreen_jobs", kind="screening", state="running") == 2
    assert value(found, "rubscreen_jobs", kind="training", state="failed") == 1


def test_two_applications_of_a_process_count_apart(serving, screener, question):
    with (
        serving(create_app(screener=screener)) as one,
        serving(create_app(screener=screener)) as other,
        httpx.Client(timeout=20.0) as http,
    ):
        http.post(f"{one}/v1/stability", json=question())
        counts = [
            value(read(http.get(f"{url}/metrics").text), "rubscreen_answers_total") for url in (one, other)
        ]
    assert counts == [len(question()["ke"]), 0]


@pytest.mark.parametrize("name", ["process_resident_memory_bytes", "process_cpu_seconds_total"])
def test_the_process_itself_is_measured(own_http, name):
    assert value(scraped(own_http), name) > 0

"""A batch over REST with the real engine: handed in, followed, paged, drawn; refused where it has to be."""

from __future__ import annotations

import copy
import io
import json
import zipfile
from collections.abc import Iterator
from pathlib import Path

import httpx
import pyarrow.parquet as pq
import pytest

from benchmarks.jobs.following import until_over
from benchmarks.jobs.service_process import ServiceProcess
from sdm_core.blade import blade_to_dict, example_blade
from sdm_core.contact import ContactConfiguration
from service.screening.screen import screen
from training.screening import Screener

CONTACTS = [{"name": "LE", "weights": {"LE": 1.0}}, {"name": "TE", "weights": {"TE": 1.0}}]
QUESTION = {
    "name": "two and a half",
    "blades": [{"example": "nasa_rotor_37"}, {"example": "generic_compressor_blade"}, {"schema": "none"}],
    "contacts": CONTACTS,
    "ke_liner": 9000.0,
    "criteria": {"least_margin": 0.0},
    "map_shape": [8, 8],
    "bad_blades": "skip",
}


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="module")
def service(data) -> Iterator[ServiceProcess]:
    with ServiceProcess(data, engine_workers=1, min_free_bytes=0, max_job_blades=50, drain_s=0) as running:
        yield running


@pytest.fixture(scope="module")
def http(service) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=service.url, timeout=60.0) as client:
        yield client


@pytest.fixture(scope="module")
def done(http, service) -> dict:
    """The job of `QUESTION`, at its end."""
    reply = http.post("/v1/screenings", json=QUESTION, headers={"Idempotency-Key": "two"})
    assert reply.status_code == 202, reply.text
    job = reply.json()
    assert reply.headers["location"] == job["links"]["self"] == f"/v1/screenings/{job['id']}"
    return until_over(service.url, job["id"], 180.0)


def changed(**fields) -> dict:
    return copy.deepcopy(QUESTION) | fields


def test_a_batch_ends_with_what_a_screening_of_each_blade_finds(http, done):
    assert (done["state"], done["not_screened"], done["error"]) == ("done", 1, None)
    assert (done["progress"]["done"], done["progress"]["total"]) == (3, 3)
    page = http.get(f"/v1/screenings/{done['id']}/results").json()
    assert page["complete"] and page["total"] == 4 and page["next"] is None
    contacts = {entry["name"]: ContactConfiguration(entry["weights"]) for entry in CONTACTS}
    blades = [example_blade("nasa_rotor_37"), example_blade("generic_compressor_blade")]
    expected = screen(blades, contacts, Screener.default(), map_shape=(8, 8), ke_liner=9000.0)
    found = [(r["rank"], r["blade"], r["contact_name"], r["smallest_unstable_ke"]) for r in page["results"]]
    assert found == [
        (i, r.blade.name, r.contact_name, None if r.worst is None else r.worst.ke)
        for i, r in enumerate(expected.results, 1)
    ]
    for row, result in zip(page["results"], expected.results, strict=True):
        assert row["verdict"] == result.verdict
        assert row["unstable_share"] == result.unstable_share
        assert row["meets_criteria"] == (result.verdict == "stable")
    (unscreened,) = page["not_screened"]
    assert (unscreened["index"], unscreened["source"]) == (2, "blades[2]")
    assert "schema = none" in unscreened["reason"]


def test_the_same_idempotency_key_runs_once(http, done):
    same = http.post("/v1/screenings", json=QUESTION, headers={"Idempotency-Key": "two"})
    assert (same.status_code, same.json()["id"]) == (202, done["id"])
    other = http.post("/v1/screenings", json=changed(name="x"), headers={"Idempotency-Key": "two"})
    assert other.status_code == 409 and other.json()["field"] == "Idempotency-Key"
    assert len(http.get("/v1/screenings").json()["jobs"]) == 1


def test_results_come_by_pages_filters_and_forms(http, done):
    base = f"/v1/screenings/{done['id']}/results"
    whole = http.get(base).json()["results"]
    pages, where = [], f"{base}?limit=3"
    while where is not None:
        page = http.get(where).json()
        pages += page["results"]
        where = page["next"]
    assert pages == whole
    unstable = http.get(base, params={"verdict": "unstable at some speed"}).json()
    assert [row for row in whole if row["verdict"] != "stable"] == unstable["results"]
    missed = http.get(base, params={"meets_criteria": "false"}).json()
    assert missed["results"] == unstable["results"]
    edges = http.get(base, params={"contact": "TE"}).json()
    assert {row["contact_name"] for row in edges["results"]} == {"TE"}
    lines = http.get(base, headers={"Accept": "text/csv"}).text.splitlines()
    assert len(lines) == 5 and lines[0].startswith('"rank","blade_index"')
    content = http.get(base, headers={"Accept": "application/vnd.apache.parquet"}).content
    table = pq.read_table(io.BytesIO(content))
    assert table["smallest_unstable_ke"].to_pylist() == [row["smallest_unstable_ke"] for row in whole]
    assert b"blades[2]" in table.schema.metadata[b"rubscreen.not_screened"]


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ({"limit": "0"}, "limit"),
        ({"limit": "1001"}, "limit"),
        ({"offset": "-1"}, "offset"),
        ({"offset": "²"}, "offset"),
        ({"limit": "0000000019999999"}, "limit"),
        ({"offset": "100000000" + "0" * 5000}, "offset"),
        ({"meets_criteria": "maybe"}, "meets_criteria"),
        ({"verdict": "unstable"}, "verdict"),
        ({"verdict": ""}, "verdict"),
        ({"contact": "le"}, "contact"),
        ({"contact": "both"}, "contact"),
        ({"verdct": "stable"}, "verdct"),
        ({"limit": ["1", "2"]}, "limit"),
        ({"": "stable"}, "query"),
    ],
)
@pytest.mark.parametrize("form", ["application/json", "text/csv"])
def test_a_query_that_means_nothing_is_named(http, done, query, field, form):
    refused = http.get(f"/v1/screenings/{done['id']}/results", params=query, headers={"Accept": form})
    assert (refused.status_code, refused.json()["field"]) == (422, field), refused.text


def test_a_filter_that_nothing_could_fit_is_refused_with_those_that_could(http, done):
    base = f"/v1/screenings/{done['id']}/results"
    assert http.get(base, params={"contact": "both"}).json()["remedy"] == "give a contact of this job: LE, TE"
    said = http.get(base, params={"verdict": "x"}).json()["remedy"]
    assert said == "give one of stable, unstable at some speed, not decided"
    assert (
        http.get(base, params={"verdct": "x"}).json()["remedy"].startswith("leave it out, or give verdict:")
    )
    # What could fit, and nothing does, is an empty page.
    assert http.get(base, params={"verdict": "not decided"}).json()["total"] == 0


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/v1/screenings"),
        ("POST", "/v1/screenings"),
        ("GET", "/v1/screenings/{id}"),
        ("DELETE", "/v1/screenings/{id}"),
        ("POST", "/v1/screenings/{id}/retry"),
        ("GET", "/v1/screenings/{id}/events"),
        ("GET", "/v1/screenings/{id}/report"),
        ("GET", "/v1/screenings/{id}/blades/0"),
        ("GET", "/v1/screenings/{id}/blades/0/map.png"),
        ("GET", "/v1/screenings/{id}/blades/0/boundaries.png"),
        ("GET", "/v1/trainings"),
        ("POST", "/v1/uploads"),
    ],
)
def test_a_parameter_that_a_route_of_jobs_does_not_have_is_refused(http, done, method, path):
    asked = {"contact": "LE", "nam": "x"} if path.endswith("map.png") else {"nam": "x"}
    refused = http.request(method, path.format(id=done["id"]), params=asked)
    assert (refused.status_code, refused.json()["field"]) == (422, "nam"), refused.text
    assert http.get(f"/v1/screenings/{done['id']}").json()["state"] == "done"


def test_a_state_that_no_job_has_is_refused(http):
    refused = http.get("/v1/screenings", params={"state": "finished"})
    assert (refused.status_code, refused.json()["field"]) == (422, "state")
    assert "done" in refused.json()["remedy"]


def test_events_tell_the_way_to_the_end(http, done):
    with http.stream("GET", f"/v1/screenings/{done['id']}/events") as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        lines = list(stream.iter_lines())
    assert lines[0] == "event: done"
    assert json.loads(lines[1].removeprefix("data: "))["id"] == done["id"]


def test_charts_and_report_are_drawn(http, done):
    base = f"/v1/screenings/{done['id']}"
    png = http.get(f"{base}/blades/0/map.png", params={"contact": "LE"})
    assert (png.status_code, png.content[:4]) == (200, b"\x89PNG")
    assert http.get(f"{base}/blades/1/boundaries.png").content[:4] == b"\x89PNG"
    report = http.get(f"{base}/report")
    assert report.headers["content-type"].startswith("text/html")
    for said in ("nasa-rotor-37", "generic-compressor-blade", "blades[2]", "<svg"):
        assert said in report.text
    least = http.get(f"{base}/report", params={"sheets": "1"}).text
    assert "The 1 blade with the smallest K<sub>e</sub> of 2 screened" in least
    for path, field in (
        ("blades/2/map.png?contact=LE", "blade_index"),
        ("blades/7/map.png?contact=LE", "blade_index"),
        ("blades/0/map.png?contact=tip", "contact"),
    ):
        missing = http.get(f"{base}/{path}")
        assert (missing.status_code, missing.json()["field"]) == (404, field)


def test_the_blade_of_a_result_is_had_as_it_was_screened(http, done):
    base = f"/v1/screenings/{done['id']}/blades"
    for index, name in ((0, "nasa_rotor_37"), (1, "generic_compressor_blade")):
        answer = http.get(f"{base}/{index}")
        assert answer.status_code == 200 and answer.headers["content-type"] == "application/json"
        assert answer.json() == blade_to_dict(example_blade(name))
    for path, status, field in (("2", 404, "blade_index"), ("7", 404, "blade_index"), ("x", 422, "index")):
        missing = http.get(f"{base}/{path}")
        assert (missing.status_code, missing.json()["field"]) == (status, field)


def test_an_upload_is_screened_like_the_blades_in_it(http, service, done):
    blades = [blade_to_dict(example_blade(name)) for name in ("nasa_rotor_37", "generic_compressor_blade")]
    lines = b"\n".join(json.dumps(blade).encode() for blade in blades)
    sent = http.post(
        "/v1/uploads?name=night.jsonl", content=lines, headers={"Content-Type": "application/x-ndjson"}
    )
    assert sent.status_code == 201, sent.text
    question = changed(blades=[{"upload": sent.json()["id"]}])
    job = http.post("/v1/screenings", json=question).json()
    assert http.delete(f"/v1/uploads/{sent.json()['id']}").status_code == 204  # the job keeps what it needs
    assert until_over(service.url, job["id"], 180.0)["state"] == "done"
    rows = http.get(f"/v1/screenings/{job['id']}/results").json()["results"]
    same = http.get(f"/v1/screenings/{done['id']}/results").json()["results"]
    assert [row["source"] for row in rows if row["rank"] == 4] == ["night.jsonl:1"]
    for row, other in zip(rows, same, strict=True):
        assert row | {"source": ""} == other | {"source": ""}
    again = http.post("/v1/screenings", json=question)
    assert (again.status_code, again.json()["field"]) == (404, "blades[0].upload")


ROTOR = json.dumps(blade_to_dict(example_blade("nasa_rotor_37"))).encode()
LINES = "application/x-ndjson"


def zipped(**files: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("form", "content", "status", "field"),
    [
        (LINES, ROTOR + b'\n{"schema": \n', 422, "night:2"),
        (LINES, b"\n\n", 422, "night"),
        (LINES, b'{"name": "a", "name": "b"}', 422, "night:1.name"),
        (LINES, b"{}\n" * 51, 413, "night"),
        ("application/json", b"[]", 422, "night"),
        ("application/json", b"", 422, "night"),
        ("application/json", b'[{}, {"states": [{"a": 1, "a": 2}]}]', 422, "night[1].states[0].a"),
        ("application/json", b"\xff", 422, "night"),
        ("application/zip", ROTOR, 422, "night"),
        ("application/zip", zipped(**{"a.json": ROTOR})[:-30], 422, "night"),
        ("application/zip", zipped(**{"a.txt": ROTOR}), 422, "night"),
        ("application/zip", zipped(**{"a.json": ROTOR, "sub/b.json": b"{"}), 422, "night/sub/b.json"),
        ("application/zip", zipped(**{"a.json": b" " * 10**7}), 413, "night/a.json"),
    ],
)
def test_a_file_that_cannot_be_read_is_refused_when_it_has_come_and_not_kept(
    http, data, form, content, status, field
):
    before = sorted((data / "uploads").iterdir())
    refused = http.post("/v1/uploads?name=night", content=content, headers={"Content-Type": form})
    assert (refused.status_code, refused.json()["field"]) == (status, field), refused.text
    assert refused.json()["remedy"]
    assert sorted((data / "uploads").iterdir()) == before


DAMPED_BELOW_ZERO = ROTOR.replace(b'"damping_ratio": [', b'"damping_ratio": [-', 1)


@pytest.mark.parametrize(
    ("form", "content", "blades", "fault"),
    [
        (LINES, b"\n".join([ROTOR, b"", ROTOR]), 2, None),
        (LINES, b"\n".join([ROTOR, ROTOR, DAMPED_BELOW_ZERO, b"{}"]), 4, "night:3.damping_ratio[0]"),
        ("application/json", ROTOR, 1, None),
        ("application/json", b"[" + ROTOR + b", 5, {}]", 3, "night[1]"),
        (
            "application/zip",
            zipped(**{"a.json": ROTOR, "b.json": DAMPED_BELOW_ZERO}),
            2,
            "night/b.json.damping_ratio[0]",
        ),
    ],
)
def test_a_file_is_answered_with_the_blades_in_it_and_the_first_that_cannot_be_used(
    http, form, content, blades, fault
):
    sent = http.post("/v1/uploads?name=night", content=content, headers={"Content-Type": form})
    assert sent.status_code == 201, sent.text
    told = sent.json()
    assert told["blades"] == blades
    assert (told["fault"] and told["fault"]["field"]) == fault
    order = changed(blades=[{"upload": told["id"]}], bad_blades="refuse")
    ordered = http.post("/v1/screenings", json=order)
    if fault is None:  # what is not told here is not refused there either
        assert ordered.status_code == 202, ordered.text
        http.delete(ordered.json()["links"]["self"])
    else:
        assert (ordered.status_code, ordered.json()["field"]) == (422, fault)


@pytest.mark.parametrize(
    ("fields", "status", "field"),
    [
        ({"bad_blades": "refuse"}, 422, "blades[2].schema"),
        ({"blades": []}, 422, "blades"),
        ({"blades": [5], "bad_blades": "refuse"}, 422, "blades[0]"),
        ({"blades": [{"upload": "../x"}]}, 404, "blades[0].upload"),
        ({"blades": [{"example": "no"}]}, 422, "blades[0].example"),
        ({"blades": [{"example": "nasa_rotor_37"}] * 51}, 413, "blades"),
        (
            {"contacts": [{"weights": {"no": 1.0}}], "bad_blades": "refuse"},
            422,
            "contacts[0].weights.no",
        ),
        ({"ke_max": 1e15, "bad_blades": "refuse"}, 413, "ke_max"),
        ({"speed_range_hz": [1e-3, 300.0], "bad_blades": "refuse"}, 413, "speed_range_hz[0]"),
        ({"speed_range_ratio": [1e-4, 300.0], "bad_blades": "refuse"}, 422, "speed_range_ratio"),
        ({"contacts": [CONTACTS[0], CONTACTS[0]]}, 422, "contacts[1].name"),
        ({"contacts": [{"weights": {"LE": -1}}]}, 422, "contacts[0].weights.LE"),
        ({"speed_range_hz": [300.0, 100.0]}, 422, "speed_range_hz"),
        (
            {"speed_range_hz": [1.0, 2.0], "speed_range_ratio": [0.1, 0.2]},
            422,
            "speed_range_hz, speed_range_ratio",
        ),
        ({"ke_liner": 1e9}, 422, "ke_liner"),
        ({"ke_liner": None}, 422, "criteria.least_margin"),
        ({"criteria": {"leastest": 1}}, 422, "criteria.leastest"),
        ({"map_shape": [1, 8]}, 422, "map_shape"),
        ({"map_shape": [1000, 1000]}, 413, "map_shape"),
        ({"policy": "guess"}, 422, "policy"),
        ({"alpha": 0.3}, 422, "alpha"),
        ({"name": "a\x00b"}, 422, "name"),
        ({"priority": 0}, 422, "priority"),
        ({"priority": 10}, 422, "priority"),
        ({"bad_blades": "eat"}, 422, "bad_blades"),
        ({"blade": {}}, 422, "blade"),
    ],
)
def test_what_cannot_be_screened_is_refused_by_name(http, fields, status, field):
    refused = http.post("/v1/screenings", json=changed(**fields))
    assert (refused.status_code, refused.json()["field"]) == (status, field), refused.text
    assert refused.json()["remedy"]


def test_a_contact_at_a_node_that_a_blade_has_not_is_named_with_the_blade(http):
    contacts = [{"weights": {"LE": 1.0}}, {"name": "fifth", "weights": {"LE": 1.0, "N5": 0.5}}]
    other = blade_to_dict(example_blade("nasa_rotor_37"))
    other["tip_nodes"] = ["LE", *(f"M{i}" for i in range(2, 9)), "TE"]
    asked = changed(blades=[{"example": "nasa_rotor_37"}, other], contacts=contacts, bad_blades="refuse")
    refused = http.post("/v1/screenings", json=asked)
    assert refused.status_code == 422, refused.text
    problem = refused.json()
    assert (problem["field"], problem["value"]) == ("contacts[1].weights.N5", "0.5")
    assert problem["remedy"].startswith("for blades[1]: name a tip node of the blade: LE, M2")


def test_a_cancelled_batch_keeps_what_it_has_and_a_retry_ends_it(http, service):
    blades = [blade_to_dict(example_blade("nasa_rotor_37")) | {"name": f"rotor {i}"} for i in range(45)]
    job = http.post("/v1/screenings", json=changed(blades=blades)).json()
    seen = []

    def look(document: dict) -> None:
        seen.append(document["progress"]["done"])
        if 0 < document["progress"]["done"] < 45:
            http.delete(f"/v1/screenings/{job['id']}")

    stopped = until_over(service.url, job["id"], 180.0, look)
    assert stopped["state"] == "cancelled" and 0 < max(seen) < 45
    part = http.get(f"/v1/screenings/{job['id']}/results").json()
    assert not part["complete"] and 0 < part["total"] < 90
    assert http.post(f"/v1/screenings/{job['id']}/retry").status_code == 202
    ended = until_over(service.url, job["id"], 180.0)
    assert (ended["state"], ended["attempt"]) == ("done", 2)
    whole = http.get(f"/v1/screenings/{job['id']}/results").json()
    assert whole["complete"] and whole["total"] == 90


def test_nothing_is_found_under_a_name_that_is_none(http):
    for path in ("/v1/screenings/x", "/v1/screenings/x/results", "/v1/trainings/" + "0" * 32):
        missing = http.get(path)
        assert (missing.status_code, missing.json()["field"]) == (404, "id")
    assert http.get("/v1/screenings", params={"state": "lost"}).json()["field"] == "state"
    assert http.get("/v1/screenings", params={"after": "x"}).status_code == 404

"""The documentation: committed, whole, usable, and without the internet."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from sdm_core.version import __version__
from service.app import create_app
from service.rest import openapi

COMMITTED = Path(__file__).parents[2] / "docs" / "openapi.json"
RELEASED = COMMITTED.with_name("openapi.released.json")


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    return create_app().openapi()


def test_the_committed_document_is_the_services_own(document):
    committed = json.loads(COMMITTED.read_text(encoding="utf-8"))
    assert committed == json.loads(json.dumps(document)), (
        "the wire contract changed: raise the version, then run "
        "python -m service.rest.openapi > docs/openapi.json"
    )


def test_a_released_version_keeps_its_contract(document):
    released = json.loads(RELEASED.read_text(encoding="utf-8"))
    if __version__ in released:
        assert openapi.digest(document) == released[__version__], (
            f"{__version__} is released and the wire contract changed: raise sdm_core/version.py"
        )


def test_the_digest_of_a_contract_hangs_on_the_contract_and_not_on_its_version(document):
    other = json.loads(json.dumps(document))
    other["info"]["version"] = "99.0.0"
    assert openapi.digest(other) == openapi.digest(document)
    other["paths"]["/v1/map"]["post"]["responses"].pop("406")
    assert openapi.digest(other) != openapi.digest(document)


def test_every_reference_leads_somewhere(document):
    for reference in re.findall(r'"\$ref": "#/([^"]+)"', json.dumps(document)):
        target = document
        for part in reference.split("/"):
            target = target[part]


def test_every_path_of_the_contract_is_there(document):
    paths = {f"{method.upper()} {path}" for path, item in document["paths"].items() for method in item}
    assert paths == {
        "GET /healthz",
        "GET /readyz",
        "POST /v1/blades",
        "POST /v1/boundary",
        "GET /v1/caller",
        "POST /v1/campbell",
        "POST /v1/damping",
        "GET /v1/examples",
        "POST /v1/lobes",
        "POST /v1/map",
        "GET /v1/models",
        "GET /v1/models/history",
        "POST /v1/models/rollback",
        "GET /v1/models/{model_id}",
        "GET /v1/models/{model_id}/audits",
        "POST /v1/models/{model_id}/promote",
        "GET /v1/screenings",
        "POST /v1/screenings",
        "DELETE /v1/screenings/{job_id}",
        "GET /v1/screenings/{job_id}",
        "GET /v1/screenings/{job_id}/blades/{index}",
        "GET /v1/screenings/{job_id}/blades/{index}/boundaries.png",
        "GET /v1/screenings/{job_id}/blades/{index}/map.png",
        "GET /v1/screenings/{job_id}/events",
        "GET /v1/screenings/{job_id}/report",
        "GET /v1/screenings/{job_id}/results",
        "POST /v1/screenings/{job_id}/retry",
        "POST /v1/sensitivities",
        "GET /v1/simulations",
        "POST /v1/simulations",
        "DELETE /v1/simulations/{job_id}",
        "GET /v1/simulations/{job_id}",
        "GET /v1/simulations/{job_id}/events",
        "GET /v1/simulations/{job_id}/response.png",
        "GET /v1/simulations/{job_id}/results",
        "POST /v1/simulations/{job_id}/retry",
        "GET /v1/simulations/{job_id}/spectrum.png",
        "GET /v1/simulations/{job_id}/wear_map.png",
        "GET /v1/simulations/{job_id}/worn_profile.png",
        "POST /v1/stability",
        "GET /v1/trainings",
        "POST /v1/trainings",
        "DELETE /v1/trainings/schedule",
        "GET /v1/trainings/schedule",
        "PUT /v1/trainings/schedule",
        "DELETE /v1/trainings/{job_id}",
        "GET /v1/trainings/{job_id}",
        "GET /v1/trainings/{job_id}/events",
        "GET /v1/trainings/{job_id}/result",
        "POST /v1/trainings/{job_id}/retry",
        "POST /v1/uploads",
        "DELETE /v1/uploads/{upload_id}",
        "GET /metrics",
    }


def test_every_refusal_is_documented_as_a_problem(document):
    for path in ("/v1/stability", "/v1/boundary", "/v1/sensitivities", "/v1/map"):
        responses = document["paths"][path]["post"]["responses"]
        for status in ("408", "413", "415", "422", "500", "503"):
            assert list(responses[status]["content"]) == ["application/problem+json"]
    forms = document["paths"]["/v1/map"]["post"]["responses"]["200"]["content"]
    assert set(forms) == {"application/json", "application/x-npz", "application/octet-stream", "image/png"}


def test_the_examples_work_as_they_stand(document, http):
    for path in ("/v1/stability", "/v1/boundary", "/v1/sensitivities", "/v1/map"):
        body = document["paths"][path]["post"]["requestBody"]["content"]["application/json"]
        assert http.post(path, json=body["example"]).status_code == 200
        required = document["components"]["schemas"][body["schema"]["$ref"].rpartition("/")[2]]["required"]
        assert set(required) <= body["example"].keys()


def test_the_documentation_page_loads_nothing_from_elsewhere(http):
    page = http.get("/docs")
    assert page.headers["content-type"].startswith("text/html")
    loaded = re.findall(r'(?:src|href)="([^"]+)"', page.text)
    assert loaded and all(link.startswith("/") and not link.startswith("//") for link in loaded)
    for link in loaded:
        assert http.get(link).status_code == 200
    assert '"validatorUrl": null' in page.text
    assert http.get("/openapi.json").json()["info"]["title"] == "rubscreen"


def test_an_asset_that_is_not_there_is_a_problem(http, problem):
    problem(http.get("/docs/assets/none.js"), 404, "path")

"""The OpenAPI document; ``python -m service.rest.openapi`` prints what ``docs/openapi.json`` holds.

With ``--digest`` it prints the line that a release adds to ``docs/openapi.released.json``.
"""

from __future__ import annotations

import hashlib
import json
import sys
from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from sdm_core.version import __version__
from service.rest.access import guarded_routes, needed
from service.rest.assessment_questions import CampbellQuestion, DampingQuestion, LobesQuestion
from service.rest.blade_question import BladeQuestion
from service.rest.errors import PROBLEM_JSON
from service.rest.forms.media_types import ARROW, NPZ
from service.rest.known_query import routes_of_known_query
from service.rest.model_schemas import PromotionQuestion
from service.rest.profile_schema import PROFILE
from service.rest.question_schemas import BLADE, CONTACT
from service.rest.questions import BoundaryQuestion, MapQuestion, PointsQuestion, SensitivitiesQuestion
from service.rest.schemas import ProblemDocument
from service.rest.screening_question import ScreeningQuestion
from service.rest.simulation_question import SimulationQuestion
from service.rest.training_question import ScheduleQuestion, TrainingQuestion

Json = dict[str, Any]

_REF = "#/components/schemas/{model}"
_BULK = {
    NPZ: "numpy.savez of the question's long arrays (`speed_hz`, `ke`) as numbers and of the rest of it "
    "as JSON text in `question`. Unpacked no longer than a plain body may be.",
    ARROW: "Arrow IPC stream, uncompressed: the question's long arrays as columns, the rest of it as JSON in "
    "the schema's metadata under `rubscreen.question`.",
}
_MEANINGS = {
    401: "No key came, or one that is not known, expired or revoked; where the service asks for keys.",
    403: "The key's role is not enough.",
    404: "There is nothing of this identifier.",
    406: "No form of the answer is one the client accepts.",
    408: "The body did not arrive in time.",
    409: "It does not go with what is there already; the problem says why.",
    413: "The body, an array or the number of points is over the limit.",
    415: "The body has a form that is not taken here.",
    422: "The request cannot be used; the problem names the field, its value and the remedy.",
    429: "More requests or jobs than the caller may have; Retry-After says when to come back.",
    500: "A fault of the service.",
    503: "The service cannot answer now.",
    507: "The service has no room left on its disk.",
}
_KEY = (
    "`rub_<id>_<secret>`, as `rubscreen keys create` prints it. A service of one's own machine asks for none."
)
_SECURITY = {
    "bearer": {"type": "http", "scheme": "bearer", "bearerFormat": "rub_<id>_<secret>", "description": _KEY},
    "header": {"type": "apiKey", "in": "header", "name": "X-API-Key", "description": _KEY},
}


def problems(*statuses: int) -> dict[int | str, Json]:
    """OpenAPI responses with a problem document, for a route."""
    schema = {"$ref": _REF.format(model=ProblemDocument.__name__)}
    return {
        status: {"description": _MEANINGS[status], "content": {PROBLEM_JSON: {"schema": schema}}}
        for status in statuses
    }


def request_body(question: type[BaseModel], example: Json, *binary: str, required: bool = True) -> Json:
    """OpenAPI request body, for a route that parses it itself; `binary` are the other forms it takes."""
    content: Json = {"application/json": {"schema": {"$ref": _REF.format(model=question.__name__)}}}
    content["application/json"]["example"] = example
    for form in binary:
        content[form] = {"schema": {"type": "string", "format": "binary", "description": _BULK[form]}}
    return {"requestBody": {"required": required, "content": content}}


def install(app: FastAPI) -> None:
    """Add to the document what routes that parse their own bodies leave out."""
    generate = app.openapi

    def with_components() -> Json:
        if app.openapi_schema is None:
            document = generate()
            document["components"]["schemas"] |= _components()
            _guards(app, document)
            _known_queries(app, document)
            _own_422(document)
        assert app.openapi_schema is not None
        return app.openapi_schema

    app.openapi = with_components  # type: ignore[method-assign]


def _guards(app: FastAPI, document: Json) -> None:
    """Say what every guarded route asks for, and how it refuses."""
    document["components"]["securitySchemes"] = _SECURITY
    for route, role in guarded_routes(app.routes):
        for method in route.methods if route.include_in_schema else ():
            operation = document["paths"][route.path_format][method.lower()]
            operation["security"] = [{name: []} for name in _SECURITY]
            operation["description"] = f"{operation.get('description', '')}\n\nNeeds {needed(role)}.".strip()
            refusals = {str(status): problem for status, problem in problems(401, 403, 429).items()}
            operation["responses"] = dict(sorted((refusals | operation["responses"]).items()))


def _known_queries(app: FastAPI, document: Json) -> None:
    """Every route that refuses parameters it does not have may answer 422."""
    for route in routes_of_known_query(app.routes):
        for method in route.methods if route.include_in_schema else ():
            operation = document["paths"][route.path_format][method.lower()]
            refusal = {"422": problems(422)[422]}
            operation["responses"] = dict(sorted((refusal | operation["responses"]).items()))


def _own_422(document: Json) -> None:
    """FastAPI's own 422 as what the service makes of it."""
    for operations in document["paths"].values():
        for operation in operations.values():
            if "HTTPValidationError" in json.dumps(operation["responses"].get("422", {})):
                operation["responses"]["422"] = problems(422)[422]
    for name in ("HTTPValidationError", "ValidationError"):
        document["components"]["schemas"].pop(name, None)


def _components() -> Json:
    described = (
        PointsQuestion,
        BoundaryQuestion,
        SensitivitiesQuestion,
        MapQuestion,
        CampbellQuestion,
        LobesQuestion,
        DampingQuestion,
        BladeQuestion,
        ScreeningQuestion,
        SimulationQuestion,
        TrainingQuestion,
        ScheduleQuestion,
        PromotionQuestion,
        ProblemDocument,
    )
    _, found = models_json_schema([(model, "validation") for model in described], ref_template=_REF)
    schemas = found["$defs"]
    parts = {"blade": "Blade", "contact": "Contact", "profile": "Profile"}
    for schema in schemas.values():
        for field in parts.keys() & schema["properties"].keys():
            schema["properties"][field] = {"$ref": _REF.format(model=parts[field])}
    return schemas | {"Blade": BLADE, "Contact": CONTACT, "Profile": PROFILE}


def digest(document: Json) -> str:
    """SHA-256 of the contract, whatever version it has.

    ``docs/openapi.released.json`` holds that of every released version, and a test holds a released version
    to it: from then on the contract only changes together with the version.
    """
    contract = document | {"info": {**document["info"], "version": ""}}
    return hashlib.sha256(json.dumps(contract, sort_keys=True).encode()).hexdigest()


if __name__ == "__main__":
    from service.app import create_app

    made = create_app().openapi()
    released = {__version__: digest(made)}
    sys.stdout.write(json.dumps(released if "--digest" in sys.argv else made, indent=1) + "\n")

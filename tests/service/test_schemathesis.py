"""The whole documented API, asked what its own document allows and forbids: no 5xx, nothing undocumented."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import schemathesis
from bulk_bodies import to_arrow, to_npz
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from hypothesis.errors import Unsatisfiable
from schemathesis import GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.config import SchemathesisConfig
from schemathesis.openapi import media_type
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    negative_data_rejection,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from service.app import create_app
from service.rest.forms.media_types import ARROW, NPZ
from service.rest.question_schemas import POINTS_EXAMPLE
from service.settings import Settings

CHECKS = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_schema_conformance,
    response_headers_conformance,
    negative_data_rejection,
]
# Of each operation and mode; without a key every one of them is refused alike.
EXAMPLES = {"off": 15, "on": 4}

media_type(NPZ, st.sampled_from([to_npz(POINTS_EXAMPLE), to_npz(POINTS_EXAMPLE)[:-30], b"PK"]))
media_type(ARROW, st.sampled_from([to_arrow(POINTS_EXAMPLE), to_arrow(POINTS_EXAMPLE)[:-30], b"ARROW1"]))

# Too large is refused before it is looked at, which the tool does not count as a refusal.
_REFUSED = ["400", "401", "403", "404", "405", "406", "408", "409", "413", "415", "422", "429"]
_CONFIG = SchemathesisConfig.from_dict(
    {"checks": {"negative_data_rejection": {"expected-statuses": _REFUSED}}}
)
SCHEMA = schemathesis.openapi.from_dict(create_app(Settings()).openapi(), config=_CONFIG)
OPERATIONS = {found.ok().label: found.ok() for found in SCHEMA.get_all_operations()}


@pytest.fixture(scope="module", params=EXAMPLES, ids=["open", "no-key"])
def service(serving, new_screener, tmp_path_factory, request) -> Iterator[tuple[str, int]]:
    """A service of little reach that runs no job; open, or closed to who has no key; how much to ask."""
    limits = Settings(
        auth=request.param,
        run_jobs=False,
        data_folder=tmp_path_factory.mktemp("data"),
        max_points=1000,
        max_modes=8,
        max_mesh_nodes=200,
    )
    with serving(create_app(limits, screener=new_screener())) as address:
        yield address, EXAMPLES[request.param]


@pytest.mark.parametrize("mode", list(GenerationMode), ids=lambda mode: mode.value)
@pytest.mark.parametrize("label", OPERATIONS)
@pytest.mark.filterwarnings("ignore::hypothesis.errors.HypothesisDeprecationWarning")
def test_every_answer_is_a_documented_one(service, label, mode):
    operation, (url, examples) = OPERATIONS[label], service

    @given(operation.as_strategy(generation_mode=mode))
    @settings(
        max_examples=examples,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        derandomize=True,
        phases=(Phase.explicit, Phase.generate),
    )
    def check(case: schemathesis.Case) -> None:
        case.call_and_validate(base_url=url, checks=CHECKS)

    try:
        check()
    except Unsatisfiable:
        pytest.skip("a request without parameters cannot be wrong")

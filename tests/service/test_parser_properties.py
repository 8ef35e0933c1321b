"""Whatever arrives, the service answers or says what is wrong; it never fails."""

from __future__ import annotations

import copy
import json
from typing import Any

import httpx
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sdm_core.errors import InvalidInput
from service.rest.body import parsed
from service.rest.question_schemas import BOUNDARY_EXAMPLE, MAP_EXAMPLE, POINTS_EXAMPLE
from service.rest.questions import BoundaryQuestion, MapQuestion, PointsQuestion, Question
from service.settings import Settings

QUESTIONS: dict[type[Question], dict[str, Any]] = {
    PointsQuestion: POINTS_EXAMPLE,
    BoundaryQuestion: BOUNDARY_EXAMPLE,
    MapQuestion: MAP_EXAMPLE,
}
leaves = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.integers(min_value=10**300, max_value=10**320)
    | st.floats()
    | st.sampled_from([0, -0.0, 1, 1e300, 5e-324, 1e15, 1e7, "", "LE", "auto", "rubscreen/blade/1"])
    | st.text(max_size=5)
)
anything = st.recursive(
    leaves,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=8,
)


def _places(value: Any, path: tuple = ()) -> list[tuple]:
    """Paths of every part of a JSON value below its root."""
    children = (
        value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    )
    found = []
    for key, child in children:
        found += [(*path, key), *_places(child, (*path, key))]
    return found


@st.composite
def damaged(draw: st.DrawFn) -> tuple[type[Question], dict[str, Any]]:
    """A good question with up to three of its parts replaced by anything, or taken away."""
    kind = draw(st.sampled_from(list(QUESTIONS)))
    body = copy.deepcopy(QUESTIONS[kind])
    for _ in range(draw(st.integers(1, 3))):
        *parents, last = draw(st.sampled_from(_places(body)))
        target = body
        for part in parents:
            target = target[part]
        if draw(st.booleans()):
            target[last] = draw(anything)
        else:
            del target[last]
        if not _places(body):
            break
    return kind, body


@given(damaged())
@settings(max_examples=300, deadline=None)
def test_a_damaged_question_is_read_or_its_fault_named(case):
    kind, body = case
    try:
        question = kind.read(body, Settings())
    except InvalidInput as error:
        assert error.field and error.remedy
    else:
        assert question.blade.mode_count >= 1


@given(
    st.binary(max_size=200) | st.text(max_size=100).map(lambda text: text.encode("utf-8", "surrogatepass"))
)
@settings(max_examples=300, deadline=None)
def test_any_bytes_are_json_or_refused_as_the_body(body):
    try:
        parsed(body)
    except InvalidInput as error:
        assert error.field == "body"


@given(anything)
@settings(max_examples=200, deadline=None)
def test_what_python_writes_as_json_is_read_back(value):
    text = json.dumps(value)
    try:
        assert json.dumps(parsed(text.encode())) == text
    except InvalidInput as error:
        assert "surrogate" in error.remedy


@given(st.integers(0, len(json.dumps(POINTS_EXAMPLE)) - 1))
@settings(max_examples=100, deadline=None)
def test_a_question_cut_off_anywhere_is_refused(end):
    with pytest.raises(InvalidInput):
        parsed(json.dumps(POINTS_EXAMPLE).encode()[:end])


@given(damaged())
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_question_over_http_is_never_a_fault_of_the_service(shared_address, case):
    kind, body = case
    path = {PointsQuestion: "stability", BoundaryQuestion: "boundary", MapQuestion: "map"}[kind]
    answer = httpx.post(f"{shared_address}/v1/{path}", content=json.dumps(body))
    assert answer.status_code in (200, 413, 422), answer.text
    if answer.status_code != 200:
        assert {"field", "value", "remedy"} <= answer.json().keys()

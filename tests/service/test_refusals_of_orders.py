"""Orders of jobs and of models: each field of a plain type refuses what it cannot be, in words of ours."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import BaseModel, ValidationError
from pydantic.functional_validators import PlainValidator

from sdm_core.errors import InvalidInput
from service.field_values import may_be, remedy_for
from service.rest.blade_question import BladeQuestion
from service.rest.model_schemas import PromotionQuestion
from service.rest.questions import read_question
from service.rest.screening_question import SCREENING_EXAMPLE, ScreeningQuestion
from service.rest.training_question import (
    SCHEDULE_EXAMPLE,
    TRAINING_EXAMPLE,
    ScheduleQuestion,
    TrainingQuestion,
)
from service.settings import Settings

GOOD: dict[type[BaseModel], dict[str, Any]] = {
    BladeQuestion: {},
    ScreeningQuestion: SCREENING_EXAMPLE,
    TrainingQuestion: TRAINING_EXAMPLE,
    ScheduleQuestion: SCHEDULE_EXAMPLE,
    PromotionQuestion: {},
}
# What checks itself says in words of its own what it wants.
PLAIN = [
    (kind, name)
    for kind in GOOD
    for name, field in kind.model_fields.items()
    if not any(isinstance(part, PlainValidator) for part in field.metadata)
]
WRONG = [None, True, -1, 10**400, 1.5, float("nan"), float("inf"), "", "x" * 5000, [], [1], {}, {"a": 1}]


@pytest.mark.parametrize(("kind", "name"), PLAIN, ids=lambda part: getattr(part, "__name__", part))
def test_whatever_a_field_cannot_be_is_refused_with_all_that_it_may_be(kind, name):
    refusals = 0
    for value in WRONG:
        body = GOOD[kind] | {name: value}
        try:
            kind.model_validate(body, context=Settings())
            continue
        except ValidationError as error:
            fault = error.errors(include_url=False)[0]
        if fault["loc"] != (name,):  # it may be this, and something else is missing
            continue
        refusals += 1
        with pytest.raises(InvalidInput) as refused:
            read_question(kind, body, Settings())
        assert (refused.value.field, refused.value.remedy) == (name, remedy_for(kind.model_fields[name]))
        assert fault["msg"] not in str(refused.value)
    assert refusals >= 5
    assert "/docs" not in may_be(kind.model_fields[name])


@pytest.mark.parametrize(
    ("kind", "field", "value", "remedy"),
    [
        (ScreeningQuestion, "priority", 10, "give a whole number from 1 to 9, or leave it out"),
        (ScreeningQuestion, "bad_blades", "keep", "give one of refuse, skip, or leave it out"),
        (
            TrainingQuestion,
            "seed",
            2**31,
            "give a whole number from 0 up to below 2147483648, or leave it out",
        ),
        (TrainingQuestion, "name", "x" * 201, "give text of at most 200 characters, or leave it out"),
        (TrainingQuestion, "promote", "yes", "give true or false, or leave it out"),
        (ScheduleQuestion, "cron", 3, "give text of at most 100 characters"),
        (ScheduleQuestion, "training", [], "give a JSON object, or leave it out"),
    ],
)
def test_the_remedy_is_the_whole_of_what_fits(kind, field, value, remedy):
    with pytest.raises(InvalidInput) as refused:
        read_question(kind, GOOD[kind] | {field: value}, Settings())
    assert refused.value.remedy == remedy


def test_a_misspelt_field_is_refused_with_the_one_that_is_like_it():
    with pytest.raises(InvalidInput) as refused:
        read_question(TrainingQuestion, {"epoch": 3}, Settings())
    assert refused.value.field == "epoch"
    assert refused.value.remedy.startswith("leave it out, or give epochs: the fields are name, priority")

"""What is asked about a blade over a range of rotor speeds: Campbell diagram, lobes, the damping needed."""

from __future__ import annotations

from typing import Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, PlainValidator, ValidationInfo, WithJsonSchema, model_validator

from sdm_core.assessment.campbell import DEFAULT_ORDERS, HIGHEST_ORDER
from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput, OutOfSpeedRange
from sdm_core.validation import KE_LIMIT, SPEED_LIMITS_HZ, number
from service.rest.question_schemas import BLADE, CONTACT, KE_MAX, POINTS_EXAMPLE
from service.rest.questions import read_question, settings_of, the_blade, the_contact, the_ke_max
from service.settings import Settings
from service.sizes import check_length, check_reach

Json = dict[str, Any]
MOST_LOBES, USUAL_LOBES = 400, 40
_MOST_ORDERS = 200

RANGE: Json = {
    "type": "array",
    "minItems": 2,
    "maxItems": 2,
    "items": {"type": "number", "minimum": SPEED_LIMITS_HZ[0], "maximum": SPEED_LIMITS_HZ[1]},
    "description": "Rotor speeds [low, high] in Hz.",
}
_ORDERS: Json = {
    "type": "array",
    "items": {"type": "integer", "minimum": 1, "maximum": HIGHEST_ORDER},
    "maxItems": _MOST_ORDERS,
    "default": list(DEFAULT_ORDERS),
    "description": "Engine orders.",
}

_KE_LINER: Json = {
    "oneOf": [{"type": "number", "exclusiveMinimum": 0, "maximum": KE_LIMIT}, {"type": "null"}],
    "description": "Of the liner, N/m: the answer then tells at which speeds it destabilises.",
}


def _range(value: Any) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise InvalidInput("speed_range_hz", value, "give [low, high]")
    low, high = (number(f"speed_range_hz[{i}]", end, *SPEED_LIMITS_HZ, "Hz") for i, end in enumerate(value))
    if low >= high * (1 - 1e-6):
        raise InvalidInput("speed_range_hz", [low, high], "give the lower speed first, not next to the other")
    return low, high


def _orders(value: Any) -> tuple[int, ...]:
    if not isinstance(value, list):
        raise InvalidInput("engine_orders", value, "give a list of whole numbers, or leave it out")
    check_length("engine_orders", value, _MOST_ORDERS)
    for i, order in enumerate(value):
        whole = isinstance(order, int) and not isinstance(order, bool)
        if not whole or not 1 <= order <= HIGHEST_ORDER:
            raise InvalidInput(f"engine_orders[{i}]", order, f"give a whole number from 1 to {HIGHEST_ORDER}")
    return tuple(value)


def _count(value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= MOST_LOBES:
        raise InvalidInput("count", value, f"give a whole number from 1 to {MOST_LOBES}")
    return value


def _ke_liner(value: Any) -> float | None:
    return None if value is None else number("ke_liner", value, 0.0, KE_LIMIT, "N/m", open_low=True)


def _ke(value: Any) -> float:
    return number("ke", value, 0.0, KE_LIMIT / 10, "N/m", open_low=True)


class RangeQuestion(BaseModel):
    """A blade over a range of rotor speeds."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

    blade: Annotated[Blade, PlainValidator(the_blade), WithJsonSchema(BLADE)]
    speed_range_hz: Annotated[tuple[float, float], PlainValidator(_range), WithJsonSchema(RANGE)]

    @classmethod
    def read(cls, data: Any, settings: Settings) -> Self:
        """The question in a parsed body.

        Raises
        ------
        InvalidInput
            For the first field that cannot be used.
        TooLarge
            When a list is over the limits of `settings`.
        """
        return read_question(cls, data, settings)


class CampbellQuestion(RangeQuestion):
    """Natural frequencies over rotor speed, and where engine orders meet them."""

    engine_orders: Annotated[tuple[int, ...], PlainValidator(_orders), WithJsonSchema(_ORDERS)] = (
        DEFAULT_ORDERS
    )

    @model_validator(mode="after")
    def _within_the_modal_data(self) -> Self:
        for i, speed in enumerate(self.speed_range_hz):
            try:
                self.blade.at_speeds(np.array([speed]))
            except OutOfSpeedRange as error:
                raise OutOfSpeedRange(f"speed_range_hz[{i}]", error.value, error.remedy) from None
        return self


class LobesQuestion(RangeQuestion):
    """The deepest lobes of a blade under a contact, and the mode that owns each."""

    contact: Annotated[ContactConfiguration, PlainValidator(the_contact), WithJsonSchema(CONTACT)]
    ke_max: Annotated[float, PlainValidator(the_ke_max), WithJsonSchema(KE_MAX)]
    count: Annotated[
        int,
        PlainValidator(_count),
        WithJsonSchema({"type": "integer", "minimum": 1, "maximum": MOST_LOBES, "default": USUAL_LOBES}),
    ] = USUAL_LOBES
    ke_liner: Annotated[float | None, PlainValidator(_ke_liner), WithJsonSchema(_KE_LINER)] = None

    @model_validator(mode="after")
    def _the_core_can_reach_it(self, info: ValidationInfo) -> Self:
        if self.ke_liner is not None and self.ke_liner > self.ke_max:
            raise InvalidInput("ke_liner", self.ke_liner, f"give at most ke_max, {self.ke_max:g} N/m")
        _check_reach(self.blade, self.contact, self.speed_range_hz, "ke_max", self.ke_max, info)
        return self


class DampingQuestion(RangeQuestion):
    """The damping with which no lobe comes below a stiffness."""

    contact: Annotated[ContactConfiguration, PlainValidator(the_contact), WithJsonSchema(CONTACT)]
    ke: Annotated[
        float,
        PlainValidator(_ke),
        WithJsonSchema(
            {
                "type": "number",
                "exclusiveMinimum": 0,
                "maximum": KE_LIMIT / 10,
                "description": "K_e to be met over the whole range, N/m: the liner's, with its margin.",
            }
        ),
    ]

    @model_validator(mode="after")
    def _the_core_can_reach_it(self, info: ValidationInfo) -> Self:
        _check_reach(self.blade, self.contact, self.speed_range_hz, "ke", self.ke, info)
        return self


def _check_reach(
    blade: Blade,
    contact: ContactConfiguration,
    span: tuple[float, float],
    field: str,
    ke: float,
    info: ValidationInfo,
) -> None:
    try:
        check_reach(blade, contact, np.array(span), field, ke, settings_of(info))
    except InvalidInput as error:
        renamed = error.field.replace("speed_hz[", "speed_range_hz[")
        raise type(error)(renamed, error.value, error.remedy) from None


CAMPBELL_EXAMPLE: Json = {"blade": POINTS_EXAMPLE["blade"], "speed_range_hz": [180.0, 286.5]}
LOBES_EXAMPLE: Json = {
    **CAMPBELL_EXAMPLE,
    "contact": POINTS_EXAMPLE["contact"],
    "ke_max": 100000.0,
    "count": 3,
}
DAMPING_EXAMPLE: Json = {**CAMPBELL_EXAMPLE, "contact": POINTS_EXAMPLE["contact"], "ke": 15000.0}

"""What ``POST /v1/simulations`` is asked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    PlainValidator,
    PrivateAttr,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)

from sdm_core.blade import Blade
from sdm_core.errors import InvalidInput
from sdm_core.time_domain.liner.abradable_liner import LENGTH_LIMIT, MODULUS_LIMIT, Friction
from sdm_core.time_domain.liner.casing import MOST_LOBES
from sdm_core.validation import KE_LIMIT, speeds
from service.jobs.job import FIRST_PRIORITY, LAST_PRIORITY, USUAL_PRIORITY
from service.rest.question_schemas import BLADE, POINTS_EXAMPLE, SPEEDS
from service.rest.questions import check_job_name, read_question, settings_of, the_blade
from service.settings import Settings
from service.simulation.constants import USUAL_KE, CasingConstants, LinerConstants
from service.simulation.limits import check_reachable, check_size
from service.simulation.order import USUAL_CELLS, USUAL_REVOLUTIONS, SimulationOrder
from service.sizes import check_length

Json = dict[str, Any]
_usual_liner, _usual_casing = LinerConstants(), CasingConstants()


def _positive(most: float, what: str, usual: float | None = None) -> Json:
    schema: Json = {"type": "number", "exclusiveMinimum": 0, "maximum": most, "description": what}
    return schema if usual is None else schema | {"default": usual}


def _or_null(schema: Json) -> Json:
    return {"oneOf": [{k: v for k, v in schema.items() if k != "description"}, {"type": "null"}]} | {
        "description": schema["description"]
    }


_METRES = {"type": "number", "minimum": -LENGTH_LIMIT, "maximum": LENGTH_LIMIT}
_FROM_ZERO = {"type": "number", "minimum": 0, "maximum": LENGTH_LIMIT}
LINER: Json = {
    "type": "object",
    "additionalProperties": False,
    "description": "The abradable liner: bars with linear hardening under each contact node in each cell.",
    "properties": {
        "ke": _or_null(
            _positive(
                KE_LIMIT,
                f"K_e of each contact node, N/m, from which the plastic modulus follows; {USUAL_KE:g} where "
                "neither is given.",
            )
        ),
        "youngs_modulus_pa": _positive(MODULUS_LIMIT, "Pa.", _usual_liner.youngs_modulus_pa),
        "yield_stress_pa": {
            "type": "number",
            "minimum": 0,
            "maximum": MODULUS_LIMIT,
            "description": "Pa.",
            "default": _usual_liner.yield_stress_pa,
        },
        "plastic_modulus_pa": _or_null(
            {"type": "number", "minimum": 0, "maximum": MODULUS_LIMIT, "description": "Pa; instead of ke."}
        ),
        "thickness_m": _positive(LENGTH_LIMIT, "m.", _usual_liner.thickness_m),
        "axial_width_m": _positive(LENGTH_LIMIT, "That a contact node rubs, m.", _usual_liner.axial_width_m),
        "contact_length_m": _positive(
            LENGTH_LIMIT, "Along the circumference at an instant, m.", _usual_liner.contact_length_m
        ),
    },
}
CASING: Json = {
    "type": "object",
    "additionalProperties": False,
    "description": "A rigid casing that may be oval and may close in.",
    "properties": {
        "clearance_m": {
            "oneOf": [_METRES, {"type": "array", "minItems": 1, "items": _METRES}],
            "description": "m, one number or one a contact node.",
            "default": _usual_casing.clearance_m,
        },
        "ovalisation_m": {
            **_FROM_ZERO,
            "description": "Amplitude, m; 0 for a round casing.",
            "default": _usual_casing.ovalisation_m,
        },
        "lobes": {
            "type": "integer",
            "minimum": 1,
            "maximum": MOST_LOBES,
            "description": "Of the ovalisation.",
            "default": _usual_casing.lobes,
        },
        "ovalisation_revolutions": {
            "type": "number",
            "minimum": 0,
            "maximum": 1e6,
            "description": "Over which it grows.",
            "default": _usual_casing.ovalisation_revolutions,
        },
        "feed_per_revolution_m": {
            **_FROM_ZERO,
            "description": "What the casing closes in by each revolution, m.",
            "default": _usual_casing.feed_per_revolution_m,
        },
        "radius_m": _or_null(_positive(1e3, "m; left out, the blade's tip radius.")),
    },
}
FRICTION: Json = {
    "oneOf": [
        {
            "type": "object",
            "required": ["coefficient", "rotation"],
            "additionalProperties": False,
            "properties": {
                "coefficient": {"type": "number", "minimum": 0, "maximum": 10},
                "rotation": {
                    "enum": [1, -1],
                    "description": "1 where the blade turns towards its positive tangential direction, -1 "
                    "where it turns the other way: no blade file tells, and it decides what friction does.",
                },
            },
        },
        {"type": "null"},
    ],
    "description": "Of the tip on the liner; needs tangential mode shapes. Left out: none.",
}
NODES: Json = {
    "oneOf": [
        {"type": "array", "minItems": 1, "uniqueItems": True, "items": {"type": "string"}},
        {"type": "null"},
    ],
    "description": "Tip nodes that can touch. Left out: the first, the leading edge.",
}


def _speeds(value: Any, info: ValidationInfo) -> tuple[float, ...]:
    check_length("speed_hz", value, settings_of(info).max_simulation_speeds, "send several simulations")
    return tuple(speeds("speed_hz", value).tolist())


def _nodes(value: Any, info: ValidationInfo) -> tuple[str, ...] | None:
    if value is None:
        return None
    if not isinstance(value, list) or not value or not all(isinstance(node, str) for node in value):
        raise InvalidInput("nodes", value, "give a list of names of tip nodes, or leave it out")
    check_length("nodes", value, settings_of(info).max_tip_nodes, "name fewer")
    return tuple(value)


def _object(field: str, value: Any, kind: Any) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        names = ", ".join(part.name for part in fields(kind))
        raise InvalidInput(field, value, f"give an object with {names}")
    return value


def _liner(value: Any) -> LinerConstants:
    try:
        return LinerConstants.from_dict(_object("", value, LinerConstants))
    except InvalidInput as error:
        raise error.under("liner") from None


def _casing(value: Any, info: ValidationInfo) -> CasingConstants:
    given = _object("casing", value, CasingConstants)
    check_length("casing.clearance_m", given.get("clearance_m"), settings_of(info).max_tip_nodes)
    try:
        return CasingConstants.from_dict(given)
    except InvalidInput as error:
        raise error.under("casing") from None


def _friction(value: Any) -> Friction | None:
    if value is None:
        return None
    if not isinstance(value, dict) or value.keys() != {"coefficient", "rotation"}:
        raise InvalidInput("friction", value, "give an object with coefficient and rotation (1 or -1)")
    return Friction(**value)


class SimulationQuestion(BaseModel):
    """A blade that rubs its liner in time: at one speed for its response, at many for the maps."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

    blade: Annotated[Blade, PlainValidator(the_blade), WithJsonSchema(BLADE)]
    speed_hz: Annotated[
        tuple[float, ...],
        PlainValidator(_speeds),
        WithJsonSchema({**SPEEDS, "description": "Rising rotor speeds in Hz (revolutions per second)."}),
    ]
    nodes: Annotated[tuple[str, ...] | None, PlainValidator(_nodes), WithJsonSchema(NODES)] = None
    revolutions: int = Field(USUAL_REVOLUTIONS, ge=1, le=1_000_000, strict=True, description="At each speed.")
    liner: Annotated[LinerConstants, PlainValidator(_liner), WithJsonSchema(LINER)] = LinerConstants()
    casing: Annotated[CasingConstants, PlainValidator(_casing), WithJsonSchema(CASING)] = CasingConstants()
    friction: Annotated[Friction | None, PlainValidator(_friction), WithJsonSchema(FRICTION)] = None
    cells: int = Field(USUAL_CELLS, ge=4, le=1_000_000, strict=True, description="Of the circumference.")
    steps_per_cell: int | None = Field(
        None, ge=1, le=100_000, strict=True, description="Left out: as few as the modes allow."
    )
    name: str | None = Field(None, description="In lists.")
    priority: int = Field(
        USUAL_PRIORITY, ge=FIRST_PRIORITY, le=LAST_PRIORITY, description="1 is first.", strict=True
    )
    _order: SimulationOrder = PrivateAttr()

    @classmethod
    def read(cls, data: Any, settings: Settings) -> Self:
        """The question in a parsed body.

        Raises
        ------
        InvalidInput, TooLarge
            For the first field that cannot be used.
        """
        return read_question(cls, data, settings)

    @property
    def order(self) -> SimulationOrder:
        """What is to be simulated."""
        return self._order

    @model_validator(mode="after")
    def _that_can_be_simulated(self, info: ValidationInfo) -> Self:
        settings = settings_of(info)
        check_job_name(self.name, settings.max_name_length)
        self._order = SimulationOrder(
            self.blade,
            self.speed_hz,
            self.blade.tip_nodes[:1] if self.nodes is None else self.nodes,
            self.revolutions,
            self.liner,
            self.casing,
            self.friction,
            self.cells,
            self.steps_per_cell,
        )
        check_size(self._order, settings)
        check_reachable(self._order, settings)
        return self


SIMULATION_EXAMPLE: Json = {
    "name": "leading edge",
    "blade": POINTS_EXAMPLE["blade"],
    "speed_hz": [95.0, 97.5, 100.0],
    "nodes": ["LE"],
    "revolutions": 10,
    "liner": {"ke": 1e4},
    "casing": {"clearance_m": 1e-4, "ovalisation_m": 2e-4, "lobes": 2},
    "cells": 2000,
}

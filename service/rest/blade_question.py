"""What ``POST /v1/blades`` is asked: a profile to be built, or modal data to be checked."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    PlainValidator,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)

from sdm_core.blade import Blade
from sdm_core.blade.profile import SCHEMA, BladeProfile, profile_from_dict
from sdm_core.blade.profile.shape_change import ShapeChange
from sdm_core.errors import InvalidInput
from service.field_values import nearest
from service.rest.profile_schema import PROFILE
from service.rest.question_schemas import BLADE
from service.rest.questions import read_question, settings_of, the_blade
from service.settings import Settings
from service.sizes import TooLarge, check_length

Json = dict[str, Any]


def _profile(value: Any, info: ValidationInfo) -> BladeProfile:
    settings = settings_of(info)
    if not isinstance(value, dict):
        raise InvalidInput("profile", value, f"give an object with schema {SCHEMA!r}")
    check_length("profile.name", value.get("name"), settings.max_name_length, "shorten it")
    try:
        profile = profile_from_dict(value)
    except InvalidInput as error:
        raise error.under("profile") from None
    nodes = profile.subdivision.node_count
    if nodes > settings.max_mesh_nodes:
        raise TooLarge(
            "profile.mesh",
            f"{nodes:,} nodes",
            f"give fewer elements, for at most {settings.max_mesh_nodes:,} nodes, or build it with "
            "`rubscreen blade build`",
        )
    return profile


def _shape_change(value: Any) -> ShapeChange | None:
    if value is None:
        return None
    names = list(ShapeChange.nominal())
    if not isinstance(value, dict):
        raise InvalidInput("shape_change", value, f"give an object with {', '.join(names)}, each if wanted")
    for name in value:
        if name not in names:
            meant = nearest(name, names)
            instead = "leave it out" if meant is None else f"leave it out, or give {meant}"
            raise InvalidInput(
                f"shape_change.{name}", value[name], f"{instead}: there are {', '.join(names)}"
            )
    try:
        return ShapeChange.from_mapping(value)
    except InvalidInput as error:
        raise error.under("shape_change") from None


def _degrees(what: str) -> Json:
    return {"type": "number", "minimum": -30, "maximum": 30, "default": 0, "description": f"{what}, degrees."}


def _times(what: str) -> Json:
    return {"type": "number", "minimum": 0.2, "maximum": 5, "default": 1, "description": f"{what}, a factor."}


SHAPE_CHANGE: Json = {
    "oneOf": [
        {
            "type": "object",
            "additionalProperties": False,
            "properties": {
                "lean_deg": _degrees("Tilt of the stacking line about the root towards the rotation"),
                "sweep_deg": _degrees("Tilt of the stacking line about the root downstream"),
                "stagger_deg": _degrees("Turn of each section about its centroid"),
                "thickness": _times("Thickness of every section"),
                "chord": _times("Chord of every section at the same thickness"),
            },
        },
        {"type": "null"},
    ],
    "description": "Of a profile, before it is built: every section changed alike.",
}


class BladeQuestion(BaseModel):
    """Either a profile, which is built, or modal data, which are checked."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

    profile: Annotated[BladeProfile | None, PlainValidator(_profile), WithJsonSchema(PROFILE)] = None
    blade: Annotated[Blade | None, PlainValidator(the_blade), WithJsonSchema(BLADE)] = None
    verify: bool = True
    shape_change: Annotated[
        ShapeChange | None, PlainValidator(_shape_change), WithJsonSchema(SHAPE_CHANGE)
    ] = None

    @property
    def shape(self) -> BladeProfile | None:
        """The profile as it is to be built; None where modal data were given."""
        if self.profile is None or self.shape_change is None:
            return self.profile
        return self.shape_change.of_profile(self.profile)

    @classmethod
    def read(cls, data: Any, settings: Settings) -> Self:
        """The question in a parsed body.

        Raises
        ------
        InvalidInput
            For the first field that cannot be used.
        TooLarge
            When the mesh is over the limit of `settings`.
        """
        if isinstance(data, dict) and data.get("schema") == SCHEMA:
            raise InvalidInput("body", "a bare profile", 'wrap it: {"profile": ...}')
        return read_question(cls, data, settings)

    @model_validator(mode="after")
    def _one_of_the_two(self) -> Self:
        if (self.profile is None) == (self.blade is None):
            found = "neither" if self.profile is None else "both"
            raise InvalidInput("profile, blade", found, "give a profile to build, or modal data to check")
        if self.shape_change is not None and self.profile is None:
            raise InvalidInput(
                "shape_change", "with modal data", "give it with a profile: modal data have none"
            )
        return self

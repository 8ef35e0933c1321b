"""What a client asks: the bodies of the POST requests, parsed into the core's own objects."""

from __future__ import annotations

import unicodedata
from abc import ABC, abstractmethod
from typing import Annotated, Any, Self, TypeVar

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    PlainValidator,
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)

from sdm_core.blade import SCHEMA, Blade
from sdm_core.blade_sensitivity import check_differentiable
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.validation import KE_LIMIT, number, speeds, stiffnesses
from service.field_values import nearest, remedy_for
from service.jobs.job import LONGEST_NAME
from service.rest.known_blades import KnownBlades
from service.rest.question_schemas import (
    ALPHA,
    BLADE,
    CONTACT,
    KE,
    KE_MAX,
    MAP_FIELDS_SCHEMA,
    POLICY,
    SPEEDS,
)
from service.rest.replies import MAP_FIELDS
from service.settings import Settings
from service.sizes import TooLarge, check_blade_size, check_length, check_reach
from training.answers import POLICIES

Asked = TypeVar("Asked", bound=BaseModel)
_LONGEST_NAME = 100  # characters of a field's name, in a refusal

# A design tool asks about one blade again and again: reading it costs as much as answering does.
_KNOWN_BLADES = KnownBlades()


def the_blade(value: Any, info: ValidationInfo) -> Blade:
    """A blade within the limits, its errors named from `blade` on."""
    if not isinstance(value, dict):
        raise InvalidInput("blade", value, f"give an object with schema {SCHEMA!r}")
    check_blade_size(value, settings_of(info))
    try:
        return _KNOWN_BLADES.blade(value)
    except InvalidInput as error:
        raise error.under("blade") from None


def the_contact(value: Any, info: ValidationInfo) -> ContactConfiguration:
    """A contact within the limits."""
    if isinstance(value, dict):
        check_length(
            "contact.weights", value.get("weights"), settings_of(info).max_tip_nodes, "name fewer nodes"
        )
        check_length("contact.arcs", value.get("arcs"), settings_of(info).max_arcs, "join arcs")
    return ContactConfiguration.from_dict(value)


def _speeds(value: Any, info: ValidationInfo) -> np.ndarray:
    check_length("speed_hz", value, settings_of(info).max_points)
    return speeds("speed_hz", value)


def _boundary_speeds(value: Any, info: ValidationInfo) -> np.ndarray:
    check_length("speed_hz", value, settings_of(info).max_boundary_speeds)
    return speeds("speed_hz", value)


def _ke(value: Any, info: ValidationInfo) -> np.ndarray:
    check_length("ke", value, settings_of(info).max_points)
    return stiffnesses("ke", value)


def the_ke_max(value: Any) -> float:
    """The largest stiffness to look at, N/m."""
    return number("ke_max", value, 0.0, KE_LIMIT, "N/m", open_low=True)


def checked_policy(value: Any) -> str:
    """Who may answer."""
    if not isinstance(value, str) or value not in POLICIES:
        raise InvalidInput("policy", value, f"give one of {', '.join(POLICIES)}")
    return value


def checked_alpha(value: Any) -> float | None:
    """The rate that answers must keep; None leaves it to the model."""
    return None if value is None else number("alpha", value, 0.0, 1.0, "", open_low=True)


def settings_of(info: ValidationInfo) -> Settings:
    """The service's settings, given to pydantic as context."""
    assert isinstance(info.context, Settings)
    return info.context


SpeedArray = Annotated[np.ndarray, PlainValidator(_speeds), WithJsonSchema(SPEEDS)]
BoundarySpeedArray = Annotated[np.ndarray, PlainValidator(_boundary_speeds), WithJsonSchema(SPEEDS)]
KeArray = Annotated[np.ndarray, PlainValidator(_ke), WithJsonSchema(KE)]


class Question(BaseModel, ABC):
    """What every question holds: a blade, its contact, rotor speeds, who may answer, how surely."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

    blade: Annotated[Blade, PlainValidator(the_blade), WithJsonSchema(BLADE)]
    contact: Annotated[ContactConfiguration, PlainValidator(the_contact), WithJsonSchema(CONTACT)]
    speed_hz: SpeedArray
    policy: Annotated[str, PlainValidator(checked_policy), WithJsonSchema(POLICY)] = "auto"
    alpha: Annotated[float | None, PlainValidator(checked_alpha), WithJsonSchema(ALPHA)] = None

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

    @model_validator(mode="after")
    def _the_core_can_reach_it(self, info: ValidationInfo) -> Self:
        field, ke = self._largest_ke()
        check_reach(self.blade, self.contact, self.speed_hz, field, ke, settings_of(info))
        return self

    @abstractmethod
    def _largest_ke(self) -> tuple[str, float]:
        """The largest stiffness asked about, and its field."""


class KeQuestion(Question):
    """A question about given stiffnesses."""

    ke: KeArray

    def _largest_ke(self) -> tuple[str, float]:
        i = int(np.argmax(self.ke))
        return f"ke[{i}]", float(self.ke[i])


class PointsQuestion(KeQuestion):
    """Is the blade stable at these points? Entry i of `speed_hz` goes with entry i of `ke`."""

    @model_validator(mode="after")
    def _as_many_speeds_as_stiffnesses(self) -> Self:
        if len(self.ke) != len(self.speed_hz):
            count = len(self.speed_hz)
            raise InvalidInput("ke", f"{len(self.ke)} numbers", f"give one a speed: {count}, as in speed_hz")
        return self


class BoundaryQuestion(Question):
    """From which stiffness on is the blade unstable at these speeds?"""

    speed_hz: BoundarySpeedArray
    ke_max: Annotated[float, PlainValidator(the_ke_max), WithJsonSchema(KE_MAX)]

    def _largest_ke(self) -> tuple[str, float]:
        return "ke_max", self.ke_max


class SensitivitiesQuestion(BoundaryQuestion):
    """What moves the boundary at these speeds?"""

    @model_validator(mode="after")
    def _the_core_can_differentiate_it(self, info: ValidationInfo) -> Self:
        check_differentiable(self.contact)
        modes, nodes = self.blade.mode_count, len(self.blade.tip_nodes)
        parameters = modes * (2 + nodes) + nodes + 2 + 2 * len(self.contact.arcs or ())
        derivatives, most = len(self.speed_hz) * parameters, settings_of(info).max_points
        if derivatives > most:
            found = f"{len(self.speed_hz)} speeds x {parameters} parameters = {derivatives} derivatives"
            raise TooLarge("speed_hz", found, f"give at most {most} derivatives: split the request by speed")
        return self


def _fields(value: Any) -> tuple[str, ...]:
    if value is None:
        return MAP_FIELDS
    if not isinstance(value, list) or not value:
        raise InvalidInput("fields", value, f"give a list of {', '.join(MAP_FIELDS)}, or leave it out")
    for i, name in enumerate(value):
        if not isinstance(name, str) or name not in MAP_FIELDS or name in value[:i]:
            raise InvalidInput(f"fields[{i}]", name, f"give each of {', '.join(MAP_FIELDS)} once at most")
    return tuple(value)


class MapQuestion(KeQuestion):
    """Where in the plane of speed and stiffness is the blade stable?"""

    fields: Annotated[tuple[str, ...], PlainValidator(_fields), WithJsonSchema(MAP_FIELDS_SCHEMA)] = (
        MAP_FIELDS
    )

    @model_validator(mode="after")
    def _not_too_many_points(self, info: ValidationInfo) -> Self:
        points, most = len(self.speed_hz) * len(self.ke), settings_of(info).max_points
        if points > most:
            found = f"{len(self.speed_hz)} speeds x {len(self.ke)} stiffnesses = {points} points"
            raise TooLarge("speed_hz x ke", found, f"give at most {most} points: split the map by speed")
        return self

    def check_chartable(self) -> None:
        """Raise `InvalidInput` when an axis has one value only, or does not rise."""
        for field, values in (("speed_hz", self.speed_hz), ("ke", self.ke)):
            if len(values) < 2 or (np.diff(values) <= 0).any():
                remedy = "give two or more rising values for a chart, or accept application/json"
                raise InvalidInput(field, values.tolist(), remedy)


def check_job_name(name: str | None, most: int = LONGEST_NAME) -> None:
    """Refuse what no database holds as the name of a job, or no list shows.

    Raises
    ------
    InvalidInput, TooLarge
    """
    if name is None:
        return
    check_length("name", name, min(most, LONGEST_NAME), "shorten it")
    if any(unicodedata.category(character) in ("Cc", "Cs") for character in name):
        raise InvalidInput("name", name, "leave out control characters")


def read_question(kind: type[Asked], data: Any, settings: Settings) -> Asked:
    """A parsed body as a question of this kind; the first field that cannot be used is named.

    Raises
    ------
    InvalidInput, TooLarge
        As the core would have said it.
    """
    if not isinstance(data, dict):
        raise InvalidInput("body", data, f"send a JSON object with {', '.join(kind.model_fields)}")
    try:
        return kind.model_validate(data, context=settings)
    except ValidationError as error:
        raise _first_fault(error, kind) from None


def _first_fault(error: ValidationError, kind: type[BaseModel]) -> InvalidInput:
    """The first of pydantic's findings as the core would have said it."""
    fault = error.errors(include_url=False)[0]
    cause = fault.get("ctx", {}).get("error")
    if isinstance(cause, InvalidInput):
        return cause
    field, known = str(fault["loc"][0])[:_LONGEST_NAME], ", ".join(kind.model_fields)
    if fault["type"] == "missing":
        return InvalidInput(field, "missing", f"give {field}; the fields are {known}")
    if fault["type"] == "extra_forbidden":
        meant = nearest(field, list(kind.model_fields))
        instead = "leave it out" if meant is None else f"leave it out, or give {meant}"
        return InvalidInput(field, fault["input"], f"{instead}: the fields are {known}")
    return InvalidInput(field, fault["input"], remedy_for(kind.model_fields[field]))

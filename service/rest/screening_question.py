"""What ``POST /v1/screenings`` is asked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    PlainValidator,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)

from sdm_core.blade import EXAMPLES, blade_to_dict, example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.interruption import checkpoint
from sdm_core.validation import KE_LIMIT, SPEED_LIMITS_HZ, number
from service.jobs.errors import NoSuchUpload
from service.jobs.job import FIRST_PRIORITY, LAST_PRIORITY, USUAL_PRIORITY
from service.jobs.screening.request import Criteria
from service.jobs.uploads import Uploads
from service.rest.question_schemas import ALPHA, BLADE, CONTACT, KE_MAX, POLICY
from service.rest.questions import (
    check_job_name,
    checked_alpha,
    checked_policy,
    read_question,
    settings_of,
    the_ke_max,
)
from service.screening.screen import KE_MAX as USUAL_KE_MAX
from service.settings import Settings
from service.sizes import TooLarge, check_length

Json = dict[str, Any]
_RATIO_LIMITS = (1e-4, 1e3)
_FEWEST, _MOST = 2, 1000


def _row(item: Json, **more: Any) -> Json:
    return {"type": "array", "items": item, **more}


BLADES: Json = _row(
    {
        "oneOf": [
            {**BLADE, "title": "Blade file"},
            {
                "type": "object",
                "title": "Profile",
                "required": ["schema"],
                "properties": {"schema": {"const": "rubscreen/profile/1"}},
            },
            {
                "type": "object",
                "title": "Upload",
                "required": ["upload"],
                "additionalProperties": False,
                "properties": {"upload": {"type": "string", "description": "Id of POST /v1/uploads."}},
            },
            {
                "type": "object",
                "title": "Example",
                "required": ["example"],
                "additionalProperties": False,
                "properties": {"example": {"enum": list(EXAMPLES)}},
            },
        ]
    },
    minItems=1,
    description="Blade files, profiles to be built, the blades of an upload, shipped examples; mixed.",
)
_named_contact = {
    **CONTACT,
    "properties": {**CONTACT["properties"], "name": {"type": "string", "description": "In tables."}},
}
CONTACTS: Json = {
    "oneOf": [_row(_named_contact, minItems=1), {"type": "null"}],
    "description": "Left out: leading edge, trailing edge, and both.",
}
_RANGE: Json = {
    "oneOf": [
        _row({"type": "number", "exclusiveMinimum": 0}, minItems=2, maxItems=2),
        {"type": "null"},
    ]
}


def _contacts(value: Any, info: ValidationInfo) -> Mapping[str, ContactConfiguration] | None:
    if value is None:
        return None
    settings = settings_of(info)
    if not isinstance(value, list) or not value:
        raise InvalidInput("contacts", value, "give a list of one or more contacts, or leave it out")
    check_length("contacts", value, settings.max_job_contacts)
    named: dict[str, ContactConfiguration] = {}
    for i, entry in enumerate(value):
        field = f"contacts[{i}]"
        if not isinstance(entry, dict):
            raise InvalidInput(field, entry, "give an object with weights, and perhaps name and arcs")
        check_length(f"{field}.weights", entry.get("weights"), settings.max_tip_nodes, "name fewer nodes")
        check_length(f"{field}.arcs", entry.get("arcs"), settings.max_arcs, "join arcs")
        given = {key: item for key, item in entry.items() if key != "name"}
        try:
            contact = ContactConfiguration.from_dict(given)
        except InvalidInput as error:
            named_field = error.field.removeprefix("contact").removeprefix(".")
            raise InvalidInput(f"{field}.{named_field}".rstrip("."), error.value, error.remedy) from None
        name = entry.get("name", "+".join(contact.weights))
        if not isinstance(name, str) or not name.strip():
            raise InvalidInput(f"{field}.name", name, "give a name, or leave it out")
        check_length(f"{field}.name", name, settings.max_name_length, "shorten it")
        if name in named:
            raise InvalidInput(f"{field}.name", name, "give each contact a name of its own")
        named[name] = contact
    return named


def _range(low: float, high: float, unit: str) -> Any:
    def read(value: Any, info: ValidationInfo) -> tuple[float, float] | None:
        field = str(info.field_name)
        if value is None:
            return None
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise InvalidInput(field, value, "give [low, high]")
        first, last = (number(f"{field}[{i}]", end, low, high, unit) for i, end in enumerate(value))
        if first >= last:
            raise InvalidInput(field, [first, last], "give the lower speed first")
        return first, last

    return read


def _ke_liner(value: Any) -> float | None:
    return None if value is None else number("ke_liner", value, 0.0, KE_LIMIT, "N/m", open_low=True)


def _map_shape(value: Any, info: ValidationInfo) -> tuple[int, int] | None:
    if value is None:
        return None
    whole = isinstance(value, list) and len(value) == 2
    if not whole or not all(isinstance(n, int) and _FEWEST <= n <= _MOST for n in value):
        remedy = f"give [speeds, stiffnesses], {_FEWEST} to {_MOST} each"
        raise InvalidInput("map_shape", value, remedy)
    most = settings_of(info).max_points
    if value[0] * value[1] > most:
        raise TooLarge("map_shape", f"{value[0]} x {value[1]}", f"give at most {most} points")
    return value[0], value[1]


def _criteria(value: Any) -> Criteria:
    if value is None:
        return Criteria()
    names = list(Criteria().to_dict())
    if not isinstance(value, dict):
        raise InvalidInput("criteria", value, f"give an object with {', '.join(names)}")
    limits = {"least_ke": (0.0, KE_LIMIT), "least_margin": (-1.0, 1e9), "most_unstable_share": (0.0, 1.0)}
    read: dict[str, float] = {}
    for name, bound in value.items():
        if name not in limits:
            raise InvalidInput(f"criteria.{name}", bound, f"leave it out: there are {', '.join(names)}")
        if bound is not None:
            read[name] = number(f"criteria.{name}", bound, *limits[name], "")
    return Criteria(**read)


def _blades(value: Any) -> list[Any]:
    if not isinstance(value, list) or not value:
        raise InvalidInput("blades", value, "give a list of one or more blades")
    return value


_CRITERIA: Json = {
    "oneOf": [
        {
            "type": "object",
            "additionalProperties": False,
            "properties": {
                "least_ke": {"type": ["number", "null"], "minimum": 0, "description": "N/m."},
                "least_margin": {
                    "type": ["number", "null"],
                    "minimum": -1,
                    "description": "Of the smallest destabilising K_e over ke_liner, minus 1.",
                },
                "most_unstable_share": {"type": ["number", "null"], "minimum": 0, "maximum": 1},
            },
        },
        {"type": "null"},
    ],
    "description": "What a blade under a contact has to meet; each result says whether it does.",
}
_SHAPE: Json = {
    "oneOf": [
        _row({"type": "integer", "minimum": _FEWEST, "maximum": _MOST}, minItems=2, maxItems=2),
        {"type": "null"},
    ],
    "description": "Speeds and stiffnesses of each map. Left out: [100, 100].",
}


class ScreeningQuestion(BaseModel):
    """A batch: blades × contacts, over rotor speeds and stiffnesses."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

    blades: Annotated[list[Any], PlainValidator(_blades), WithJsonSchema(BLADES)]
    contacts: Annotated[
        Mapping[str, ContactConfiguration] | None, PlainValidator(_contacts), WithJsonSchema(CONTACTS)
    ] = None
    speed_range_hz: Annotated[
        tuple[float, float] | None,
        PlainValidator(_range(*SPEED_LIMITS_HZ, "Hz")),
        WithJsonSchema({**_RANGE, "description": "Rotor speeds [low, high]. Left out: each blade's own."}),
    ] = None
    speed_range_ratio: Annotated[
        tuple[float, float] | None,
        PlainValidator(_range(*_RATIO_LIMITS, "")),
        WithJsonSchema({**_RANGE, "description": "The same over each blade's first frequency at rest."}),
    ] = None
    ke_max: Annotated[float, PlainValidator(the_ke_max), WithJsonSchema(KE_MAX)] = USUAL_KE_MAX
    ke_liner: Annotated[
        float | None,
        PlainValidator(_ke_liner),
        WithJsonSchema(
            {"type": ["number", "null"], "exclusiveMinimum": 0, "description": "K_e of the liner, N/m."}
        ),
    ] = None
    criteria: Annotated[Criteria, PlainValidator(_criteria), WithJsonSchema(_CRITERIA)] = Criteria()
    map_shape: Annotated[tuple[int, int] | None, PlainValidator(_map_shape), WithJsonSchema(_SHAPE)] = None
    policy: Annotated[str, PlainValidator(checked_policy), WithJsonSchema(POLICY)] = "auto"
    alpha: Annotated[float | None, PlainValidator(checked_alpha), WithJsonSchema(ALPHA)] = None
    bad_blades: Literal["refuse", "skip"] = Field(
        "refuse",
        description="A blade that cannot be screened: refuse the request, or skip and report it.",
    )
    name: str | None = Field(None, description="In lists and reports.")
    priority: int = Field(
        USUAL_PRIORITY, ge=FIRST_PRIORITY, le=LAST_PRIORITY, description="1 is first.", strict=True
    )

    @classmethod
    def read(cls, data: Any, settings: Settings) -> Self:
        """The question in a parsed body.

        Raises
        ------
        InvalidInput, TooLarge
            For the first field that cannot be used.
        """
        return read_question(cls, data, settings)

    @model_validator(mode="after")
    def _consistent(self, info: ValidationInfo) -> Self:
        if self.speed_range_hz is not None and self.speed_range_ratio is not None:
            found = "both"
            raise InvalidInput("speed_range_hz, speed_range_ratio", found, "give one of the two, or neither")
        if self.ke_liner is not None and self.ke_liner > self.ke_max:
            raise InvalidInput("ke_liner", self.ke_liner, f"give at most ke_max, {self.ke_max:g} N/m")
        if self.criteria.least_margin is not None and self.ke_liner is None:
            raise InvalidInput("criteria.least_margin", self.criteria.least_margin, "give ke_liner too")
        check_job_name(self.name, settings_of(info).max_name_length)
        return self

    def documents(self, uploads: Uploads, owner: str | None, settings: Settings) -> Iterator[tuple[str, Any]]:
        """(source, document) of every blade, those of uploads and examples among them.

        Raises
        ------
        InvalidInput, NoSuchUpload, UploadTooLarge
            Naming the entry of `blades`.
        """
        seen: set[str] = set()
        for i, entry in enumerate(self.blades):
            field = f"blades[{i}]"
            checkpoint()
            if isinstance(entry, dict) and "upload" in entry:
                try:
                    upload = uploads.get(_alone(entry, "upload", field), owner)
                except NoSuchUpload as error:
                    raise NoSuchUpload(f"{field}.upload", error.value, error.remedy) from None
                if upload.id in seen:
                    raise InvalidInput(f"{field}.upload", upload.id, "name each upload once")
                seen.add(upload.id)
                yield from uploads.documents(upload, settings.max_job_blades)
            elif isinstance(entry, dict) and "example" in entry:
                name = _alone(entry, "example", field)
                if name not in EXAMPLES:
                    raise InvalidInput(f"{field}.example", name, f"give one of {', '.join(EXAMPLES)}")
                yield field, blade_to_dict(example_blade(name))
            else:
                yield field, entry


def _alone(entry: Mapping[str, Any], key: str, field: str) -> str:
    if len(entry) > 1 or not isinstance(entry[key], str):
        raise InvalidInput(field, entry, f'give {{"{key}": "..."}} and nothing else in it')
    return entry[key]


SCREENING_EXAMPLE: Json = {
    "name": "first stage",
    "blades": [{"example": "nasa_rotor_37"}, {"example": "generic_compressor_blade"}],
    "contacts": [{"name": "LE", "weights": {"LE": 1.0}}, {"name": "TE", "weights": {"TE": 1.0}}],
    "ke_max": 25000.0,
    "ke_liner": 5000.0,
    "criteria": {"least_margin": 0.2},
    "map_shape": [64, 64],
}

"""Whether a blade can be screened as asked: looked at when the job is accepted, and again when it runs."""

from __future__ import annotations

from typing import Any

import numpy as np

from sdm_core.blade import SCHEMA, Blade, blade_from_dict
from sdm_core.blade.profile import SCHEMA as PROFILE_SCHEMA
from sdm_core.blade.profile import profile_from_dict
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import lobe_grid
from service.jobs.screening.blade_lines import BladeLine
from service.jobs.screening.request import ScreeningRequest
from service.settings import Settings
from service.sizes import TooLarge, check_blade_size, check_length, check_reach
from service.speeds import evenly_spaced

# Seconds one blade takes, rotor 37 on one core: what makes chunks alike in length, and no promise.
PERMANENT_S, ARCS_S, SMOOTH_S, PROFILE_S = 0.15, 25.0, 30.0, 3.0
CHUNK_S, MOST_PER_CHUNK = 4.0, 32
# None of them is a field of a blade file or of a profile.
_OF_REQUEST = ("contacts[", "ke_max", "speed_range_")


def limits_of(settings: Settings) -> dict[str, Any]:
    """The limits among the settings, for a worker."""
    return {name: value for name, value in settings.model_dump().items() if name.startswith("max_")}


def check_line(line: BladeLine, request: ScreeningRequest, limits: Settings) -> None:
    """Refuse what is no blade or profile, is too large, or does not fit the request.

    A profile's modes are not known before it is built, so only its shape is looked at.

    Raises
    ------
    InvalidInput, TooLarge, OutOfSpeedRange
        Naming the field within the document, or that of the request (`under_source` tells them apart).
    """
    blade = checked_document(line.document, limits)
    if blade is not None:
        check_fit(blade, request, limits)


def checked_document(document: Any, limits: Settings) -> Blade | None:
    """The blade of a blade file; None for a profile, which has no modes yet.

    Raises
    ------
    InvalidInput, TooLarge
        Naming the field within the document.
    """
    if not isinstance(document, dict):
        raise InvalidInput("", document, f"give an object with schema {SCHEMA!r} or {PROFILE_SCHEMA!r}")
    if document.get("schema") not in (SCHEMA, PROFILE_SCHEMA):
        found = document.get("schema", "missing")
        raise InvalidInput("schema", found, f"give {SCHEMA!r} or {PROFILE_SCHEMA!r}")
    check_length("name", document.get("name"), limits.max_name_length, "shorten it")
    if document["schema"] == SCHEMA:
        try:
            check_blade_size(document, limits)
        except TooLarge as error:
            raise _renamed(error, error.field.removeprefix("blade.")) from None
        return blade_from_dict(document)
    nodes = profile_from_dict(document).subdivision.node_count
    if nodes > limits.max_mesh_nodes:
        remedy = f"give fewer elements, for at most {limits.max_mesh_nodes:,} nodes"
        raise TooLarge("mesh", f"{nodes:,} nodes", remedy)
    return None


def check_fit(blade: Blade, request: ScreeningRequest, limits: Settings) -> None:
    """Refuse a blade that cannot be screened as asked.

    Raises
    ------
    InvalidInput, TooLarge, OutOfSpeedRange
        Naming the field of the request: it is not the blade's fault alone.
    """
    speeds = f"speed_range_{request.speed_unit.lower()}"
    try:
        ends = np.array(request.range_of(blade))
    except InvalidInput as error:
        raise _renamed(error, speeds) from None
    for j, (name, contact) in enumerate(request.contacts_of(blade).items()):
        try:
            contact.weight_vector(blade.tip_nodes)
            check_reach(blade, contact, ends, "ke_max", request.ke_max, limits)
            lobe_grid(blade, contact, evenly_spaced(float(ends[0]), float(ends[1]), 2), request.ke_max)
        except InvalidInput as error:
            whole, _, rest = error.field.partition(".")
            if whole == "contact":
                raise _renamed(error, f"contacts[{j}].{rest}") from None
            if whole == "ke_max":
                remedy = f"{error.remedy}, under contact {name!r}"
                raise type(error)(whole, error.value, remedy) from None
            if whole.startswith("speed"):  # of the two ends one, or the range
                raise _renamed(error, speeds + whole.removeprefix("speed_hz").removeprefix("speed")) from None
            raise _renamed(error, error.field.removeprefix("blade.")) from None


def under_source(error: InvalidInput, source: str) -> InvalidInput:
    """An error of `check_line` as the caller sees it.

    What is wrong in a document stands under its source; what is wrong in the request has its own place, and
    the remedy says for which blade.

    Examples
    --------
    >>> str(under_source(InvalidInput("contacts[1].weights.N9", 1.0, "name a tip node"), "blades[3]"))
    'contacts[1].weights.N9 = 1.0: for blades[3]: name a tip node'
    >>> str(under_source(InvalidInput("damping_ratio", -1.0, "give at least 0"), "blades[3]"))
    'blades[3].damping_ratio = -1.0: give at least 0'
    """
    if not error.field.startswith(_OF_REQUEST):
        return error.under(source)
    return type(error)(error.field, error.value, f"for {source}: {error.remedy}")


def _renamed(error: InvalidInput, field: str) -> InvalidInput:
    return type(error)(field, error.value, error.remedy)


def blades_per_chunk(request: ScreeningRequest, *, profiles: bool) -> int:
    """How many blades make a chunk that takes some seconds."""
    if request.contacts is None:
        seconds = 3 * PERMANENT_S
    else:
        each = [
            SMOOTH_S if contact.smooth else PERMANENT_S if contact.permanent else ARCS_S
            for contact in request.contacts.values()
        ]
        seconds = sum(each)
    seconds += PROFILE_S if profiles else 0.0
    return int(min(max(1, CHUNK_S // seconds), MOST_PER_CHUNK))

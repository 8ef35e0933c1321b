"""Whether a blade can be screened as asked: looked at when the job is accepted, and again when it runs."""

from __future__ import annotations

from typing import Any

from sdm_core.blade import SCHEMA, blade_from_dict
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


def limits_of(settings: Settings) -> dict[str, Any]:
    """The limits among the settings, for a worker."""
    return {name: value for name, value in settings.model_dump().items() if name.startswith("max_")}


def check_line(line: BladeLine, request: ScreeningRequest, limits: Settings) -> None:
    """Refuse what is no blade or profile, is too large, or does not fit the request.

    A profile's modes are not known before it is built, so only its shape is looked at.

    Raises
    ------
    InvalidInput, TooLarge, OutOfSpeedRange
        Naming the field within the document.
    """
    document = line.document
    if not isinstance(document, dict):
        raise InvalidInput("", document, f"give an object with schema {SCHEMA!r} or {PROFILE_SCHEMA!r}")
    if document.get("schema") not in (SCHEMA, PROFILE_SCHEMA):
        found = document.get("schema", "missing")
        raise InvalidInput("schema", found, f"give {SCHEMA!r} or {PROFILE_SCHEMA!r}")
    check_length("name", document.get("name"), limits.max_name_length, "shorten it")
    if line.profile:
        profile = profile_from_dict(document)
        nodes = profile.subdivision.node_count
        if nodes > limits.max_mesh_nodes:
            remedy = f"give fewer elements, for at most {limits.max_mesh_nodes:,} nodes"
            raise TooLarge("mesh", f"{nodes:,} nodes", remedy)
        return
    check_blade_size(document, limits)
    blade = blade_from_dict(document)
    ends, contacts = request.check(blade)
    for contact in contacts:
        check_reach(blade, contact, ends, "ke_max", request.ke_max, limits)
        lobe_grid(blade, contact, evenly_spaced(float(ends[0]), float(ends[1]), 2), request.ke_max)


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

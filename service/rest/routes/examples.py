"""``GET /v1/examples`` and ``/v1/caller``: what a design tool begins with."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter
from pydantic import BaseModel, Field
from starlette.requests import Request

from sdm_core.blade import EXAMPLES, blade_to_dict, example_blade
from sdm_core.blade.profile import EXAMPLE_PROFILES, example_profile_document
from service.rest.access import READ, the_caller
from service.rest.known_query import KNOWN_QUERY
from service.rest.openapi import problems
from service.roles import Role

router = APIRouter(prefix="/v1", tags=["examples"], dependencies=[READ, KNOWN_QUERY])


class Examples(BaseModel):
    """Shipped inputs, whole."""

    blades: dict[str, dict[str, Any]] = Field(description="Blade files (rubscreen/blade/1), by name.")
    profiles: dict[str, dict[str, Any]] = Field(description="Profiles (rubscreen/profile/1), by name.")


class CallerReply(BaseModel):
    """Who asks."""

    name: str
    role: Role = Field(description="read asks and looks, submit also starts jobs, admin exchanges models.")
    key_id: str | None = Field(description="null where the service asks for no keys.")


@router.get("/examples", responses=problems(500))
def examples(request: Request) -> Examples:
    """Blade files and profiles that come with the service."""
    return Examples(
        blades={name: blade_to_dict(example_blade(name)) for name in EXAMPLES},
        profiles={name: example_profile_document(name) for name in EXAMPLE_PROFILES},
    )


@router.get("/caller", responses=problems(500))
async def who_asks(request: Request) -> CallerReply:
    """The key that came with the request, and what it may do."""
    caller = the_caller(request)
    return CallerReply(name=caller.name, role=caller.role, key_id=caller.key_id)

"""What endpoints ask of a request."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends
from starlette.requests import Request

from service.rest.body import whole_body
from service.rest.desk import Desk


def the_desk(request: Request) -> Desk:
    """The state of the service."""
    desk = request.state.desk
    assert isinstance(desk, Desk)
    return desk


async def the_body(request: Request) -> bytes:
    """The body, within the limits; refused unread when nobody has time for it."""
    desk = the_desk(request)
    desk.work.check_room()
    return await whole_body(request, desk.settings)


TheBody = Annotated[bytes, Depends(the_body)]

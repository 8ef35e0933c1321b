"""What endpoints ask of a request."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import Depends
from starlette.requests import Request

from service.rest.body import parsed, whole_body
from service.rest.desk import Desk
from service.rest.forms.media_types import ARROW, JSON, NPZ, body_form
from service.rest.forms.npz_question import npz_question
from service.settings import Settings


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


async def the_json(request: Request) -> bytes:
    """As `the_body`, refused unread when it is said to be anything but JSON."""
    body_form(request.headers.get("content-type"), (JSON,))
    return await the_body(request)


@dataclass(frozen=True)
class Asked:
    """The body of a question, and the media type it is to be read as."""

    form: str
    content: bytes

    def parsed(self, settings: Settings) -> Any:
        """The question as the JSON form has it, its long arrays perhaps as arrays of numbers.

        Raises
        ------
        InvalidInput, TooLarge
            As the readers of the forms.
        """
        if self.form == NPZ:
            return npz_question(self.content, settings)
        if self.form == ARROW:
            # Here, not above: a service that is never sent Arrow need not load it.
            from service.rest.forms.arrow_question import arrow_question

            return arrow_question(self.content, settings)
        return parsed(self.content)


async def _json_or_npz(request: Request) -> Asked:
    form = body_form(request.headers.get("content-type"), (JSON, NPZ))
    return Asked(form, await the_body(request))


async def _json_npz_or_arrow(request: Request) -> Asked:
    form = body_form(request.headers.get("content-type"), (JSON, NPZ, ARROW))
    return Asked(form, await the_body(request))


TheBody = Annotated[bytes, Depends(the_body)]
"""Of any form; the route looks at its type itself."""
TheJson = Annotated[bytes, Depends(the_json)]
TheQuestion = Annotated[Asked, Depends(_json_npz_or_arrow)]
TheGrid = Annotated[Asked, Depends(_json_or_npz)]
"""A question whose arrays differ in length, which a table cannot hold."""

"""What goes over the wire and comes back, without any input or output: both clients send these."""

from __future__ import annotations

import os
import uuid
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import httpx
import orjson

from sdm_core.errors import InvalidInput
from sdm_core.version import __version__
from service.client.file_body import FileBody
from service.client.problem import ServiceProblem
from service.rest import replies
from service.rest.forms.media_types import JSON
from service.service_url import checked_service_url

Json = dict[str, Any]
T = TypeVar("T")
KEY_VARIABLE = "RUBSCREEN_API_KEY"
EVENTS = "text/event-stream"
# Streams that one client listens to: each counts among the requests its key may have at the same time, 32 by
# default. Further jobs are asked for every few seconds.
MOST_STREAMS = 8
_CONNECT_S = 20.0


@dataclass(frozen=True)
class Message:
    """A request.

    Attributes
    ----------
    content
        The body; a file is read while it is sent, and anew each time it is.
    form, accept
        Media types of the body and of the answer.
    headers
        Further ones.
    repeatable
        Whether sending it again does no harm where it may have been acted on already.
    """

    method: str
    path: str
    content: bytes | FileBody | None = None
    form: str = JSON
    accept: str = JSON
    headers: Mapping[str, str] = field(default_factory=dict)
    repeatable: bool = True

    @classmethod
    def get(cls, path: str) -> Message:
        """A question without a body."""
        return cls("GET", path)

    @classmethod
    def post(cls, path: str, document: Json) -> Message:
        """A question with a body of JSON; asking it twice does no harm."""
        return cls("POST", path, replies.to_json(document))

    @classmethod
    def order(cls, path: str, document: Json, key: str | None = None) -> Message:
        """A body that is to be acted on once: its Idempotency-Key stays the same however often it is sent."""
        return cls("POST", path, replies.to_json(document), headers=once(key))


def once(key: str | None) -> dict[str, str]:
    """The header that makes an order sent twice one job; None makes a key.

    Raises
    ------
    InvalidInput
        For a key that no header can carry.
    """
    key = str(uuid.uuid4()) if key is None else key
    if not (key.isascii() and key.isprintable() and key.strip() == key != ""):
        raise InvalidInput("idempotency_key", key, "give 1 to 200 visible ASCII characters, e.g. a UUID")
    return {"Idempotency-Key": key}


@dataclass(frozen=True)
class Listening:
    """A stream of server-sent events, listened to until it ends.

    Attributes
    ----------
    hear
        Told the data of each event; says whether that is enough.
    silent_s
        Time without a byte after which the stream is taken for dead, s.
    """

    path: str
    hear: Callable[[str], bool]
    silent_s: float


@dataclass(frozen=True)
class Pause:
    """Time in which nothing is sent, s."""

    seconds: float


Step = Message | Listening | Pause
Conversation = Generator[Step, Any, T]
"""Yields steps; is sent the response to a message, or thrown a `ServiceProblem`; returns the outcome."""


@dataclass(frozen=True)
class Address:
    """Where the service is, and the key to it.

    Raises
    ------
    InvalidInput
        For an address that no service can have, or a key that no header can carry; the key is not repeated.
    """

    base_url: str
    key: str | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.key is not None and not (self.key.isascii() and self.key.isprintable()):
            remedy = "give the key as `rubscreen keys create` printed it"
            raise InvalidInput("key", "characters that no key has", remedy)

    @classmethod
    def of(cls, base_url: str, key: str | None) -> Address:
        """With the key of the environment (``RUBSCREEN_API_KEY``) where none is given.

        The line break of the file a key came from is left out.
        """
        given = os.environ.get(KEY_VARIABLE) if key is None else key
        return cls(checked_service_url(base_url), (given or "").strip() or None)

    def listening(self, step: Listening) -> Json:
        """Arguments of the HTTP client's `stream`."""
        asked = self.request(Message("GET", step.path, accept=EVENTS))
        return asked | {"timeout": httpx.Timeout(_CONNECT_S, read=step.silent_s)}

    def request(self, message: Message, *, awaited: bool = False) -> Json:
        """Arguments of the HTTP client's `request`; `awaited` for the asynchronous one."""
        headers = {
            "Accept": message.accept,
            "User-Agent": f"rubscreen/{__version__}",
            **message.headers,
        }
        if message.content is not None:
            headers["Content-Type"] = message.form
        if self.key is not None:
            headers["Authorization"] = f"Bearer {self.key}"
        content: Any = message.content
        if isinstance(content, FileBody):
            headers["Content-Length"] = str(content.size)
            content = content.parts_awaited() if awaited else content.parts()
        return {
            "method": message.method,
            "url": self.base_url + message.path,
            "content": content,
            "headers": headers,
        }


def checked(response: httpx.Response) -> httpx.Response:
    """A success, as it came.

    Raises
    ------
    ServiceProblem
        For anything else.
    """
    if response.is_success:
        return response
    raise ServiceProblem.of(response)


def document_of(response: httpx.Response) -> Any:
    """The JSON of an answer.

    Raises
    ------
    ServiceProblem
        When it is none: then it is not the service's.
    """
    try:
        return orjson.loads(response.content)
    except ValueError:
        raise ServiceProblem.foreign(response) from None

"""What goes over the wire and comes back, without any input or output: both clients send these."""

from __future__ import annotations

import os
import uuid
from collections.abc import Generator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import httpx
import orjson

from sdm_core.errors import InvalidInput
from sdm_core.version import __version__
from service.client.problem import ServiceProblem
from service.rest import replies
from service.rest.forms.media_types import JSON

Json = dict[str, Any]
T = TypeVar("T")
KEY_VARIABLE = "RUBSCREEN_API_KEY"


@dataclass(frozen=True)
class Message:
    """A request.

    Attributes
    ----------
    form, accept
        Media types of the body and of the answer.
    headers
        Further ones.
    repeatable
        Whether sending it again does no harm where it may have been acted on already.
    """

    method: str
    path: str
    content: bytes | None = None
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
        headers = {"Idempotency-Key": key or str(uuid.uuid4())}
        return cls("POST", path, replies.to_json(document), headers=headers)


Conversation = Generator[Message, httpx.Response, T]
"""Yields messages and is sent their answers, or thrown the `ServiceProblem`; returns the outcome."""


@dataclass(frozen=True)
class Address:
    """Where the service is, and the key to it.

    Raises
    ------
    InvalidInput
        For a key that no header can carry; it is not repeated.
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
        return cls(base_url.rstrip("/"), (given or "").strip() or None)

    def request(self, message: Message) -> Json:
        """Arguments of the HTTP client's `request`."""
        headers = {
            "Accept": message.accept,
            "User-Agent": f"rubscreen/{__version__}",
            **message.headers,
        }
        if message.content is not None:
            headers["Content-Type"] = message.form
        if self.key is not None:
            headers["Authorization"] = f"Bearer {self.key}"
        return {
            "method": message.method,
            "url": self.base_url + message.path,
            "content": message.content,
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

"""A request id on every answer, one line of log for every request, and no fault without an answer."""

from __future__ import annotations

import json
import logging
import re
import sys
import time
import uuid

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.rest.errors import unexpected

REQUEST_ID = "X-Request-Id"
_ID = re.compile(r"[A-Za-z0-9._-]{1,128}")
access = logging.getLogger("rubscreen.access")
logger = logging.getLogger("rubscreen.service")


class AccessLog:
    """The outermost layer of the service.

    A client's own X-Request-Id is kept when it is 1 to 128 letters, digits, dots, dashes or
    underscores, so that nothing else can get into the log through it.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request_id = _request_id(Headers(scope=scope))
        scope.setdefault("state", {})["request_id"] = request_id
        start, status, sent = time.perf_counter(), None, 0

        async def marked(message: Message) -> None:
            nonlocal status, sent
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)[REQUEST_ID] = request_id
            else:
                sent += len(message.get("body", b""))
            await send(message)

        try:
            await self._app(scope, receive, marked)
        except Exception as error:
            logger.exception("request %s failed", request_id)
            if status is not None:
                raise
            await unexpected(scope, error)(scope, receive, marked)
        finally:
            line = {
                "method": scope["method"],
                "path": scope["path"],
                "status": status,
                "ms": round((time.perf_counter() - start) * 1e3, 1),
                "bytes": sent,
                "client": (scope.get("client") or [None])[0],
                "key": getattr(scope["state"].get("caller"), "key_id", None),
                "request_id": request_id,
            }
            access.info(json.dumps(line))  # JSON keeps a line break in a path from making a second line


def configure(level: str) -> None:
    """Send the loggers under ``rubscreen`` to standard error, unless the host program did."""
    root = logging.getLogger("rubscreen")
    root.setLevel(level)
    if not root.handlers and not logging.getLogger().handlers:
        handler = logging.StreamHandler(sys.stderr)
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s %(message)s"))
        root.addHandler(handler)


def _request_id(headers: Headers) -> str:
    given = headers.get(REQUEST_ID, "")
    return given if _ID.fullmatch(given) else uuid.uuid4().hex

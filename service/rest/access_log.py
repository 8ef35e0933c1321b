"""A request id on every answer, one line of log for every request, and no fault without an answer."""

from __future__ import annotations

import logging
import re
import time
import uuid

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.operation.draining import Draining
from service.operation.logs import Fields, bound
from service.operation.metrics import Metrics
from service.operation.tracing import Tracing
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

    def __init__(
        self, app: ASGIApp, metrics: Metrics, draining: Draining, tracing: Tracing | None = None
    ) -> None:
        self._app, self._metrics, self._draining, self._tracing = app, metrics, draining, tracing

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request_id = _request_id(Headers(scope=scope))
        scope.setdefault("state", {})["request_id"] = request_id
        traced = {} if self._tracing is None else self._tracing.mark(request_id)
        self._metrics.began()
        try:
            with bound(request_id=request_id, **traced):
                await self._serve(request_id, scope, receive, send)
        finally:
            self._metrics.ended()

    async def _serve(self, request_id: str, scope: Scope, receive: Receive, send: Send) -> None:
        start, status, sent = time.perf_counter(), None, 0

        async def marked(message: Message) -> None:
            nonlocal status, sent
            if message["type"] == "http.response.start":
                status = message["status"]
                headers = MutableHeaders(scope=message)
                headers[REQUEST_ID] = request_id
                if self._draining.begun:
                    headers["Connection"] = "close"
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
            seconds = time.perf_counter() - start
            line = {
                "method": scope["method"],
                "path": scope["path"],
                "status": status,
                "ms": round(seconds * 1e3, 1),
                "bytes": sent,
                "client": (scope.get("client") or [None])[0],
                "key": getattr(scope["state"].get("caller"), "key_id", None),
                "request_id": request_id,
            }
            access.info(Fields(line))
            route = getattr(scope.get("route"), "path", None)
            self._metrics.answered(scope["method"], route, status, seconds)


def _request_id(headers: Headers) -> str:
    given = headers.get(REQUEST_ID, "")
    return given if _ID.fullmatch(given) else uuid.uuid4().hex

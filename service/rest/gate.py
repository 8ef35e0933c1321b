"""Before anything else is done for a request: who sends it, and is it one too many?"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from sdm_core.errors import InvalidInput
from service.records.database import Database
from service.records.keys import ApiKey, KeyLimits, KeyStore
from service.rest.access import (
    ANONYMOUS,
    HEALTH_PATHS,
    HOW_TO_SEND,
    MISSING,
    Caller,
    NotAuthenticated,
    is_open,
    needed,
    role_of,
)
from service.rest.errors import problem_of
from service.rest.job_quota import JobQuota
from service.rest.key_check import KeyCheck
from service.rest.loopback import check_not_lured, from_elsewhere, is_loopback, network_of
from service.rest.rate_limits import CONCURRENT_REQUESTS, REQUESTS_PER_MINUTE, Allowance, RateLimits
from service.roles import Role
from service.settings import Settings


@dataclass(frozen=True)
class Access:
    """What the gate knows from start to stop of the service.

    Attributes
    ----------
    keys
        Checks keys; None where there is no database to have any.
    limits
        Counts requests.
    quota
        How many jobs may wait or run.
    """

    settings: Settings
    keys: KeyCheck | None
    quota: JobQuota
    limits: RateLimits = field(default_factory=RateLimits)

    @classmethod
    def opened(cls, settings: Settings, database: Database | None) -> Access:
        """The access that settings ask for.

        Raises
        ------
        InvalidInput
            When keys are asked for and there is no place for them.
        """
        if settings.auth == "on" and database is None:
            raise InvalidInput("auth", "on", "give a data folder, where the keys are")
        keys = None if database is None else KeyCheck(KeyStore(database))
        return cls(settings, keys, JobQuota(settings.max_active_jobs, settings.max_queued_jobs))

    def close(self) -> None:
        """Stop what still runs."""
        if self.keys is not None:
            self.keys.close()

    async def admit(self, scope: Scope) -> tuple[Caller, str]:
        """Who sends a request, and as whom it is counted; `limits` has to be told when it is answered.

        Raises
        ------
        NotAuthenticated, NotAllowed, TooManyRequests, NotReady
            When it is not to be answered.
        """
        headers, address = Headers(scope=scope), (scope.get("client") or ("unknown", 0))[0]
        caller, asks_for_keys = ANONYMOUS, self._asks_for_keys(scope)
        counted_as = f"address {network_of(address)}"
        if asks_for_keys:
            if not is_open(scope["path"]):
                key = await self._key(headers, counted_as)
                caller = Caller(key.id, key.name, key.role, key.limits.max_active_jobs)
                self.limits.enter(key.id, self._allowance(key.limits))
                return caller, key.id
            caller = replace(ANONYMOUS, role=Role.read)
        elif self.settings.auth == "auto":
            check_not_lured(headers)
        # Where nobody else can come, there is nobody to protect: limits hold only if they were set.
        limited = asks_for_keys or not is_loopback(address)
        self.limits.enter(counted_as, self._allowance(KeyLimits(), by_default=limited))
        return caller, counted_as

    def _asks_for_keys(self, scope: Scope) -> bool:
        if self.settings.auth != "auto":
            return self.settings.auth == "on"
        # `serve` settles this from the address it listens on; under another server, the one that was called.
        return from_elsewhere(str((scope.get("server") or ("",))[0]))

    async def _key(self, headers: Headers, counted_as: str) -> ApiKey:
        text = _presented(headers)
        if self.keys is None or text is None or not self.keys.recognises(text):
            # Whoever tries keys is stopped before the database is asked; a good key passes all the same.
            self.limits.take(counted_as, self._allowance(KeyLimits()).requests_per_minute)
        if self.keys is None:
            remedy = "start the service with a data folder and keys, or with auth off"
            raise NotAuthenticated("key", "this service has none", remedy)
        if text is None:
            raise NotAuthenticated("key", MISSING, f"send a key as {HOW_TO_SEND}")
        return await self.keys.check(text)

    def _allowance(self, own: KeyLimits, by_default: bool = True) -> Allowance:
        minute = own.requests_per_minute or self.settings.requests_per_minute
        at_once = own.max_concurrent_requests or self.settings.max_concurrent_requests
        if by_default:
            minute, at_once = minute or REQUESTS_PER_MINUTE, at_once or CONCURRENT_REQUESTS
        return Allowance(minute, at_once)


class Gate:
    """Refuses a request before its body is read, and tells the rest of the application who sent it.

    What has no route needs a key too. Liveness and readiness pass whoever asks, and however often.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http" or scope["path"] in HEALTH_PATHS:
            await self._app(scope, receive, send)
            return
        state: dict[str, Any] = scope["state"]
        access: Access = state["desk"].access
        try:
            state["caller"], counted_as = await access.admit(scope)
        except NotAuthenticated as error:
            remedy = f"{error.remedy}; this needs {needed(role_of(scope))}"
            told = NotAuthenticated(error.field, error.value, remedy)
            await problem_of(told, scope)(scope, receive, send)
            return
        except InvalidInput as error:
            await problem_of(error, scope)(scope, receive, send)
            return
        inside = True

        def leave() -> None:
            nonlocal inside
            if inside:
                inside = False
                access.limits.leave(counted_as)

        async def leaving(message: Message) -> None:
            # Before its end goes out: who has a whole answer may ask again at once.
            if message["type"] == "http.response.body" and not message.get("more_body", False):
                leave()
            await send(message)

        try:
            await self._app(scope, receive, leaving)
        finally:
            leave()


def _presented(headers: Headers) -> str | None:
    """The key that came with a request; None when none did."""
    scheme, _, text = headers.get("authorization", "").partition(" ")
    return text.strip() if scheme.lower() == "bearer" else headers.get("x-api-key")

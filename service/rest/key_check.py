"""Whether a key that came with a request is good: asked of the database, and known for a few seconds."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from sqlalchemy.exc import SQLAlchemyError

from service.records.database import does_not_answer
from service.records.keys import LAST_USE_EVERY_S, ApiKey, KeyStore, split_key
from service.rest.access import HOW_TO_SEND, NotAuthenticated
from service.rest.errors import NotReady

# For so long a key is not asked for again: with the time that asking takes, a revocation counts within 5 s.
KNOWN_FOR_S = 3.0
MOST_KNOWN = 10_000
# A request waits so long for the database to tell of its key, its turn included.
PATIENCE_S = 8.0

logger = logging.getLogger("rubscreen.service")


@dataclass
class _Known:
    """A key as the database had it, when, and when its last use was put on record."""

    key: ApiKey
    read_at: float
    used_at: float | None = None


class KeyCheck:
    """Checks keys.

    Only keys that are on record are remembered, so that trying others fills no memory.

    Parameters
    ----------
    store
        Where the keys are.
    clock
        Seconds since whenever, never going back.
    patience_s
        How long a request waits for the database.
    """

    def __init__(
        self,
        store: KeyStore,
        clock: Callable[[], float] = time.monotonic,
        patience_s: float = PATIENCE_S,
    ) -> None:
        self._store, self._clock, self._patience_s = store, clock, patience_s
        self._known: dict[str, _Known] = {}
        self._asking = asyncio.Lock()
        # Not the threads that files and everything else wait in: admission must not wait for an upload. Two,
        # so that one look-up that hangs does not keep the next from finding the database back.
        self._readers = ThreadPoolExecutor(2, thread_name_prefix="keys")
        # One thread for writing last uses: no request waits for it, or fails with it.
        self._writer = ThreadPoolExecutor(1, thread_name_prefix="key uses")

    def close(self) -> None:
        """Stop reading keys and writing last uses."""
        self._readers.shutdown(wait=False, cancel_futures=True)
        self._writer.shutdown(cancel_futures=True)

    def recognises(self, text: str) -> bool:
        """Whether this very key was on record the last time it was asked for, at no cost."""
        parts = split_key(text)
        known = None if parts is None else self._known.get(parts[0])
        return parts is not None and known is not None and known.key.opened_by(parts[1])

    async def check(self, text: str) -> ApiKey:
        """The key whose text came with a request.

        Raises
        ------
        NotAuthenticated
            When it is no key, unknown, expired or revoked. Neither id nor text is quoted before the secret
            proved right.
        NotReady
            When the database does not answer, or not in time.
        """
        parts = split_key(text)
        if parts is None:
            remedy = "send the whole key, rub_ and what follows, as `rubscreen keys create` printed it"
            raise NotAuthenticated("key", "not a key", remedy)
        key_id, secret = parts
        known = await self._read(key_id)
        if known is None or not known.key.opened_by(secret):
            raise NotAuthenticated("key", "unknown", f"send a key of this service, as {HOW_TO_SEND}")
        now = time.time()
        state = known.key.state(now)
        if state != "usable":
            shown = f"{known.key.id} ({known.key.name}), {state}"
            raise NotAuthenticated("key", shown, "ask for a new one: `rubscreen keys create`")
        self._note_use(known, now)
        return known.key

    async def _read(self, key_id: str) -> _Known | None:
        if self._is_fresh(known := self._known.get(key_id)):
            return known
        try:
            async with asyncio.timeout(self._patience_s), self._asking:
                # A hundred requests at once ask the database once.
                if self._is_fresh(known := self._known.get(key_id)):
                    return known
                return await self._look_up(key_id, known)
        except TimeoutError:
            logger.error("keys cannot be read: nothing within %g s", self._patience_s)
        except SQLAlchemyError as error:
            if not does_not_answer(error):
                raise
            logger.error("keys cannot be read: %s", error)
        raise NotReady("keys", "the database does not answer", "send the request again")

    async def _look_up(self, key_id: str, known: _Known | None) -> _Known | None:
        at = self._clock()  # before it is read: a change after that is seen in time
        reading = asyncio.get_running_loop().run_in_executor(self._readers, self._store.find, key_id)
        key = await reading
        if key is None:
            self._known.pop(key_id, None)
            return None
        used_at = key.last_used_at if known is None else known.used_at
        if len(self._known) >= MOST_KNOWN:
            self._known.pop(next(iter(self._known)))
        self._known[key_id] = found = _Known(key, at, used_at)
        return found

    def _is_fresh(self, known: _Known | None) -> bool:
        return known is not None and self._clock() - known.read_at < KNOWN_FOR_S

    def _note_use(self, known: _Known, now: float) -> None:
        if known.used_at is not None and now - known.used_at < LAST_USE_EVERY_S:
            return
        known.used_at = now
        try:
            self._writer.submit(self._write_use, known.key.id, now)
        except RuntimeError:  # the service is closing
            return

    def _write_use(self, key_id: str, at: float) -> None:
        try:
            self._store.used(key_id, at)
        except SQLAlchemyError as error:
            logger.warning("the last use of key %s cannot be written: %s", key_id, error)

"""What answers, exchanged while the service runs when another model of its folder becomes active."""

from __future__ import annotations

import logging
import threading
from dataclasses import dataclass
from pathlib import Path

from sdm_core.errors import InvalidInput
from service.answerer import Answerer
from service.rest.self_check import self_check
from training.activation import ACTIVE, active_id
from training.observers import OnConfident, OnExact
from training.screening import Screener

logger = logging.getLogger("rubscreen.service")


@dataclass(frozen=True)
class Answering:
    """What answers now.

    Attributes
    ----------
    screener
        What answers.
    fault
        Why there is no surrogate; None when there is one.
    """

    screener: Answerer
    fault: InvalidInput | None = None

    @property
    def model_id(self) -> str | None:
        """Identifier of the model that answers."""
        return getattr(self.screener, "model_id", None)

    @property
    def unobserved(self) -> Answerer:
        """The same with nobody told, for probes: their one question is no sample of what is asked."""
        return Screener(self.screener.model) if isinstance(self.screener, Screener) else self.screener


class ActiveModel:
    """Holds what answers.

    `now` is read once for each request, and one assignment exchanges it whole: a request is answered by the
    model it began with, and none by half a model.

    Attributes
    ----------
    now
        What answers.
    loading
        The model being loaded beside it; None while there is none.
    fault
        Why the model that the folder names does not answer; None where it does.
    switches, refusals
        Models taken up, and not taken up, since it was made.
    """

    def __init__(self, now: Answering) -> None:
        self.now = now
        self.switches = self.refusals = 0
        self.loading: str | None = None
        self.fault = now.fault

    def close(self) -> None:
        """Nothing is watched here."""

    def follow(self) -> None:
        """Nor followed."""


class WatchedModel(ActiveModel):
    """The active model of a folder, followed by a thread.

    A model that becomes active is loaded and asked the self-check beside the one that answers, and takes
    over when it gives the known answer. Until then, and for good when it is damaged, the old one answers.
    Once refused, a model is tried again when the pointer is written again.

    Parameters
    ----------
    poll_s
        How often the pointer is looked at, s; 0 is never.
    on_exact, on_confident
        As of `Screener`.
    """

    def __init__(
        self,
        folder: Path,
        poll_s: float,
        on_exact: OnExact | None = None,
        on_confident: OnConfident | None = None,
    ) -> None:
        self._folder, self._on_exact, self._on_confident = folder, on_exact, on_confident
        self._seen = _stamp(folder)  # before it is read: what is written in between is noticed
        try:
            now = Answering(Screener.default(folder, on_exact=on_exact, on_confident=on_confident))
        except InvalidInput as error:
            logger.error("no surrogate: %s", error)
            now = Answering(Screener(None, on_exact=on_exact), error)
        super().__init__(now)
        self._closing = threading.Event()
        self._following = threading.Lock()
        self._thread = None
        if poll_s > 0:
            self._thread = threading.Thread(
                target=self._watch, args=(poll_s,), name="active model", daemon=True
            )
            self._thread.start()

    def close(self) -> None:
        """Stop following the pointer."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()

    def follow(self) -> None:
        """Look at the pointer now, and load what it names where that is new."""
        with self._following:  # the thread, and who has just moved the pointer
            self._follow()

    def _follow(self) -> None:
        stamp = _stamp(self._folder)
        if stamp == self._seen:
            return
        self._seen = stamp
        try:
            self.loading = active_id(self._folder)
            if self.loading != self.now.model_id:
                self._exchange(self.loading)
            self.fault = None
        except Exception as error:  # whatever it is: a thread that died would never follow again
            self.fault = error if isinstance(error, InvalidInput) else _unexpected(self._folder, error)
            self.refusals += 1
            logger.error("%s goes on answering: %s", self.now.model_id or "the exact core", self.fault)
        finally:
            self.loading = None

    def _exchange(self, model_id: str) -> None:
        screener = Screener.default(
            self._folder, model_id, on_exact=self._on_exact, on_confident=self._on_confident
        )
        found = Answering(screener)
        self_check(found.unobserved, "auto")
        old, self.now = self.now.model_id, found
        self.switches += 1
        logger.info("%s answers from now on, after %s", model_id, old or "the exact core")

    def _watch(self, poll_s: float) -> None:
        while not self._closing.wait(poll_s):
            self.follow()


def _unexpected(folder: Path, error: Exception) -> InvalidInput:
    return InvalidInput("model", str(folder), f"it cannot be loaded ({error!r}): activate another")


def _stamp(folder: Path) -> tuple[int, int, bytes] | None:
    """Changes whenever the pointer is written, with the same model too."""
    try:
        found = (folder / ACTIVE).stat()
        return found.st_ino, found.st_mtime_ns, (folder / ACTIVE).read_bytes()
    except OSError:
        return None

"""Holds a sample of the surrogate's confident answers to the exact core, in the background."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

import numpy as np

from sdm_core.boundary import verdicts
from sdm_core.errors import Cancelled
from sdm_core.interruption import interruptible
from service.audit.tally import Promise, Tally
from service.operation.logs import bound, carried
from service.records import audits
from service.records.audits import Audited
from service.records.database import Database
from training.confident_answers import ConfidentAnswers
from training.contact_class import contact_class
from training.exact_answers import ExactAnswers

MOST_WAITING = 1_000
WRITE_EVERY_S = 1.0
logger = logging.getLogger("rubscreen.audit")


class Auditor:
    """Draws from every answer, solves exactly in a thread of its own, counts, and raises the alarm.

    The thread rests between two samples, so that it takes no more than its share of a core. It keeps the
    usual priority: at a lower one it could be put aside while it holds the interpreter's lock, and every
    request would wait for it.

    Parameters
    ----------
    share_of_time
        Of one core, above 0 and at most 1.
    points_per_answer
        Drawn at most from one answer.
    database
        Where counts are added up with those of other replicas and of earlier runs; None counts here alone.
    on_mistake
        Told of the exact answers that contradicted the surrogate, from which it can learn most.

    Attributes
    ----------
    counted
        Found by this process since it started.
    passed_over
        Drawn by this process and not audited: there was no time, or they could not be solved.

    Examples
    --------
    >>> auditor = Auditor(0.02, 8)
    >>> auditor.close()
    """

    def __init__(
        self,
        share_of_time: float,
        points_per_answer: int,
        database: Database | None = None,
        on_mistake: Callable[[ExactAnswers], None] | None = None,
    ) -> None:
        self._share, self._points, self._on_mistake = share_of_time, points_per_answer, on_mistake
        self._database = database
        self._rng, self._lock = np.random.default_rng(), threading.Lock()
        self._waiting: list[tuple[ConfidentAnswers, dict[str, Any]]] = []
        self._there, self._closing = threading.Event(), threading.Event()
        self.counted: dict[Promise, Tally] = {}
        self.passed_over = 0
        self._unwritten: dict[Promise, Tally] = {}
        self._known: dict[Promise, Audited] = {}
        self._said: set[Promise] = set()
        self._complained = False
        self._write()  # earlier runs may have left an alarm
        self._thread = threading.Thread(target=self._work, name="audit", daemon=True)
        self._thread.start()

    @property
    def known(self) -> dict[Promise, Audited]:
        """What is known of every promise, by this and other replicas, as of a second ago or so."""
        return dict(self._known)

    def alarms(self, model: str | None) -> list[Promise]:
        """Promises of a model that were found broken."""
        return sorted(p for p, seen in self._known.items() if p.model == model and seen.alarmed_at)

    def draw(self, answers: ConfidentAnswers) -> None:
        """Take a sample; never waits for the exact core.

        Where there are more samples than time, one that waits gives way, whichever: what is audited stays a
        fair sample of what was answered.
        """
        with self._lock:
            sample = answers.drawn(self._points, self._rng)
            if not len(sample):
                return
            drawn = sample, carried()
            if len(self._waiting) >= MOST_WAITING:
                place = int(self._rng.integers(MOST_WAITING))
                self.passed_over += len(self._waiting[place][0])
                self._waiting[place] = drawn
            else:
                self._waiting.append(drawn)
        self._there.set()

    def close(self) -> None:
        """Stop, and write what was counted."""
        self._closing.set()
        self._there.set()
        self._thread.join()

    def _work(self) -> None:
        written = time.monotonic()
        while not self._closing.is_set():
            # Counts of other replicas are read even where nothing is asked of this one.
            self._there.wait(WRITE_EVERY_S if self._unwritten else 30 * WRITE_EVERY_S)
            drawn = self._next()
            if drawn is not None:
                began = time.monotonic()
                with bound(**drawn[1]):
                    self._audit(drawn[0])
                self._rest(time.monotonic() - began)
            if drawn is None or time.monotonic() - written > WRITE_EVERY_S:
                self._write()
                written = time.monotonic()
        self._write()

    def _next(self) -> tuple[ConfidentAnswers, dict[str, Any]] | None:
        with self._lock:
            if not self._waiting:
                self._there.clear()
                return None
            return self._waiting.pop(int(self._rng.integers(len(self._waiting))))

    def _rest(self, worked_s: float) -> None:
        self._closing.wait(worked_s * (1.0 / self._share - 1.0))

    def _audit(self, sample: ConfidentAnswers) -> None:
        def stop() -> None:
            if self._closing.is_set():
                raise Cancelled("the service is closing")

        try:
            with interruptible(stop):
                exact = verdicts(sample.blade, sample.contact, sample.speed_hz, sample.ke, workers=1)
        except Cancelled:
            return
        except Exception:  # whatever it is, later samples must still be audited
            self.passed_over += len(sample)
            logger.exception("answers could not be audited")
            return
        promise = Promise(sample.model, contact_class(sample.contact), sample.alpha)
        found = Tally.of(sample.stable, exact)
        for counts in (self.counted, self._unwritten):
            counts[promise] = counts.get(promise, Tally()) + found
        wrong = np.isfinite(exact) & (sample.stable != (exact == 1.0))
        if wrong.any():
            self._tell(sample, exact, np.flatnonzero(wrong))

    def _tell(self, sample: ConfidentAnswers, exact: np.ndarray, rows: np.ndarray) -> None:
        for i in rows:
            said, found = ("stable", "unstable") if sample.stable[i] else ("unstable", "stable")
            where = {
                "blade": sample.blade.name,
                "contact": sample.contact.to_dict(),
                "speed_hz": float(sample.speed_hz[i]),
                "ke": float(sample.ke[i]),
                "model": sample.model,
                "alpha": sample.alpha,
            }
            logger.warning("answered %s, found %s by the exact core", said, found, extra=where)
        if self._on_mistake is not None:
            at = (sample.speed_hz[rows], sample.ke[rows], exact[rows])
            self._on_mistake(ExactAnswers.from_verdicts(sample.blade, sample.contact, *at))

    def _write(self) -> None:
        unwritten, self._unwritten = self._unwritten, {}
        try:
            if self._database is None:
                now = datetime.now(UTC)
                for promise, found in unwritten.items():
                    before = self._known.get(promise, Audited(Tally()))
                    self._known = self._known | {promise: before.with_more(found, promise.alpha, now)}
            else:
                self._known = audits.add(self._database, unwritten)
            self._complained = False
        except Exception as error:  # kept for the next time: a database that is away costs no count
            self._unwritten = unwritten
            if not self._complained:
                logger.error("audits are not written: %s", error)
            self._complained = True
        for promise, seen in self._known.items():
            if seen.alarmed_at is not None and promise not in self._said:
                self._said.add(promise)
                self._alarm(promise, seen.tally)

    def _alarm(self, promise: Promise, tally: Tally) -> None:
        logger.error(
            "ALARM: %d of %d answers that %s called stable are unstable, against its certified rate "
            "%g in %s contact: promote another model, or ask with policy exact",
            tally.false_stable,
            tally.answered_stable,
            promise.model,
            promise.alpha,
            promise.contact,
            extra={"model": promise.model, "contact": promise.contact, "alpha": promise.alpha},
        )

"""Exact answers kept while serving, for retraining: bounded, deduplicated, and never in a request's way."""

from __future__ import annotations

import logging
import queue
import threading
import time
from itertools import islice
from pathlib import Path

import numpy as np

from sdm_core.errors import InvalidInput
from training.exact_answers import ExactAnswers
from training.served_cases import ServedCases
from training.served_chunks import chunks, drop_oldest, every_chunk, whole_chunks, write_chunk

CHUNK_ROWS = 5_000
MOST_FILES = 1_000
logger = logging.getLogger("rubscreen.training")


class ServedAnswers:
    """Keeps exact answers in a folder that several threads and processes may share.

    A request hands its answers over and goes on; a thread of this object turns them into cases, leaves out
    what is there already, and writes files. When it cannot keep up, answers are dropped and counted. Up
    to `flush_s` of them are lost when the process is killed.

    Parameters
    ----------
    folder
        Made when it is not there.
    most_rows
        Answers kept in the folder, about 100 bytes each; the oldest files go first.
    flush_s
        Longest time an answer waits to be written.
    most_waiting
        Answers that may wait for the thread.

    Raises
    ------
    InvalidInput
        When the folder cannot be made.

    Examples
    --------
    >>> import tempfile
    >>> kept = ServedAnswers(Path(tempfile.mkdtemp()))
    >>> kept.close()
    """

    def __init__(
        self,
        folder: Path,
        *,
        most_rows: int = 200_000,
        flush_s: float = 30.0,
        most_waiting: int = 1_000_000,
    ) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            remedy = f"it cannot be made ({error.strerror}): give another folder"
            raise InvalidInput("served answers", str(folder), remedy) from None
        self._folder, self._most_rows, self._flush_s = folder, most_rows, flush_s
        self._queue: queue.SimpleQueue[ExactAnswers | threading.Event | None] = queue.SimpleQueue()
        self._most_waiting, self._waiting, self._lock = most_waiting, 0, threading.Lock()
        self.dropped, self._complained = 0, False
        self._seen: dict[bytes, None] = {}  # in order of age, as no set is
        self._known: set[Path] = set()
        self._fresh: list[ServedCases] = []
        self._pending: set[bytes] = set()
        self._chunk = ServedCases.none()
        self._chunk_path: Path | None = None
        self._thread = threading.Thread(target=self._work, name="served answers", daemon=True)
        self._thread.start()

    def keep(self, answers: ExactAnswers) -> None:
        """Hand answers over; never waits and never raises."""
        with self._lock:
            if self._waiting + len(answers) > self._most_waiting:
                self.dropped += len(answers)
                return
            self._waiting += len(answers)
        self._queue.put(answers)

    def flush(self) -> None:
        """Return once everything handed over so far is written."""
        written = threading.Event()
        self._queue.put(written)
        written.wait()

    def close(self) -> None:
        """Write what is left, and stop."""
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()

    @staticmethod
    def read(folder: Path) -> ServedCases:
        """Everything kept in a folder, each answer once, oldest first; damaged files are skipped.

        Raises
        ------
        InvalidInput
            When there is no such folder.
        """
        if not folder.is_dir():
            raise InvalidInput("served answers", str(folder), "give the folder a service kept its answers in")
        return ServedCases.concatenate(every_chunk(folder)).distinct()

    def _work(self) -> None:
        due = 0.0
        while True:
            if self._fresh and time.monotonic() >= due:
                self._write_or_drop()
            try:
                item = self._queue.get(timeout=max(0.0, due - time.monotonic()) if self._fresh else None)
            except queue.Empty:
                continue
            if not isinstance(item, ExactAnswers):
                self._write_or_drop()
                if item is None:
                    return
                item.set()
                continue
            if not self._fresh:
                due = time.monotonic() + self._flush_s
            try:
                self._take(item)
            except Exception as error:  # whatever it is, later answers must still be kept
                self._drop(len(item), error)
            with self._lock:
                self._waiting -= len(item)
            if len(self._pending) >= CHUNK_ROWS:
                self._write_or_drop()

    def _take(self, answers: ExactAnswers) -> None:
        cases = ServedCases.from_answers(answers.brackets())
        new = []
        for i, name in enumerate(cases.digests().tolist()):
            if name not in self._seen and name not in self._pending:
                self._pending.add(name)
                new.append(i)
        if new:
            self._fresh.append(cases[np.array(new)])

    def _write_or_drop(self) -> None:
        fresh, self._fresh, self._pending = ServedCases.concatenate(self._fresh), [], set()
        try:
            self._write(fresh)
        except Exception as error:  # a full disk costs answers kept, never the service
            self._drop(len(fresh), error)

    def _write(self, fresh: ServedCases) -> None:
        """Write what is new together with the last chunk of this process, until that is full."""
        self._catch_up()
        fresh = fresh[np.array([name not in self._seen for name in fresh.digests().tolist()], dtype=bool)]
        if not len(fresh):
            return
        whole = ServedCases.concatenate([self._chunk, fresh])
        path = write_chunk(self._folder, whole)
        if self._chunk_path is not None:  # only now that its successor is there; `read` takes none twice
            self._chunk_path.unlink(missing_ok=True)
        self._known.add(path)
        self._remember(fresh)
        self._complained = False
        full = len(whole) >= CHUNK_ROWS
        self._chunk, self._chunk_path = (ServedCases.none(), None) if full else (whole, path)
        drop_oldest(self._folder, self._most_rows, MOST_FILES)

    def _catch_up(self) -> None:
        """Learn what earlier and other processes have written, so as not to write it again."""
        there = chunks(self._folder)
        unknown = [path for path in there if path not in self._known]
        self._known = set(there)
        for cases in whole_chunks(unknown):
            self._remember(cases)

    def _remember(self, cases: ServedCases) -> None:
        self._seen.update(dict.fromkeys(cases.digests().tolist()))
        for name in list(islice(self._seen, max(0, len(self._seen) - self._most_rows))):
            del self._seen[name]

    def _drop(self, count: int, error: Exception) -> None:
        if not self._complained:  # once, or a full disk fills the log
            logger.error("exact answers are not kept in %s: %s", self._folder, error)
        self._complained = True
        self.dropped += count

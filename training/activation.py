"""Which model of a folder is active, and a history of what was when.

Two files in the models folder: ``active``, the identifier of the active model, and ``history.jsonl``, one
line of JSON for every change. The line is written before the pointer moves, so that no model ever becomes
active without a record; where the two disagree (a kill between them, a pointer written by hand) the
pointer is right, and the next change first records what it found.
"""

from __future__ import annotations

import errno
import json
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from sdm_core.errors import InvalidInput
from sdm_core.version import __version__
from sdm_core.whole_files import staged

SHIPPED = Path(__file__).parent / "models"
ACTIVE, HISTORY = "active", "history.jsonl"
FIRST, PROMOTED, ROLLED_BACK, FOUND = "first", "promoted", "rolled back", "found"
_LOCK, _WAIT_S = ".lock", 30.0
logger = logging.getLogger("rubscreen.training")


@dataclass(frozen=True)
class Activation:
    """A line of the history.

    Attributes
    ----------
    at
        When, UTC, ISO 8601.
    event
        `FIRST` model of the folder, `PROMOTED`, `ROLLED_BACK`, or `FOUND` active though the line before
        says otherwise.
    model, was
        The active model from then on, and the one before.
    forced
        Whether the gate was overridden.
    reasons
        What the gate said against it (`forced` then).
    measured
        What was measured on fresh points before the promotion.
    """

    at: str
    event: str
    model: str
    was: str | None
    forced: bool = False
    reasons: tuple[str, ...] = ()
    measured: dict[str, Any] = field(default_factory=dict)
    code_version: str = __version__

    def to_line(self) -> bytes:
        """For the history, newline included."""
        return json.dumps(asdict(self), sort_keys=True).encode() + b"\n"

    @classmethod
    def from_line(cls, line: bytes) -> Activation:
        """From the history; ValueError, TypeError or KeyError for what is no such line."""
        data = json.loads(line)
        return cls(**{**data, "reasons": tuple(data["reasons"])})


def active_id(folder: Path = SHIPPED) -> str:
    """Identifier of the active model.

    Raises
    ------
    InvalidInput
        When there is none.
    """
    try:
        return (folder / ACTIVE).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError):
        raise InvalidInput(
            "models folder", str(folder), "train a model first: it has no active one"
        ) from None


def activate(
    model_id: str,
    folder: Path,
    event: str,
    *,
    expected: str | None,
    forced: bool = False,
    reasons: tuple[str, ...] = (),
    measured: dict[str, Any] | None = None,
) -> Activation:
    """Record a change, then move the pointer.

    Parameters
    ----------
    expected
        The model that was active when the change was decided; None where there was none.

    Raises
    ------
    InvalidInput
        When another model has become active meanwhile, or the folder cannot be written (the model that
        was active stays so).
    """
    with _locked(folder):
        was = _pointer(folder)
        if was != expected:
            raise InvalidInput(
                "models folder", str(folder), f"{was or 'no model'} is active by now: decide again"
            )
        unrecorded = _unrecorded(folder, _recorded(folder))
        if unrecorded is not None:
            _append(folder, unrecorded)
        entry = Activation(_now(), event, model_id, was, forced, reasons, measured or {})
        _append(folder, entry)
        with staged(folder / ACTIVE, "models folder") as beside, beside.open("w", encoding="utf-8") as file:
            file.write(model_id + "\n")
            file.flush()
            os.fsync(file.fileno())
    return entry


def history(folder: Path) -> tuple[Activation, ...]:
    """Every change, oldest first; ends with `FOUND` where the pointer is not where the last line says.

    A line that is not whole (its writer was killed) is left out: its change was not made.
    """
    recorded = _recorded(folder)
    found = _unrecorded(folder, recorded)
    return tuple(recorded if found is None else [*recorded, found])


def before_active(folder: Path) -> str | None:
    """The model a rollback returns to; None where there was none.

    A rollback takes back the change it follows: after A, B, C it returns to B, and again to A.
    """
    row: list[str] = []
    for entry in history(folder):
        if entry.event in (ROLLED_BACK, FOUND) and entry.model in row:
            while row[-1] != entry.model:
                row.pop()
        elif not row or row[-1] != entry.model:
            row.append(entry.model)
    return row[-2] if len(row) > 1 else None


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    try:
        with FileLock(folder / _LOCK, timeout=_WAIT_S):
            yield
    except Timeout:
        remedy = "another process is changing it: try again"
        raise InvalidInput("models folder", str(folder), remedy) from None
    except OSError as error:
        remedy = f"it cannot be written ({error.strerror or error}); what was active stays so"
        raise InvalidInput("models folder", str(folder), remedy) from None


def _recorded(folder: Path) -> list[Activation]:
    entries: list[Activation] = []
    path = folder / HISTORY
    for number, line in enumerate(path.read_bytes().splitlines() if path.is_file() else (), 1):
        try:
            entries.append(Activation.from_line(line))
        except (ValueError, TypeError, KeyError):
            logger.warning("%s, line %d is not whole and left out", path, number)
    return entries


def _unrecorded(folder: Path, recorded: list[Activation]) -> Activation | None:
    """What the pointer says where the last line says otherwise."""
    found, said = _pointer(folder), recorded[-1].model if recorded else None
    return None if found in (None, said) else Activation(_now(), FOUND, str(found), said)


def _append(folder: Path, entry: Activation) -> None:
    with (folder / HISTORY).open("a+b", buffering=0) as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(size - 1, 0))
        torn = size > 0 and file.read(1) != b"\n"
        line = (b"\n" if torn else b"") + entry.to_line()
        try:
            if file.write(line) != len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            os.fsync(file.fileno())
        except OSError:
            file.truncate(size)
            raise


def _pointer(folder: Path) -> str | None:
    try:
        return active_id(folder)
    except InvalidInput:
        return None


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="microseconds")

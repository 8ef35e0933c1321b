"""What can go wrong, named so that a caller can mend it."""

from __future__ import annotations

from typing import Any


class RubscreenError(Exception):
    """Base of every error raised on purpose by this distribution."""


class InvalidInput(RubscreenError, ValueError):
    """An argument cannot be used.

    Parameters
    ----------
    field
        Where the value stands, as the caller wrote it (``states[1].frequency_hz[2]``).
    value
        What was found there.
    remedy
        What to write instead.
    """

    def __init__(self, field: str, value: Any, remedy: str) -> None:
        self.field, self.value, self.remedy = field, _short(value), remedy
        super().__init__(f"{field} = {self.value}: {remedy}")

    def __reduce__(self):
        return type(self), (self.field, self.value, self.remedy)

    def under(self, prefix: str) -> InvalidInput:
        """The same error, seen from the object that holds the field."""
        joint = "" if self.field.startswith("[") or not self.field else "."
        return type(self)(f"{prefix}{joint}{self.field}", self.value, self.remedy)


class OutOfSpeedRange(InvalidInput):
    """The modal data do not reach the rotor speed asked for."""


class ModesNotTracked(InvalidInput):
    """Modes cannot be followed from one modal state to the next."""


class DamagedFile(InvalidInput):
    """A file is truncated, corrupt or of another kind."""


class TooMuchWork(InvalidInput):
    """More exact work than one call may ask for."""


class LinerWornThrough(InvalidInput):
    """A simulated blade has cut through its abradable liner."""


class NotConverged(RubscreenError):
    """An iteration did not reach its accuracy."""


class Cancelled(RubscreenError):
    """The caller asked for the work to stop."""


def _short(value: Any) -> str:
    try:
        text = value if isinstance(value, str) and value else repr(value)
    except ValueError:  # an integer with more digits than Python prints
        text = f"a {type(value).__name__} too large to print"
    return text if len(text) <= 120 else f"{text[:100]}... ({len(text)} characters)"

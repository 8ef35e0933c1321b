"""What audits have found, counted for each promise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from training.audit_evidence import log_evidence

# The chance that a promise that is kept ever raises an alarm.
FALSE_ALARM = 0.01
# Of the evidence, where it is told as it is: beyond what a double can hold it is an alarm all the same.
LARGEST_LOG = 700.0


@dataclass(frozen=True, order=True)
class Promise:
    """One line of a model's certificate: of the points it calls stable at most `alpha` are unstable."""

    model: str
    contact: str
    alpha: float


@dataclass(frozen=True)
class Tally:
    """Counts of audited answers under one promise.

    Attributes
    ----------
    answered_stable, false_stable
        Answered stable, and how many of them were unstable; the promise is about these.
    answered_unstable, false_unstable
        Answered unstable, and how many of them were stable; nothing is promised of these.
    undecided
        Not decided to tolerance by the exact core, and so not counted above.

    Examples
    --------
    >>> Tally(answered_stable=10, false_stable=1) + Tally(answered_stable=5)
    Tally(answered_stable=15, false_stable=1, answered_unstable=0, false_unstable=0, undecided=0)
    """

    answered_stable: int = 0
    false_stable: int = 0
    answered_unstable: int = 0
    false_unstable: int = 0
    undecided: int = 0

    @classmethod
    def of(cls, answered: np.ndarray, exact: np.ndarray) -> Tally:
        """From answers (bool) and exact verdicts (1.0, 0.0, NaN), shape (m,) each."""
        decided = np.isfinite(exact)
        stable, unstable = answered & decided, ~answered & decided
        return cls(
            answered_stable=int(stable.sum()),
            false_stable=int((stable & (exact == 0.0)).sum()),
            answered_unstable=int(unstable.sum()),
            false_unstable=int((unstable & (exact == 1.0)).sum()),
            undecided=int((~decided).sum()),
        )

    def __add__(self, other: Tally) -> Tally:
        return Tally(
            self.answered_stable + other.answered_stable,
            self.false_stable + other.false_stable,
            self.answered_unstable + other.answered_unstable,
            self.false_unstable + other.false_unstable,
            self.undecided + other.undecided,
        )

    @property
    def audited(self) -> int:
        """Answers looked at."""
        return self.answered_stable + self.answered_unstable + self.undecided

    def log_evidence(self, alpha: float) -> float:
        """Against the promise, as `training.audit_evidence.log_evidence`."""
        return log_evidence(self.false_stable, self.answered_stable, alpha)

    def breaks(self, alpha: float) -> bool:
        """Whether the counts contradict the promise at the level `FALSE_ALARM`."""
        return self.log_evidence(alpha) >= -np.log(FALSE_ALARM)

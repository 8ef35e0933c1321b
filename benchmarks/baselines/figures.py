"""Figures of a method on a trial: errors, how many are left after verifying, how many must be verified."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.baselines.samples import Trial
from training.design_space import DesignSpace
from training.evaluation import boundary_errors
from training.learn_then_test import fixed_sequence

ALPHA, LEVEL = 1e-3, 0.05
# Shares tried to prove ALPHA, safest first; set before any data is seen, they are the order of the tests.
SHARES = (
    *(0.6, 0.5, 0.4, 0.35, 0.3, 0.25, 0.2, 0.17, 0.14, 0.12, 0.1, 0.08, 0.07, 0.06, 0.05, 0.04, 0.03),
    *(0.025, 0.02, 0.0175, 0.015, 0.0125, 0.01, 0.0075, 0.005, 0.0025, 0.0),
)


@dataclass(frozen=True)
class Wrong:
    """Wrong verdicts among points answered without verification."""

    answered_stable: int
    false_stable: int
    answered_unstable: int
    false_unstable: int

    @property
    def rate(self) -> float:
        """Of both kinds together."""
        answered = self.answered_stable + self.answered_unstable
        return (self.false_stable + self.false_unstable) / max(1, answered)


@dataclass(frozen=True)
class Figures:
    """What became of a method on a trial.

    Attributes
    ----------
    alone, alone_near, helped, helped_near
        Without and with the trial's share of points verified; `near` are those within 25 % of the boundary.
    verified
        How many were.
    to_verify
        Least share of points, the least certain ones, that proves a false-stable rate below 1e-3 with 95 %
        confidence; infinite when 60 % do not.
    median_boundary_error, p99_boundary_error
        Of the first crossing, relative.
    """

    alone: Wrong
    alone_near: Wrong
    helped: Wrong
    helped_near: Wrong
    verified: int
    to_verify: float
    median_boundary_error: float
    p99_boundary_error: float


def judged(score: np.ndarray, log_critical: np.ndarray, trial: Trial) -> Figures:
    """Figures of a method, from its scores and boundaries (log10 κ) on a trial; shape (m,) each."""
    nothing, near = np.zeros(len(trial), dtype=bool), trial.near
    every, checked = ~nothing, least_certain(score, trial.share)
    tried = [_wrong(score, trial.unstable, ~least_certain(score, share)) for share in SHARES]
    held = fixed_sequence([w.false_stable for w in tried], [w.answered_stable for w in tried], ALPHA, LEVEL)
    scale = trial.cases.stiffness_scale
    limit = DesignSpace().largest_ke(trial.cases)
    error = boundary_errors(10.0**log_critical * scale, trial.critical_ke, limit)
    return Figures(
        _wrong(score, trial.unstable, every),
        _wrong(score, trial.unstable, near),
        _wrong(score, trial.unstable, ~checked),
        _wrong(score, trial.unstable, near & ~checked),
        int(checked.sum()),
        SHARES[held - 1] if held else np.inf,
        float(np.median(error)),
        float(np.quantile(error, 0.99, method="higher")),
    )


def least_certain(score: np.ndarray, share: float) -> np.ndarray:
    """The points to verify, exactly round(share·m) of them whatever the scores; shape (m,)."""
    order = np.argsort(np.abs(np.nan_to_num(score, nan=0.0)), kind="stable")
    out = np.zeros(len(score), dtype=bool)
    out[order[: round(share * len(score))]] = True
    return out


def _wrong(score: np.ndarray, unstable: np.ndarray, answered: np.ndarray) -> Wrong:
    stable, risky = answered & ~(score > 0), answered & (score > 0)
    return Wrong(
        int(stable.sum()), int((stable & unstable).sum()), int(risky.sum()), int((risky & ~unstable).sum())
    )

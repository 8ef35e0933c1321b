"""Figures on points that training never saw (definitions: DESIGN, section 7)."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from training.surrogate import PredictedBoundary
from training.verification_band import VerificationBand

HARD = 0.25  # within this of the boundary in K_e a point is hard


@dataclass(frozen=True)
class VerdictFigures:
    """Rates of wrong answers among those the surrogate gave without verification."""

    points: int
    answered_stable: int
    false_stable: int
    answered_unstable: int
    false_unstable: int
    exact_share: float

    @property
    def false_stable_rate(self) -> float:
        """P(unstable | answered stable by the surrogate, not verified)."""
        return self.false_stable / max(1, self.answered_stable)

    @property
    def false_unstable_rate(self) -> float:
        """P(stable | answered unstable by the surrogate, not verified)."""
        return self.false_unstable / max(1, self.answered_unstable)

    def to_dict(self) -> dict[str, Any]:
        rates = {
            "false_stable_rate": self.false_stable_rate,
            "false_unstable_rate": self.false_unstable_rate,
        }
        return {**asdict(self), **rates}


@dataclass(frozen=True)
class Evaluation:
    """Held-out figures of a surrogate.

    Attributes
    ----------
    auto, alone
        With verification near the boundary and outside the domain, and without any.
    auto_hard, alone_hard
        The same on the points within 25 % of the boundary in K_e.
    median_boundary_error, p99_boundary_error
        Relative error of the surrogate's first crossing, a missed or spurious one counting as
        infinite.
    distribution
        What the points are a sample of.
    """

    auto: VerdictFigures
    auto_hard: VerdictFigures
    alone: VerdictFigures
    alone_hard: VerdictFigures
    median_boundary_error: float
    p99_boundary_error: float
    distribution: str

    def to_dict(self) -> dict[str, Any]:
        return {
            "distribution": self.distribution,
            "median_boundary_error": self.median_boundary_error,
            "p99_boundary_error": self.p99_boundary_error,
            **{name: getattr(self, name).to_dict() for name in ("auto", "auto_hard", "alone", "alone_hard")},
        }


def evaluate(
    boundary: PredictedBoundary,
    band: VerificationBand,
    inside: np.ndarray,
    ke: np.ndarray,
    critical_ke: np.ndarray,
    unstable: np.ndarray,
    *,
    distribution: str,
    ke_max: np.ndarray | None = None,
) -> Evaluation:
    """Compare answers with the truth.

    Parameters
    ----------
    boundary, band
        What the surrogate says, and where it would be verified.
    inside
        Which points lie in the design space; the others would be verified.
    ke, critical_ke, unstable
        K_e in N/m, the exact first crossing (infinite where there is none, NaN where it is not known) and
        the exact verdict, shape (m,) each.
    ke_max
        Largest K_e a crossing is looked for at; beyond it both sides say "none".
    """
    verified = band.verify(boundary, ke) | ~inside
    with np.errstate(divide="ignore", invalid="ignore"):
        near = np.abs(ke / critical_ke - 1) <= HARD
    predicted = 10.0**boundary.log_ke
    error = boundary_errors(predicted, critical_ke, ke_max)
    none = np.zeros(len(ke), dtype=bool)

    def count(rows: np.ndarray, checked: np.ndarray) -> VerdictFigures:
        stable = rows & ~checked & (boundary.score(ke) < 0)
        risky = rows & ~checked & ~(boundary.score(ke) < 0)
        return VerdictFigures(
            int(rows.sum()),
            int(stable.sum()),
            int((stable & unstable).sum()),
            int(risky.sum()),
            int((risky & ~unstable).sum()),
            float((rows & checked).sum() / max(1, rows.sum())),
        )

    every = ~none
    return Evaluation(
        count(every, verified),
        count(near, verified),
        count(every, none),
        count(near, none),
        float(np.median(error)),
        float(np.quantile(error, 0.99, method="higher")),
        distribution,
    )


def boundary_errors(predicted: np.ndarray, exact: np.ndarray, ke_max: np.ndarray | None) -> np.ndarray:
    """Relative errors of first crossings, a missed or spurious one below `ke_max` infinite.

    Cases whose exact crossing is not known (NaN) are left out.
    """
    limit = np.full(len(exact), np.inf) if ke_max is None else ke_max
    seen, there = predicted <= limit, np.isfinite(exact) & (exact <= limit)
    error = np.zeros(len(exact))
    error[seen & there] = np.abs(predicted[seen & there] / exact[seen & there] - 1)
    error[seen != there] = np.inf
    return error[~np.isnan(exact)]

"""How near the boundary the surrogate must not be trusted: the verification band."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.stats import binom

from sdm_core.errors import RubscreenError
from training.surrogate import PredictedBoundary

# Candidate bands in spreads, safest first: the order of the fixed sequence, set before any data.
# It ends at ten: real blades are drawn from no distribution, and verifying a few more costs little.
BANDS = (80.0, 60.0, 50.0, 40.0, 30.0, 25.0, 20.0, 16.0, 13.0, 10.0)
# A verdict within 5 % of the boundary is verified however sure the surrogate is.
LEAST_HALF_WIDTH = float(np.log10(1.05))


@dataclass(frozen=True)
class VerificationBand:
    """Points nearer to the boundary than this go to the exact core.

    Attributes
    ----------
    spreads
        Half width of the band in learned spreads.
    alpha
        Bound on P(unstable | answered stable, not verified) ...
    confidence
        ... that holds with this confidence on the named distribution.
    accepted, errors
        Calibration points answered stable without verification, and how many were unstable.
    distribution
        Name of the distribution of the calibration points.
    """

    spreads: float
    alpha: float
    confidence: float
    accepted: int
    errors: int
    distribution: str

    def verify(self, boundary: PredictedBoundary, ke: np.ndarray) -> np.ndarray:
        """Which points must be verified, shape (m,)."""
        with np.errstate(divide="ignore"):
            distance = np.abs(np.log10(ke) - boundary.log_ke)
        return ~(distance > self.half_width(boundary))

    def half_width(self, boundary: PredictedBoundary) -> np.ndarray:
        """Half width of the band in log10 K_e, shape (m,)."""
        return np.maximum(self.spreads * boundary.spread, LEAST_HALF_WIDTH)

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


class CalibrationFailed(RubscreenError):
    """No band keeps the bound: too few points, or too poor a surrogate."""


def calibrate(
    boundary: PredictedBoundary,
    ke: np.ndarray,
    unstable: np.ndarray,
    *,
    distribution: str,
    alpha: float = 5e-4,
    confidence: float = 0.95,
) -> VerificationBand:
    """Smallest band whose false-stable rate is at most `alpha`, by exact binomial tests.

    Fixed-sequence testing (Learn then Test, Angelopoulos et al. 2021): bands are tested from the
    widest on, each at level 1 − confidence, until one fails; the last that held is taken. The
    points must be an independent sample of the distribution, never used in training.

    Raises
    ------
    CalibrationFailed
        When the widest band already fails.
    """
    chosen: VerificationBand | None = None
    for spreads in BANDS:
        trial = VerificationBand(spreads, alpha, confidence, 0, 0, distribution)
        stable = ~trial.verify(boundary, ke) & (boundary.score(ke) < 0)
        accepted, errors = int(stable.sum()), int((stable & unstable).sum())
        if binom.cdf(errors, accepted, alpha) > 1 - confidence:
            break
        chosen = VerificationBand(spreads, alpha, confidence, accepted, errors, distribution)
    if chosen is None:
        raise CalibrationFailed(f"false-stable rate above {alpha:g} in the widest band of {len(ke)} points")
    return chosen

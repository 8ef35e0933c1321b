"""How near the boundary the surrogate must not be trusted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from training.surrogate import PredictedBoundary

ONE_PERCENT, FIVE_PERCENT, TEN_PERCENT = (float(np.log10(1 + p)) for p in (0.01, 0.05, 0.1))


@dataclass(frozen=True)
class VerificationBand:
    """Points nearer to the boundary than this go to the exact core.

    Attributes
    ----------
    spreads
        Half width of the band in learned spreads.
    least_half_width
        In log10 K_e: a verdict as near as this is verified however sure the surrogate is.
    """

    spreads: float
    least_half_width: float = FIVE_PERCENT

    def verify(self, boundary: PredictedBoundary, ke: np.ndarray) -> np.ndarray:
        """Which points must be verified, shape (m,)."""
        with np.errstate(divide="ignore"):
            distance = np.abs(np.log10(ke) - boundary.log_ke)
        return ~(distance > self.half_width(boundary))

    def half_width(self, boundary: PredictedBoundary) -> np.ndarray:
        """Half width of the band in log10 K_e, shape (m,)."""
        return np.maximum(self.spreads * boundary.spread, self.least_half_width)

"""Where the surrogate is not sure of its own answer, or knows nothing of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.errors import InvalidInput
from training.answers import CONFIDENT, NEAR_BOUNDARY, OUT_OF_DOMAIN, CertificateUsed
from training.surrogate import PredictedBoundary
from training.verification_band import FIVE_PERCENT, VerificationBand


@dataclass(frozen=True)
class FirstCrossings:
    """What the surrogate says of the boundary at m speeds.

    Attributes
    ----------
    critical_ke
        N/m, NaN where there is none up to the K_e asked about, or it was not asked.
    error_estimate
        Its relative error, by the learned spread.
    reason
        Why it answers, or does not.
    certificate
        As in `PointAnswers`.
    """

    critical_ke: np.ndarray
    error_estimate: np.ndarray
    reason: np.ndarray
    certificate: CertificateUsed | None

    @classmethod
    def none(cls, reason: np.ndarray) -> FirstCrossings:
        """Where the surrogate is not asked at all."""
        return cls(np.full(len(reason), np.nan), np.full(len(reason), np.nan), reason, None)


def first_crossings(
    predicted: PredictedBoundary,
    reason: np.ndarray,
    band: VerificationBand,
    certificate: CertificateUsed | None,
    speed_hz: np.ndarray,
    ke_max: float,
    policy: str,
) -> FirstCrossings:
    """First crossings up to `ke_max`; under "auto" the surrogate is sure where its band is at most 5 % wide.

    A band that is wider everywhere, as the shipped one with arcs, leaves it only to say that there is none.

    Parameters
    ----------
    reason
        So far, shape (m,); what is not sure is written into it.

    Raises
    ------
    InvalidInput
        Under "surrogate", where it would have to say more than it knows.
    """
    with np.errstate(over="ignore"):
        critical = np.where(predicted.log_ke <= np.log10(ke_max), 10.0**predicted.log_ke, np.nan)
        error = 10.0 ** (band.spreads * predicted.spread) - 1
    width = band.half_width(predicted)
    # Up to where crossings were looked for, it says there is none.
    reach = np.broadcast_to(predicted.log_reach, len(speed_hz))
    top = np.minimum(np.log10(ke_max), reach)
    beyond = (predicted.log_ke > top) & (reach < np.log10(ke_max))
    if policy == "auto":
        doubtful = width > FIVE_PERCENT
        doubtful &= predicted.log_ke - width < top  # else none below, for sure
        doubtful |= np.abs(predicted.log_ke - top) < width
        reason[(reason == CONFIDENT) & doubtful] = NEAR_BOUNDARY
        reason[(reason == CONFIDENT) & beyond] = OUT_OF_DOMAIN
    elif beyond.any():
        worst = int(np.argmax(beyond))
        raise InvalidInput("ke_max", ke_max, _beyond_reach(reach[worst], speed_hz[worst]))
    return FirstCrossings(critical, error, reason, certificate)


def doubt_points(
    predicted: PredictedBoundary,
    ke: np.ndarray,
    reason: np.ndarray,
    band: VerificationBand,
    policy: str,
) -> None:
    """Write into `reason` which points at K_e the surrogate is not sure of, or knows nothing of.

    Raises
    ------
    InvalidInput
        Under "surrogate", where it knows nothing.
    """
    with np.errstate(divide="ignore"):
        beyond = np.log10(ke) > predicted.log_reach
    if policy == "auto":
        reason[(reason == CONFIDENT) & beyond] = OUT_OF_DOMAIN
        reason[(reason == CONFIDENT) & band.verify(predicted, ke)] = NEAR_BOUNDARY
    elif beyond.any():
        at = tuple(np.argwhere(beyond)[0])
        worst = float(np.broadcast_to(ke, beyond.shape)[at])
        reach = float(np.broadcast_to(predicted.log_reach, beyond.shape)[at])
        raise InvalidInput("ke", worst, _beyond_reach(reach))


def _beyond_reach(log_reach: float, speed_hz: float | None = None) -> str:
    """The remedy where a K_e lies above what the surrogate learned, log10 N/m."""
    at = "" if speed_hz is None else f" at {speed_hz:g} Hz"
    return f"the surrogate knows this blade up to {10.0**log_reach:.3g} N/m{at}; use policy auto or exact"

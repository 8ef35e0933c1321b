"""The certificate: a bound on the rate of unstable designs called stable, proven on independent points."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sdm_core.errors import InvalidInput, RubscreenError
from training.contact_class import ARCS, PERMANENT
from training.learn_then_test import simultaneous_sequences
from training.surrogate import PredictedBoundary
from training.verification_band import FIVE_PERCENT, TEN_PERCENT, VerificationBand

# The rates a user may ask for, loosest first, and the candidate bands, safest first. Both are set before any
# data is seen: they are the order of the tests. In permanent contact the bands end at ten spreads and 5 %,
# with arcs at twenty and 10 %, though less would do on the distribution: real blades are drawn from none. On
# short arcs rotor 37 has errors of 20 and 26 spreads, 6 and 9 % in K_e, of which the surrogate is sure.
LADDER = (1e-2, 5e-3, 1e-3, 5e-4, 1e-4)
BANDS = {
    PERMANENT: tuple(
        VerificationBand(s, FIVE_PERCENT)
        for s in (80.0, 60.0, 50.0, 40.0, 30.0, 25.0, 20.0, 16.0, 13.0, 10.0)
    ),
    ARCS: tuple(VerificationBand(s, TEN_PERCENT) for s in (40.0, 30.0, 25.0, 20.0)),
}
CONFIDENCE = 0.95
# A model that does not reach this one is not worth serving.
DEFAULT_ALPHA = 5e-4


class CalibrationFailed(RubscreenError):
    """No band keeps the bound: too few points, or too poor a surrogate."""


@dataclass(frozen=True)
class CertifiedBand:
    """A line of the table: the narrowest band that keeps a rate.

    Attributes
    ----------
    alpha
        Bound on P(unstable | answered stable, not verified).
    spreads, least_half_width
        Of the verification band, in learned spreads and in log10 K_e.
    accepted, errors
        Calibration points answered stable without verification, and how many of them were unstable.
    verified_share
        Share of the calibration points that the exact core would have answered.
    false_unstable_rate
        Share of stable ones among the calibration points answered unstable without verification. Observed,
        not certified: such a mistake costs a design, not a blade.
    """

    alpha: float
    spreads: float
    accepted: int
    errors: int
    verified_share: float
    false_unstable_rate: float
    least_half_width: float = FIVE_PERCENT

    @property
    def band(self) -> VerificationBand:
        """What must be verified."""
        return VerificationBand(self.spreads, self.least_half_width)


@dataclass(frozen=True)
class Certificate:
    """What is proven of a surrogate on one named distribution in one class of contact.

    With `confidence` over the draw of the calibration points, **every** line of the table is true at
    once: a rate may be chosen after looking at the shares. Another certificate is another statement
    with a confidence of its own.

    Attributes
    ----------
    distribution
        Name of the distribution of the calibration points.
    contact
        Class of contact (`training.contact_class`).
    confidence
        Of the whole table.
    points, seed
        How many calibration points, and what they were drawn with.
    table
        Lines by alpha, loosest first.
    candidates, least_half_widths
        Bands that were tested, in their order: in spreads, and at least in log10 K_e.
    not_reached
        Rates asked for that no band was proven to keep.
    """

    distribution: str
    contact: str
    confidence: float
    points: int
    seed: int
    table: tuple[CertifiedBand, ...]
    candidates: tuple[float, ...]
    not_reached: tuple[float, ...] = ()
    least_half_widths: tuple[float, ...] = ()

    @property
    def alphas(self) -> tuple[float, ...]:
        """Rates there is a line for, loosest first."""
        return tuple(line.alpha for line in self.table)

    def line(self, alpha: float | None = None) -> CertifiedBand:
        """The line of a rate; None is `DEFAULT_ALPHA`.

        Raises
        ------
        InvalidInput
            When there is none, naming those there are.
        """
        asked = DEFAULT_ALPHA if alpha is None else alpha
        for line in self.table:
            if np.isclose(line.alpha, asked, rtol=1e-9, atol=0.0):
                return line
        known = ", ".join(f"{a:g}" for a in self.alphas) or "none"
        raise InvalidInput(
            "alpha", asked, f"give one of {known}: the model is certified for those on {self.distribution}"
        )

    def to_dict(self) -> dict[str, Any]:
        """For the model card."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Certificate:
        """From the model card."""
        names = ("candidates", "not_reached", "least_half_widths")
        lists = {name: tuple(data.get(name, ())) for name in names}
        return cls(**{**data, **lists, "table": tuple(CertifiedBand(**line) for line in data["table"])})


def certify(
    boundary: PredictedBoundary,
    inside: np.ndarray,
    ke: np.ndarray,
    unstable: np.ndarray,
    *,
    distribution: str,
    contact: str,
    seed: int,
    bands: tuple[VerificationBand, ...] | None = None,
    alphas: tuple[float, ...] = LADDER,
    confidence: float = CONFIDENCE,
) -> Certificate:
    """For each rate the narrowest band proven to keep it, all of them together with `confidence`.

    Parameters
    ----------
    boundary
        The surrogate's at the calibration points: an independent sample of the distribution, of which
        neither training nor the choice of the model has seen anything.
    inside
        Which points lie in the design space; the others are verified whatever the band.
    ke, unstable
        K_e in N/m and the exact verdict, shape (m,) each.
    bands, alphas
        Candidates, the safest first, and rates, falling; None is `BANDS` of the class of contact.
    """
    bands = BANDS[contact] if bands is None else bands
    says_stable = boundary.score(ke) < 0
    lines = [_counted(band, boundary, inside, ke, unstable, says_stable) for band in bands]
    errors, accepted = [line.errors for line in lines], [line.accepted for line in lines]
    counts = simultaneous_sequences(errors, accepted, alphas, confidence)
    table = tuple(
        CertifiedBand(alpha, **{k: v for k, v in asdict(lines[held - 1]).items() if k != "alpha"})
        for alpha, held in zip(alphas, counts, strict=True)
        if held
    )
    missed = tuple(alpha for alpha, held in zip(alphas, counts, strict=True) if not held)
    return Certificate(
        distribution,
        contact,
        confidence,
        len(ke),
        seed,
        table,
        tuple(band.spreads for band in bands),
        missed,
        tuple(band.least_half_width for band in bands),
    )


def _counted(
    band: VerificationBand,
    boundary: PredictedBoundary,
    inside: np.ndarray,
    ke: np.ndarray,
    unstable: np.ndarray,
    says_stable: np.ndarray,
) -> CertifiedBand:
    verified = band.verify(boundary, ke) | ~inside
    stable, risky = ~verified & says_stable, ~verified & ~says_stable
    return CertifiedBand(
        np.nan,
        band.spreads,
        int(stable.sum()),
        int((stable & unstable).sum()),
        float(verified.mean()),
        float((risky & ~unstable).sum() / max(1, risky.sum())),
        band.least_half_width,
    )

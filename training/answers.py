"""What screening answers: arrays by column, each entry with its source and its reason."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.blade_sensitivity import Influence

SURROGATE, EXACT = "surrogate", "exact"
CONFIDENT, NEAR_BOUNDARY = "confident", "near_boundary"
OUT_OF_DOMAIN, REQUESTED = "out_of_domain", "requested"
UNSURE_SLOPE = "unsure_slope"  # of derivatives alone: the boundary itself is confident
POLICIES = ("auto", "surrogate", "exact")


@dataclass(frozen=True)
class CertificateUsed:
    """The bound under which the surrogate answered.

    Attributes
    ----------
    alpha
        Bound on P(unstable | answered stable by the surrogate), ...
    confidence
        ... which holds with this confidence ...
    distribution
        ... on blades, speeds and stiffnesses drawn from the distribution of this name.
    spreads
        Half width of the band about the predicted boundary that the exact core verified, in learned
        spreads.
    """

    alpha: float
    confidence: float
    distribution: str
    spreads: float


@dataclass(frozen=True)
class PointAnswers:
    """Verdicts at m points (speed, K_e).

    Attributes
    ----------
    stable
        1.0 stable, 0.0 unstable, NaN not decided to tolerance; shape (m,).
    unstable_probability
        The surrogate's; NaN where the source is the exact core.
    spectral_radius, growth_per_revolution, chatter_hz, error_estimate
        The exact core's; NaN where the source is the surrogate.
    unstable_multipliers, wear_lobes
        Multipliers outside the unit circle, and wear lobes per revolution (chatter frequency over rotor
        speed), likewise.
    source, reason
        Arrays of str, shape (m,).
    model, solver
        Identifier of the surrogate (or None) and name of the exact method.
    certificate
        What the surrogate's answers hold under; None where there are none, or none were verified.
    """

    speed_hz: np.ndarray
    ke: np.ndarray
    stable: np.ndarray
    unstable_probability: np.ndarray
    spectral_radius: np.ndarray
    growth_per_revolution: np.ndarray
    chatter_hz: np.ndarray
    error_estimate: np.ndarray
    unstable_multipliers: np.ndarray
    wear_lobes: np.ndarray
    source: np.ndarray
    reason: np.ndarray
    model: str | None
    solver: str
    certificate: CertificateUsed | None = None

    @property
    def exact_share(self) -> float:
        """Share of the answers that come from the exact core."""
        return float(np.mean(self.source == EXACT))


@dataclass(frozen=True)
class BoundaryAnswers:
    """First crossing at each of m speeds.

    Attributes
    ----------
    critical_ke
        N/m, NaN where there is none below `ke_max`; shape (m,).
    chatter_hz
        Frequency at the crossing, Hz; NaN where the surrogate answered or there is no crossing.
    error_estimate
        Relative error of `critical_ke`: the exact core's, or the surrogate's learned spread.
    unstable_ke
        For exact answers every interval of instability below `ke_max` as (low, high), N/m;
        None where the surrogate answered.
    certificate
        As in `PointAnswers`; here the band decides where the surrogate is sure enough.
    """

    speed_hz: np.ndarray
    ke_max: float
    critical_ke: np.ndarray
    chatter_hz: np.ndarray
    error_estimate: np.ndarray
    unstable_ke: tuple[tuple[tuple[float, float], ...] | None, ...]
    source: np.ndarray
    reason: np.ndarray
    model: str | None
    solver: str
    certificate: CertificateUsed | None = None

    @property
    def exact_share(self) -> float:
        """Share of the answers that come from the exact core."""
        return float(np.mean(self.source == EXACT))


@dataclass(frozen=True)
class SensitivityAnswers:
    """Derivatives of the first crossing with respect to each of p parameters, at each of m speeds.

    Attributes
    ----------
    critical_ke, chatter_hz, error_estimate
        As in `BoundaryAnswers`, shape (m,); the error is that of `critical_ke`.
    parameter, unit
        In words, as in `sdm_core.blade_sensitivity.Influence`: p of each.
    value
        Of the parameters at each speed, shape (m, p).
    derivative
        dK_e/dp, N/m per unit, shape (m, p); NaN where there is no crossing, or it has no derivative.
    relative
        d ln K_e/d ln p, for the edge of an arc per revolution; shape (m, p), NaN likewise.
    certificate
        As in `BoundaryAnswers`: it is about the boundary, and says nothing of derivatives.
    """

    speed_hz: np.ndarray
    ke_max: float
    critical_ke: np.ndarray
    chatter_hz: np.ndarray
    error_estimate: np.ndarray
    parameter: tuple[str, ...]
    unit: tuple[str, ...]
    value: np.ndarray
    derivative: np.ndarray
    relative: np.ndarray
    source: np.ndarray
    reason: np.ndarray
    model: str | None
    solver: str
    certificate: CertificateUsed | None = None

    @property
    def exact_share(self) -> float:
        """Share of the answers that come from the exact core."""
        return float(np.mean(self.source == EXACT))

    def influences(self, i: int) -> tuple[Influence, ...] | None:
        """Parameter by parameter at one speed; None where there are no derivatives."""
        if np.isnan(self.relative[i]).all():
            return None
        columns = (self.value[i], self.derivative[i], self.relative[i])
        return tuple(
            Influence(name, unit, float(value), float(derivative), float(relative))
            for name, unit, value, derivative, relative in zip(
                self.parameter, self.unit, *columns, strict=True
            )
        )


@dataclass(frozen=True)
class MapAnswers:
    """Verdicts on a grid of a speeds and b stiffnesses; two-dimensional arrays have shape (b, a).

    Attributes
    ----------
    stable
        1.0 stable, 0.0 unstable, NaN not decided.
    unstable_probability
        The surrogate's; NaN where the exact core answered.
    source, reason
        Arrays of str, shape (b, a).
    certificate
        As in `PointAnswers`.
    """

    speed_hz: np.ndarray
    ke: np.ndarray
    stable: np.ndarray
    unstable_probability: np.ndarray
    source: np.ndarray
    reason: np.ndarray
    model: str | None
    solver: str
    certificate: CertificateUsed | None = None

    @property
    def exact_share(self) -> float:
        """Share of the answers that come from the exact core."""
        return float(np.mean(self.source == EXACT))

    @property
    def unstable_share(self) -> float:
        """Share of the map that is unstable, among the decided."""
        decided = np.isfinite(self.stable)
        return float(np.mean(self.stable[decided] == 0.0)) if decided.any() else float("nan")

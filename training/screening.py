"""The one place that decides: surrogate or exact core.

REST routes, command line, batch jobs and the evaluation of a model all come through here, so that
what is certified is what is served.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sdm_core.blade import Blade
from sdm_core.blade_sensitivity import check_differentiable
from sdm_core.boundary import CHARACTERISTIC, CLOSED_FORM, boundary, verdicts
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.stability import stabilities
from sdm_core.validation import KE_LIMIT, number, speeds, stiffnesses
from training.answers import (
    CONFIDENT,
    EXACT,
    OUT_OF_DOMAIN,
    POLICIES,
    REQUESTED,
    SURROGATE,
    UNSURE_SLOPE,
    BoundaryAnswers,
    CertificateUsed,
    MapAnswers,
    PointAnswers,
    SensitivityAnswers,
)
from training.cases import CaseBatch
from training.certificate import Certificate
from training.contact_class import contact_class, in_words
from training.doubt import FirstCrossings, doubt_points, first_crossings
from training.exact_answers import ExactAnswers
from training.exact_budget import (
    ARC_BOUNDARY_S,
    ARC_VERDICT_S,
    GRADIENT_S,
    PERMANENT_S,
    POINT_S,
    check_budget,
)
from training.influence_table import InfluenceTable
from training.observers import Observers, OnConfident, OnExact
from training.registry import SHIPPED, Model, load_model
from training.surrogate import PredictedBoundary
from training.verification_band import VerificationBand


class Screener:
    """Answers from the surrogate where it is sure, else from the exact core.

    Parameters
    ----------
    model
        None answers exactly only.
    exact_budget_s
        Most exact work one call may ask for, seconds as estimated before it starts.
    on_exact, on_confident
        Told of every exact answer, and of every verdict given under a certificate (`training.observers`).
    """

    def __init__(
        self,
        model: Model | None,
        exact_budget_s: float = 240.0,
        on_exact: OnExact | None = None,
        on_confident: OnConfident | None = None,
    ) -> None:
        self.model = model
        self.exact_budget_s = exact_budget_s
        self._observers = Observers(on_exact, on_confident)

    @classmethod
    def default(
        cls,
        models_folder: Path = SHIPPED,
        model_id: str | None = None,
        on_exact: OnExact | None = None,
        on_confident: OnConfident | None = None,
    ) -> Screener:
        """With the active model of a folder, by default the shipped one.

        Raises
        ------
        InvalidInput, DamagedFile
            As `load_model`.
        """
        return cls(load_model(model_id, models_folder), on_exact=on_exact, on_confident=on_confident)

    @property
    def model_id(self) -> str | None:
        """Identifier of the model in use."""
        return self.model.id if self.model else None

    def points(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> PointAnswers:
        """Verdicts at points (speed_hz[i], ke[i]).

        Exact answers also give spectral radius, growth, chatter frequency and error estimate.

        Parameters
        ----------
        policy
            Who answers: "auto" is the surrogate where it is sure, else the exact core.
        alpha
            Rate of unstable designs among those called stable that "auto" must keep; the model is certified
            for some rates, and None is the certificate's own default. Exact answers keep any.

        Raises
        ------
        InvalidInput
            For unusable input, `policy` "surrogate" outside the domain, an `alpha` without a certificate,
            or one with `policy` "surrogate", which keeps none.
        TooMuchWork
            When the exact core would have to answer too many points.
        """
        speed, stiffness = speeds("speed_hz", speed_hz), stiffnesses("ke", ke)
        if len(speed) != len(stiffness):
            raise InvalidInput("ke", f"{len(stiffness)} numbers", f"give one a speed: {len(speed)}")
        band, certificate = self._band(contact, policy, alpha)
        predicted, reason = self._predicted(blade, contact, speed, policy)
        if predicted is None:
            probability, stable = np.full(len(speed), np.nan), np.full(len(speed), np.nan)
        else:
            probability = predicted.unstable_probability(stiffness)
            stable = (probability < 0.5).astype(float)
            doubt_points(predicted, stiffness, reason, band, policy)
        exact = self._exact_rows(reason, policy)
        self._allow(exact.sum(), POINT_S, blade, speed)
        columns = np.full((6, len(speed)), np.nan)
        probability[exact], stable[exact] = np.nan, np.nan
        rows = np.flatnonzero(exact)
        if len(rows):
            at = RubbingBlade.at_speeds(blade, contact, speed[rows])
            problems = [problem.with_ke(k) for problem, k in zip(at, stiffness[rows], strict=True)]
            for i, found in zip(rows, stabilities(problems), strict=True):
                stable[i] = np.nan if found.stable is None else float(found.stable)
                columns[:, i] = (
                    found.spectral_radius,
                    found.growth_per_revolution,
                    found.chatter_hz,
                    found.error_estimate,
                    np.nan if found.unstable_multipliers is None else found.unstable_multipliers,
                    found.wear_lobes,
                )
            self._observers.exact(
                ExactAnswers.from_verdicts, blade, contact, speed[rows], stiffness[rows], stable[rows]
            )
        sure = np.flatnonzero(~exact)
        self._observers.confident(
            self.model_id, certificate, blade, contact, speed[sure], stiffness[sure], stable[sure]
        )
        radius, growth, chatter, error, outside, lobes = columns
        return PointAnswers(
            speed,
            stiffness,
            stable,
            probability,
            radius,
            growth,
            chatter,
            error,
            outside,
            lobes,
            _source(exact),
            reason,
            self.model_id,
            CHARACTERISTIC,
            certificate if predicted is not None else None,
        )

    def boundary(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke_max: float,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> BoundaryAnswers:
        """First crossing at each speed; raises as `points`."""
        speed = speeds("speed_hz", speed_hz)
        ke_max = number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
        decided = self._first_crossings(blade, contact, speed, ke_max, policy, alpha)
        critical, error, reason = decided.critical_ke, decided.error_estimate, decided.reason
        chatter = np.full(len(speed), np.nan)
        exact = self._exact_rows(reason, policy)
        unstable: list[tuple[tuple[float, float], ...] | None] = [None] * len(speed)
        if exact.any():
            unit = PERMANENT_S if contact.permanent else ARC_BOUNDARY_S
            self._allow(exact.sum(), unit, blade, speed)
            found = boundary(blade, contact, speed[exact], ke_max, truncation=False)
            critical[exact], chatter[exact] = found.critical_ke, found.chatter_hz
            error[exact] = found.error_estimate
            self._observers.exact(
                ExactAnswers.from_crossings, blade, contact, speed[exact], critical[exact], ke_max
            )
            for i, intervals in zip(np.flatnonzero(exact), found.unstable_ke, strict=True):
                unstable[i] = intervals
        free = speed[~exact & np.isnan(critical)]
        self._observers.confident(self.model_id, decided.certificate, blade, contact, free, ke_max, 1.0)
        return BoundaryAnswers(
            speed,
            ke_max,
            critical,
            chatter,
            error,
            tuple(unstable),
            _source(exact),
            reason,
            self.model_id,
            _solver(contact),
            decided.certificate,
        )

    def sensitivities(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke_max: float,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> SensitivityAnswers:
        """What moves the first crossing at each speed, parameter by parameter; raises as `points`.

        Under "auto" the surrogate answers, by automatic differentiation, where it would answer `boundary`,
        unless it is not sure of its gradient (`training.influence_table`). Smooth engagement has no gradient.
        """
        speed = speeds("speed_hz", speed_hz)
        ke_max = number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
        check_differentiable(contact)
        decided = self._first_crossings(blade, contact, speed, ke_max, policy, alpha)
        table = InfluenceTable(blade, contact, speed, decided)
        if self.model is not None:
            doubtful = table.predict(self.model.surrogate, ~self._exact_rows(decided.reason, policy))
            if policy == "auto":
                decided.reason[doubtful] = UNSURE_SLOPE
        exact = self._exact_rows(decided.reason, policy)
        if exact.any():
            unit = PERMANENT_S if contact.permanent else ARC_BOUNDARY_S
            self._allow(exact.sum(), unit + GRADIENT_S, blade, speed)
            critical = table.solve(exact, ke_max)
            self._observers.exact(ExactAnswers.from_crossings, blade, contact, speed[exact], critical, ke_max)
        return table.answers(ke_max, _source(exact), self.model_id, _solver(contact))

    def map(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray,
        policy: str = "auto",
        alpha: float | None = None,
    ) -> MapAnswers:
        """Verdicts on the grid of speeds (a,) and stiffnesses (b,); raises as `points`."""
        speed, stiffness = speeds("speed_hz", speed_hz), stiffnesses("ke", ke)
        band, certificate = self._band(contact, policy, alpha)
        predicted, reason_of_speed = self._predicted(blade, contact, speed, policy)
        shape = (len(stiffness), len(speed))
        reason = np.broadcast_to(reason_of_speed, shape).copy()
        if predicted is None:
            probability, stable = np.full(shape, np.nan), np.full(shape, np.nan)
        else:
            column = stiffness[:, None]
            probability = predicted.unstable_probability(column)
            stable = (probability < 0.5).astype(float)
            doubt_points(predicted, column, reason, band, policy)
        exact = self._exact_rows(reason, policy)
        if contact.permanent:  # one solve decides a whole column
            self._allow(exact.any(axis=0).sum(), PERMANENT_S, blade, speed)
        else:
            self._allow(exact.sum(), ARC_VERDICT_S, blade, speed)
        if exact.any():
            row, col = np.nonzero(exact)
            stable[exact] = verdicts(blade, contact, speed[col], stiffness[row])
            probability[exact] = np.nan
            self._observers.exact(
                ExactAnswers.from_verdicts, blade, contact, speed[col], stiffness[row], stable[exact]
            )
        row, col = np.nonzero(~exact)
        self._observers.confident(
            self.model_id, certificate, blade, contact, speed[col], stiffness[row], stable[row, col]
        )
        return MapAnswers(
            speed,
            stiffness,
            stable,
            probability,
            _source(exact),
            reason,
            self.model_id,
            _solver(contact),
            certificate if predicted is not None else None,
        )

    def _first_crossings(
        self,
        blade: Blade,
        contact: ContactConfiguration,
        speed: np.ndarray,
        ke_max: float,
        policy: str,
        alpha: float | None,
    ) -> FirstCrossings:
        """What the surrogate says of the boundary, and where it is not sure of it."""
        band, certificate = self._band(contact, policy, alpha)
        predicted, reason = self._predicted(blade, contact, speed, policy)
        if predicted is None:
            return FirstCrossings.none(reason)
        return first_crossings(predicted, reason, band, certificate, speed, ke_max, policy)

    def _band(
        self, contact: ContactConfiguration, policy: str, alpha: float | None
    ) -> tuple[VerificationBand, CertificateUsed | None]:
        """What must be verified, and the certificate that "auto" then answers under.

        Where the exact core answers everything, the band is as good as any and there is no certificate.
        """
        if policy not in POLICIES:
            raise InvalidInput("policy", policy, f"give one of {', '.join(POLICIES)}")
        if alpha is not None:
            alpha = number("alpha", alpha, 0.0, 1.0, "", open_low=True)
            if policy == "surrogate":
                raise InvalidInput(
                    "alpha", alpha, "the surrogate alone keeps no rate; use policy auto, or leave it out"
                )
        certificate = self._certificate(contact)
        if policy == "exact" or certificate is None:
            return VerificationBand(np.inf), None
        line = certificate.line(alpha)
        if policy == "surrogate":
            return line.band, None
        used = CertificateUsed(line.alpha, certificate.confidence, certificate.distribution, line.spreads)
        return line.band, used

    def _certificate(self, contact: ContactConfiguration) -> Certificate | None:
        return None if self.model is None else self.model.certificate(contact_class(contact))

    def _predicted(
        self, blade: Blade, contact: ContactConfiguration, speed: np.ndarray, policy: str
    ) -> tuple[PredictedBoundary | None, np.ndarray]:
        """The surrogate's boundary (None where it is not to be asked) and the reason so far."""
        reason = np.full(len(speed), REQUESTED, dtype="<U13")
        if policy == "exact":
            contact.weight_vector(blade.tip_nodes)
            blade.at_speeds(speed)  # names the first speed out of reach before any work is done
            return None, reason
        if self.model is None:
            raise InvalidInput("policy", policy, "no model is loaded: use policy exact, or train one")
        cases = CaseBatch.from_blade(blade, contact, speed)
        why = self.model.design_space.first_violation(cases)
        if self._certificate(contact) is None:
            why[why == ""] = f"{in_words(contact_class(contact))}, which this model is not certified for"
        outside = why != ""
        if policy == "surrogate" and outside.any():
            i = int(np.argmax(outside))
            remedy = "the surrogate does not answer outside its domain; use policy auto or exact"
            raise InvalidInput("policy", policy, f"speed_hz[{i}] = {speed[i]:g} Hz: {why[i]}; {remedy}")
        if policy == "auto":
            reason[:] = np.where(outside, OUT_OF_DOMAIN, CONFIDENT)
        if outside.all():
            return None, reason
        predicted = self.model.surrogate.boundary(cases[~outside])
        columns = np.full((3, len(speed)), np.nan)
        columns[:, ~outside] = (
            predicted.log_ke,
            predicted.spread,
            np.log10(self.model.design_space.largest_ke(cases[~outside])),
        )
        return PredictedBoundary(*columns), reason

    def _exact_rows(self, reason: np.ndarray, policy: str) -> np.ndarray:
        if policy == "surrogate":
            return np.zeros(reason.shape, dtype=bool)
        return reason != CONFIDENT

    def _allow(self, count: int, unit_s: float, blade: Blade, speed: np.ndarray) -> None:
        check_budget(self.exact_budget_s, count, unit_s, blade, speed)


def _source(exact: np.ndarray) -> np.ndarray:
    return np.where(exact, EXACT, SURROGATE)


def _solver(contact: ContactConfiguration) -> str:
    return CLOSED_FORM if contact.permanent else CHARACTERISTIC

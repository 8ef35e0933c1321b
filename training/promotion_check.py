"""A candidate measured anew on fresh points, whatever its card says of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.stats import binom, hypergeom

from training.cases import CaseBatch
from training.certificate import Certificate
from training.contact_class import ARCS, PERMANENT, in_words
from training.evaluation import boundary_errors
from training.held_out import MISTAKES, Counted, HeldOut, held_out
from training.labelling import truth
from training.promotion_gate import LEVEL, RATE_FACTOR, more_frequent
from training.reference_space import NAME, reference_sample
from training.registry import Model
from training.seeds import seed_for

# Two thousand exact labels take five seconds on one core. With them a copy of the
# shipped model whose boundaries are off by 0.1 % is found out by its boundary errors, by 5 % by its verdicts.
POINTS = 2_000
# Below this a card is contradicted. A true card passes each of its nine tests with 99.9 %.
CONTRADICTED = 1e-3


@dataclass(frozen=True)
class ExactSample:
    """Independent points of a named distribution with the truth of each.

    Attributes
    ----------
    cases, ke
        m cases, and a K_e for each, N/m.
    critical_ke, unstable
        First crossing (infinite: none) and verdict by the exact core, shape (m,).
    distribution
        Name of the distribution.
    """

    cases: CaseBatch
    ke: np.ndarray
    critical_ke: np.ndarray
    unstable: np.ndarray
    distribution: str


@dataclass(frozen=True)
class Remeasured:
    """What fresh points say against a candidate (nothing: empty), and the figures for the history."""

    reasons: tuple[str, ...]
    figures: dict[str, Any]


Sampler = Callable[[int, int], ExactSample]
"""Called with (points, seed)."""


def reference_points(points: int, seed: int, contact: str) -> ExactSample:
    """Points of the reference design space in one class of contact."""
    sample = reference_sample(points, seed, contact)
    return ExactSample(sample.cases, sample.ke, *truth(sample.cases, sample.ke, workers=1), NAME)


SAMPLERS: Mapping[str, Sampler] = {
    contact: partial(reference_points, contact=contact) for contact in (PERMANENT, ARCS)
}
"""One for each class of contact a surrogate may be certified for."""


def remeasured(
    candidate: Model,
    active: Model | None,
    *,
    points: int = POINTS,
    samplers: Mapping[str, Sampler] = SAMPLERS,
) -> Remeasured:
    """Compare a candidate with the exact core, its own card, and the active model on the same points.

    The points are drawn with a seed of the candidate's own name: fresh for each, and the same whoever
    repeats the measurement.

    Raises
    ------
    LabelAuditFailed
        As `critical_kappa`.
    """
    reasons: list[str] = []
    figures: dict[str, Any] = {}
    said = held_out(candidate.card)
    for contact in sorted({c.contact for c in candidate.certificates if c.table}):
        if contact not in samplers:
            reasons.append(f"{in_words(contact)}: there is no way to measure it anew")
            continue
        sample = samplers[contact](points, seed_for("promotion", int(candidate.id, 16)))
        ours = _Answers.of(candidate, sample)
        for certificate in candidate.certificates:
            if certificate.contact == contact and certificate.distribution == sample.distribution:
                reasons += _breaks_certificate(ours, certificate)
        if contact in said and said[contact].distribution == sample.distribution:
            reasons += _breaks_figures(ours, said[contact], contact)
        figures[contact] = ours.figures()
        if active is not None and active.certificate(contact) is not None:
            theirs = _Answers.of(active, sample)
            reasons += _worse_than(ours, theirs, contact)
            figures[contact]["active"] = theirs.figures()
    return Remeasured(tuple(reasons), figures)


@dataclass(frozen=True)
class _Answers:
    """A surrogate's answers at the points of a sample, and how wrong they are."""

    model: Model
    sample: ExactSample
    says_stable: np.ndarray
    wrong: dict[str, np.ndarray]
    boundary_error: np.ndarray

    @classmethod
    def of(cls, model: Model, sample: ExactSample) -> _Answers:
        boundary = model.surrogate.boundary(sample.cases)
        stable = boundary.score(sample.ke) < 0
        reach = model.design_space.largest_ke(sample.cases)
        error = boundary_errors(10.0**boundary.log_ke, sample.critical_ke, reach)
        wrong = {"false_stable": stable & sample.unstable, "false_unstable": ~stable & ~sample.unstable}
        return cls(model, sample, stable, wrong, error)

    def counted(self, mistake: str) -> Counted:
        answered = self.says_stable if mistake == "false_stable" else ~self.says_stable
        return Counted(int(self.wrong[mistake].sum()), int(answered.sum()))

    def figures(self) -> dict[str, Any]:
        middle = float(np.median(self.boundary_error))
        median = middle if np.isfinite(middle) else None  # JSON has no infinity
        counts = {name: [self.counted(name).wrong, self.counted(name).answered] for name in MISTAKES}
        return {"points": len(self.sample.ke), "median_boundary_error": median, **counts}


def _breaks_certificate(found: _Answers, certificate: Certificate) -> Iterator[str]:
    """The loosest line of the certificate that the fresh points contradict, if any."""
    boundary = found.model.surrogate.boundary(found.sample.cases)
    inside = found.model.design_space.contains(found.sample.cases, found.sample.ke)
    for line in certificate.table:
        accepted = found.says_stable & inside & ~line.band.verify(boundary, found.sample.ke)
        errors, of = int((accepted & found.sample.unstable).sum()), int(accepted.sum())
        if binom.sf(errors - 1, of, line.alpha) < CONTRADICTED:
            yield (
                f"{in_words(certificate.contact)}: certified for {line.alpha:g}, but of {of:,} fresh points "
                f"it calls stable unverified, {errors} are unstable"
            )
            return


def _breaks_figures(found: _Answers, said: HeldOut, contact: str) -> Iterator[str]:
    """Held-out figures of the card that the fresh points contradict."""
    for mistake in MISTAKES:
        if ("alone", mistake) not in said.counts:
            continue
        fresh, stated = found.counted(mistake), said.counts["alone", mistake]
        if more_frequent(fresh, stated) < CONTRADICTED:
            words = mistake.replace("_", " ")
            yield f"{in_words(contact)}: {fresh} fresh points {words}, where its card says {stated}"
    points = len(found.boundary_error)
    for quantile, error in said.boundary_error.items():
        above, expected = int((found.boundary_error > error).sum()), round((1 - quantile) * said.points)
        # Of all points, fresh and the card's, `above + expected` exceed it: are too many of them fresh?
        p = hypergeom.sf(above - 1, points + said.points, above + expected, points)
        if p < CONTRADICTED:
            yield (
                f"{in_words(contact)}: its card says that {1 - quantile:.0%} of the boundary errors exceed "
                f"{error:.2%}; of the fresh points {above / points:.1%} do"
            )


def _worse_than(found: _Answers, active: _Answers, contact: str) -> Iterator[str]:
    """Mistakes that the candidate makes and the active model, on the same points, does not."""
    for mistake in MISTAKES:
        ours, theirs = found.wrong[mistake], active.wrong[mistake]
        only_ours, only_theirs = int((ours & ~theirs).sum()), int((theirs & ~ours).sum())
        share = RATE_FACTOR / (1 + RATE_FACTOR)
        if binom.sf(only_ours - 1, only_ours + only_theirs, share) < LEVEL:
            words = mistake.replace("_", " ")
            yield (
                f"{in_words(contact)}: {int(ours.sum())} fresh points {words}, the active model "
                f"{int(theirs.sum())} of the same"
            )

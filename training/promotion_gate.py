"""What a card says of a candidate against what the active model's says: is it worse? (decision 14)"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.stats import binom

from training.certificate import Certificate
from training.contact_class import in_words
from training.held_out import GROUPS, Counted, HeldOut, held_out
from training.registry import Model

# The share that the exact core answers is what a certificate costs: a quarter more of it is refused, but
# not two points in a thousand.
COST_FACTOR, COST_SHARE = 1.25, 0.002
# A mistake is more frequent when the counts contradict, with 99 % confidence, a rate of up to 1.25 times
# what it is now.
RATE_FACTOR, LEVEL = 1.25, 0.01
# A quarter more boundary error is 2.5 standard errors of the difference of two 99 % quantiles of 20,000
# points each (7 % each, by bootstrap). Up to the second figures it matters to nobody: a tenth of what is
# asked of a surrogate.
ERROR_FACTOR, ERROR_SLACK = 1.25, {0.5: 3e-4, 0.99: 5e-3}


def worse_in_words(candidate: Model, active: Model | None) -> tuple[str, ...]:
    """Every way in which the candidate is worse than the active model, by their cards; empty for none.

    Each class of contact is looked at on its own, so that one model may add a class to what another has.

    Parameters
    ----------
    active
        None where there is none to compare with; then the candidate's figures must be whole.
    """
    now = () if active is None else active.certificates
    before = {} if active is None else held_out(active.card)
    figures = held_out(candidate.card)
    reasons = [*_gaps(candidate, figures)]
    for certificate in now:
        if certificate.table:
            reasons += _less_certified(candidate, certificate)
    for contact, figure in before.items():
        reasons += _more_mistakes(in_words(contact), figures.get(contact), figure)
    return tuple(reasons)


def more_frequent(found: Counted, now: Counted, factor: float = 1.0) -> float:
    """P-value against "the rate behind `found` is at most `factor` times the one behind `now`".

    Conditional test of two Poisson rates (Przyborowski and Wilenski, *Biometrika* 31, 1940): of all
    mistakes, those of the candidate are binomial. For two binomial counts it is conservative.

    Examples
    --------
    >>> round(more_frequent(Counted(7, 10_000), Counted(0, 10_000)), 4)
    0.0078
    """
    share = factor * found.answered / max(1.0, factor * found.answered + now.answered)
    return float(binom.sf(found.wrong - 1, found.wrong + now.wrong, share))


def _gaps(candidate: Model, figures: dict[str, HeldOut]) -> Iterator[str]:
    certified = {certificate.contact for certificate in candidate.certificates if certificate.table}
    if not certified:
        yield "it is certified for nothing"
    for contact in sorted(certified):
        if contact not in figures:
            yield f"{in_words(contact)}: its card has no held-out figures"
        elif figures[contact].absent:
            yield f"{in_words(contact)}: its card does not say {'; '.join(figures[contact].absent)}"


def _less_certified(candidate: Model, now: Certificate) -> Iterator[str]:
    where = f"{in_words(now.contact)}, {now.distribution}"
    of_contact = [c for c in candidate.certificates if c.contact == now.contact and c.table]
    found = next((c for c in of_contact if c.distribution == now.distribution), None)
    if found is None:
        others = ", ".join(c.distribution for c in of_contact)
        yield f"{where}: certified now, the candidate is not{f' (but on {others})' if others else ''}"
        return
    if found.points < now.points:
        yield f"{where}: certified on {found.points:,} points, now {now.points:,}"
    if found.confidence < now.confidence:
        yield f"{where}: certified with {found.confidence:.0%} confidence, now {now.confidence:.0%}"
    lines = {line.alpha: line for line in found.table}
    for line in now.table:
        known = next((a for a in lines if np.isclose(a, line.alpha, rtol=1e-9, atol=0.0)), None)
        if known is None:
            yield f"{where}: a false-stable rate of {line.alpha:g} is certified now and not of the candidate"
            continue
        share, most = lines[known].verified_share, COST_FACTOR * line.verified_share + COST_SHARE
        if not share <= most:
            yield (
                f"{where}: for {line.alpha:g} the exact core would answer {share:.2%} of the points, "
                f"now {line.verified_share:.2%} (up to {most:.2%} is let pass)"
            )


def _more_mistakes(where: str, found: HeldOut | None, now: HeldOut) -> Iterator[str]:
    if found is None:
        yield f"{where}: no held-out figures, and the active model has them"
        return
    if found.distribution != now.distribution:
        yield f"{where}: held-out figures on {found.distribution}, now on {now.distribution}"
        return
    if found.points < now.points:
        yield f"{where}: held-out figures from {found.points:,} points, now {now.points:,}"
    for (group, mistake), counted in now.counts.items():
        if group.startswith("auto") and found.alpha != now.alpha:
            continue  # verified for another rate; the certificates are compared rate by rate
        theirs = found.counts.get((group, mistake))
        if theirs is None:
            continue  # a gap, and named as one
        p = more_frequent(theirs, counted, RATE_FACTOR)
        if p < LEVEL:
            yield (
                f"{where}, {GROUPS[group]}: {theirs} {mistake.replace('_', ' ')}, now {counted} "
                f"(p = {p:.1g} if it were at most {RATE_FACTOR:g} times as frequent)"
            )
    for quantile, error in now.boundary_error.items():
        name = (
            "median boundary error" if quantile == 0.5 else f"boundary error of {quantile:.0%} of the points"
        )
        theirs_error = found.boundary_error.get(quantile, np.nan)
        most = ERROR_FACTOR * error + ERROR_SLACK[quantile]
        if np.isnan(theirs_error):
            yield f"{where}: {name} not stated, now {error:.2%}"
        elif theirs_error > most:
            yield f"{where}: {name} {theirs_error:.2%}, now {error:.2%} (up to {most:.2%} is let pass)"

"""What the certificate says beside what is observed on 200,000 points never seen before, half with arcs."""

from __future__ import annotations

import numpy as np
from rich.console import Group
from rich.table import Table

from training.calibration import CLASSES
from training.contact_class import PERMANENT, in_words
from training.evaluation import VerdictFigures, evaluate
from training.labelling import truth
from training.learn_then_test import binomial_p_value
from training.reference_space import NAME, reference_sample
from training.registry import Model, load_model
from training.seeds import seed_for


def table(count: int = 100_000) -> Group:
    """One table a class of contact."""
    model = load_model()
    return Group(*(_of_class(model, contact, count) for contact in CLASSES))


def _of_class(model: Model, contact: str, count: int) -> Table:
    """One line a rate, then the surrogate without verification; each also near the boundary."""
    certificate = model.certificate(contact)
    assert certificate is not None
    # A seed of its own: training, calibration and the evaluation on the card have others.
    purpose = "certificate benchmark" if contact == PERMANENT else f"certificate benchmark, {contact}"
    sample = reference_sample(count, seed_for(purpose, 2013), contact)
    critical, unstable = truth(sample.cases, sample.ke)
    boundary = model.surrogate.boundary(sample.cases)
    inside = model.design_space.contains(sample.cases, sample.ke)

    out = Table(
        title=f"model {model.id}: {count:,} points of {NAME}, {in_words(contact)}, against the exact core",
        caption=f"certified on {certificate.points:,} other points, all lines together with "
        f"{certificate.confidence:.0%} confidence; p: probability of so few errors if the rate were alpha",
    )
    for column in ("alpha", "band", "certified on", "false stable", "p", "false unstable", "verified"):
        out.add_column(column, justify="right")
    found = None
    for line in certificate.table:
        found = evaluate(boundary, line.band, inside, sample.ke, critical, unstable, distribution=NAME)
        certified = f"{line.errors} of {line.accepted:,}, {line.verified_share:.2%} verified"
        p = binomial_p_value(found.auto.false_stable, found.auto.answered_stable, line.alpha)
        band = f"{line.spreads:g}, {10**line.least_half_width - 1:.0%}"
        out.add_row(f"{line.alpha:g}", band, certified, *_cells(found.auto, f"{p:.1e}"))
        out.add_row("", "", "within 25 % of the boundary", *_cells(found.auto_hard, ""))
    if found is not None:
        out.add_section()
        out.add_row("", "none", "nothing", *_cells(found.alone, ""))
        out.add_row("", "", "within 25 % of the boundary", *_cells(found.alone_hard, ""))
        out.caption = (
            f"{out.caption}\nboundary error, surrogate alone: median {found.median_boundary_error:.4%}, "
            f"99 % {found.p99_boundary_error:.2%}; "
            f"wrong verdicts {_wrong(boundary.score(sample.ke), unstable):.4%}"
        )
    return out


def _wrong(score: np.ndarray, unstable: np.ndarray) -> float:
    return float(((score > 0) != unstable).mean())


def _cells(found: VerdictFigures, p: str) -> tuple[str, ...]:
    return (
        f"{found.false_stable} of {found.answered_stable:,} = {found.false_stable_rate:.1e}",
        p,
        f"{found.false_unstable} of {found.answered_unstable:,} = {found.false_unstable_rate:.1e}",
        f"{found.exact_share:.2%}",
    )

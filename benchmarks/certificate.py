"""What the certificate says beside what is observed on 200,000 points that nothing has seen before."""

from __future__ import annotations

import numpy as np
from rich.table import Table

from training.contact_class import PERMANENT
from training.evaluation import VerdictFigures, evaluate
from training.labelling import critical_kappa
from training.learn_then_test import binomial_p_value
from training.reference_space import NAME, reference_sample
from training.registry import load_model
from training.seeds import seed_for

# Of its own: training, calibration and the evaluation on the card have others.
SEED = seed_for("certificate benchmark", 2013)


def table(count: int = 200_000, seed: int = SEED) -> Table:
    """One line a rate, then the surrogate without verification; each also near the boundary."""
    model = load_model()
    certificate = model.certificate(PERMANENT)
    assert certificate is not None
    sample = reference_sample(count, seed)
    critical = critical_kappa(sample.cases, workers=2) * sample.cases.stiffness_scale
    boundary, inside = model.surrogate.boundary(sample.cases), model.design_space.contains(sample.cases)
    unstable = sample.ke > critical

    out = Table(
        title=f"model {model.id}: {count:,} points of {NAME}, {PERMANENT} contact, against the exact core",
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
        out.add_row(f"{line.alpha:g}", f"{line.spreads:g}", certified, *_cells(found.auto, f"{p:.1e}"))
        out.add_row("", "", "within 25 % of the boundary", *_cells(found.auto_hard, ""))
    if found is not None:
        out.add_section()
        out.add_row("", "none", "nothing", *_cells(found.alone, ""))
        out.add_row("", "", "within 25 % of the boundary", *_cells(found.alone_hard, ""))
        error = np.abs(10.0**boundary.log_ke / critical - 1)
        p50, p99 = np.quantile(error, [0.5, 0.99])
        out.caption = f"{out.caption}\nboundary error, surrogate alone: median {p50:.4%}, 99 % {p99:.2%}"
    return out


def _cells(found: VerdictFigures, p: str) -> tuple[str, ...]:
    return (
        f"{found.false_stable} of {found.answered_stable:,} = {found.false_stable_rate:.1e}",
        p,
        f"{found.false_unstable} of {found.answered_unstable:,} = {found.false_unstable_rate:.1e}",
        f"{found.exact_share:.2%}",
    )

"""Wrong verdicts of `policy: auto` on points that training never saw, blade by blade as users ask.

20,000 points of the reference design space, each its own blade, and maps of the two real blades
in three contacts; the truth is the exact core.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from rich.progress import track
from rich.table import Table

from sdm_core.blade import EXAMPLES, example_blade
from sdm_core.boundary import boundary, verdicts
from sdm_core.contact import ContactConfiguration
from training.answers import SURROGATE
from training.labelling import critical_kappa
from training.reference_space import reference_points, reference_sample
from training.screening import Screener

CONTACTS = (("LE",), ("TE",), ("LE", "TE"))


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    name: str
    policy: str
    stable: np.ndarray
    unstable_truth: np.ndarray
    from_surrogate: np.ndarray

    def cells(self) -> tuple[str, ...]:
        said_stable = self.from_surrogate & (self.stable == 1.0)
        said_unstable = self.from_surrogate & (self.stable == 0.0)
        false_stable = int((said_stable & self.unstable_truth).sum())
        false_unstable = int((said_unstable & ~self.unstable_truth).sum())
        return (
            self.name,
            self.policy,
            str(len(self.stable)),
            f"{false_stable} of {said_stable.sum()} = {false_stable / max(1, said_stable.sum()):.2e}",
            f"{false_unstable} of {said_unstable.sum()} = {false_unstable / max(1, said_unstable.sum()):.2e}",
            f"{1 - self.from_surrogate.mean():.2%}",
        )


def reference(screener: Screener, count: int, seed: int) -> tuple[list[Row], np.ndarray]:
    """Rows for the reference design space, and the relative errors of the first crossing."""
    sample = reference_sample(count, seed)
    critical = critical_kappa(sample.cases, workers=2) * sample.cases.stiffness_scale
    truth = sample.ke > critical
    near = np.abs(sample.ke / critical - 1) <= 0.25
    stable, source = np.empty(count), np.empty(count, dtype="<U9")
    for i, point in enumerate(track(reference_points(count, seed), "policy auto, point by point", count)):
        found = screener.points(
            point.blade(), point.contact(), np.array([point.speed_hz]), np.array([point.ke])
        )
        stable[i], source[i] = found.stable[0], found.source[0]
    assert screener.model is not None
    predicted = screener.model.surrogate.boundary(sample.cases)
    alone = (predicted.unstable_probability(sample.ke) < 0.5).astype(float)
    every = np.ones(count, dtype=bool)
    from_surrogate = source == SURROGATE
    rows = [
        Row("reference space", "auto", stable, truth, from_surrogate),
        Row("  within 25 % of the boundary", "auto", stable[near], truth[near], from_surrogate[near]),
        Row("reference space", "surrogate", alone, truth, every),
        Row("  within 25 % of the boundary", "surrogate", alone[near], truth[near], every[near]),
    ]
    return rows, np.abs(10.0**predicted.log_ke / critical - 1)


def real_blades(screener: Screener) -> tuple[list[Row], list[tuple[str, float]]]:
    """Rows for 200 × 200 maps of the real blades, and the median boundary error of each."""
    rows, errors = [], []
    for name in EXAMPLES:
        blade = example_blade(name)
        speed = np.linspace(0.06 * blade.first_frequency_hz, blade.speed_range_hz[1], 200)  # type: ignore[index]
        ke = np.linspace(0.0, 1e5, 200)
        for nodes in CONTACTS:
            contact = ContactConfiguration.at(*nodes)
            grid = [axis.ravel() for axis in np.meshgrid(speed, ke)]
            truth = verdicts(blade, contact, *grid) == 0.0
            label = f"{name}, {' and '.join(nodes)}"
            for policy in ("auto", "surrogate"):
                found = screener.map(blade, contact, speed, ke, policy)
                from_surrogate = found.source.ravel() == SURROGATE
                rows.append(Row(label, policy, found.stable.ravel(), truth, from_surrogate))
            exact = boundary(blade, contact, speed, 1e7).critical_ke
            surrogate = screener.boundary(blade, contact, speed, 1e7, "surrogate").critical_ke
            errors.append((label, float(np.nanmedian(np.abs(surrogate / exact - 1)))))
    return rows, errors


def table(count: int = 20_000, seed: int = 424_242) -> Table:
    """The whole measurement as a table."""
    screener = Screener.default()
    rows, error = reference(screener, count, seed)
    more, errors = real_blades(screener)
    out = Table(title=f"verdicts against the exact core (model {screener.model_id}, seed {seed})")
    for column in ("points of", "policy", "points", "false stable", "false unstable", "answered exactly"):
        out.add_column(column)
    for row in (*rows, *more):
        out.add_row(*row.cells())
    quantiles = np.quantile(error, [0.5, 0.9, 0.99])
    text = "boundary error of the surrogate alone, reference space: median {:.3%}, 90 % {:.2%}, 99 % {:.1%}"
    out.caption = "\n".join(
        [text.format(*quantiles), *(f"{label}: median {value:.3%}" for label, value in errors)]
    )
    return out

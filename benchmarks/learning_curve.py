"""What asking where the surrogate is unsure brings: at equally many labels, chosen or space-filling."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib
import numpy as np
from rich.table import Table

from training.active_learning import ActiveLearner
from training.contact_class import ARCS, PERMANENT, in_words
from training.design_space import DesignSpace
from training.fit import FitSettings, fit
from training.labelling import critical_kappa, point_verdicts
from training.learn_then_test import binomial_p_value
from training.reference_space import ReferenceSample, reference_sample
from training.seeds import seed_for
from training.surrogate import Surrogate

SIZES = (8_192, 16_384, 32_768)
RATES = (1e-3, 5e-4)
SETTINGS = replace(FitSettings(), epochs=15)
PICTURE = Path("docs/images/learning_curve.png")


@dataclass(frozen=True)
class Point:
    """A point of the curve in one class of contact.

    Attributes
    ----------
    wrong
        Share of wrong verdicts of the surrogate alone.
    verified
        Least share to verify, the least certain first, that proves each of `RATES` with 95 % confidence.
    """

    how: str
    labels: int
    contact: str
    wrong: float
    verified: tuple[float, ...]


def table(points: int = 40_000, workers: int = 2, picture: Path | None = PICTURE) -> Table:
    """Both curves, as a table and a picture."""
    unseen = {c: _unseen(c, points, workers) for c in (PERMANENT, ARCS)}
    curve = []
    for how, grow in (("space-filling", False), ("asked for", True)):
        learner = ActiveLearner(DesignSpace(), seed_for(f"learning curve, {how}", 1))
        for size in SIZES:
            if not grow:  # a space-filling sample of this size, not a row of smaller ones
                learner = ActiveLearner(DesignSpace(), seed_for("learning curve, space-filling", 1))
            cases = learner.ask(size - learner.labels)
            learner.tell(cases, critical_kappa(cases, workers=workers))
            surrogate = fit(*learner.labelled, SETTINGS, seed=1)
            learner.learnt(surrogate)
            for contact, (sample, unstable) in unseen.items():
                curve.append(_measured(how, learner.labels, contact, surrogate, sample, unstable))
                print(curve[-1], flush=True)
    if picture is not None:
        draw(curve, picture)
    return _table(curve, points)


def _unseen(contact: str, points: int, workers: int) -> tuple[ReferenceSample, np.ndarray]:
    sample = reference_sample(points, seed_for(f"learning curve, unseen, {contact}", 1), contact)
    return sample, point_verdicts(sample.cases, sample.ke, workers=workers) != 1.0


def _measured(
    how: str, labels: int, contact: str, surrogate: Surrogate, sample: ReferenceSample, unstable: np.ndarray
) -> Point:
    score = surrogate.boundary(sample.cases).score(sample.ke)
    wrong = float(((score > 0) != unstable).mean())
    return Point(how, labels, contact, wrong, tuple(share_to_verify(score, unstable, r) for r in RATES))


def share_to_verify(score: np.ndarray, unstable: np.ndarray, rate: float, confidence: float = 0.95) -> float:
    """Least share of points, the least certain first, to verify for a rate to be proven; NaN if none."""
    order = np.argsort(np.abs(score))
    for share in np.arange(0.0, 0.5, 0.001):
        kept = order[int(share * len(order)) :]
        stable = kept[score[kept] < 0]
        if binomial_p_value(int(unstable[stable].sum()), len(stable), rate) <= 1 - confidence:
            return float(share)
    return float("nan")


def _table(curve: list[Point], points: int) -> Table:
    out = Table(
        title=f"{SETTINGS.epochs} epochs; {points:,} unseen points of each class of contact",
        caption="to verify: least share of points, the least certain first, that proves the rate with 95 %",
    )
    for column in ("labels", "how", "contact", "wrong alone", *(f"to verify for {r:g}" for r in RATES)):
        out.add_column(column)
    for p in sorted(curve, key=lambda p: (p.contact, p.labels, p.how)):
        shares = (f"{share:.1%}" for share in p.verified)
        out.add_row(f"{p.labels:,}", p.how, in_words(p.contact), f"{p.wrong:.3%}", *shares)
    return out


def draw(curve: list[Point], path: Path) -> None:
    """The wrong share and the share to verify over the number of labels."""
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), sharex=True, layout="constrained")
    colour = {PERMANENT: "tab:blue", ARCS: "tab:orange"}
    for contact in (PERMANENT, ARCS):
        for how, style in (("space-filling", "--o"), ("asked for", "-s")):
            some = [p for p in curve if p.contact == contact and p.how == how]
            labels = [p.labels for p in some]
            name = f"{in_words(contact)}, {how}"
            axes[0].plot(labels, [100 * p.wrong for p in some], style, color=colour[contact], label=name)
            axes[1].plot(labels, [100 * p.verified[0] for p in some], style, color=colour[contact])
    axes[0].set_ylabel("wrong verdicts of the surrogate alone, %")
    axes[1].set_ylabel(f"to verify for a proven false-stable rate of {RATES[0]:g}, %")
    axes[0].set_yscale("log")
    axes[0].yaxis.set_major_formatter("{x:g}")
    axes[0].yaxis.set_minor_formatter("{x:.1g}")
    axes[0].legend(frameon=False)
    for a in axes:
        a.set_xscale("log", base=2)
        a.set_xticks(SIZES, [f"{s:,}" for s in SIZES])
        a.set_xlabel("labels of the exact core")
        a.grid(alpha=0.3)
    figure.savefig(path, dpi=110)

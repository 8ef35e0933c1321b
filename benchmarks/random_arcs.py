"""500 random blades with arcs: the batch against collocation, and its time against the dense product."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from rich.console import Console, Group
from rich.progress import track
from rich.table import Table
from threadpoolctl import threadpool_limits

from benchmarks.random_blades import random_rubbing_blade
from benchmarks.textbook import spectral_radius_with_arcs
from sdm_core.collocation import Collocation
from sdm_core.errors import TooMuchWork
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.parallel import available_cores
from sdm_core.rubbing_blade import RubbingBlade

POINTS, SEED = 500, 7
ROUNDS, DENSE_A_ROUND = 5, 20
ORDER = 32
ON_CIRCLE = 1e-9


@dataclass(frozen=True)
class Accuracy:
    """The batch against collocation of twice the order.

    Attributes
    ----------
    error, own_error
        Largest relative difference of |μ| to collocation of order 2p, and of order p to 2p.
    unknown
        Points that collocation could not answer.
    """

    judged: int
    unknown: int
    error: float
    own_error: float
    wrong_verdicts: int
    wrong_counts: int
    undecided: int
    undecided_counts: int


def accuracy(problems: list[RubbingBlade]) -> Accuracy:
    """|μ|, verdict and number of unstable multipliers of each point."""
    ours = batch_multipliers(problems)
    modulus, stable = np.abs(ours.multiplier), ours.stable
    error = own = 0.0
    verdicts = counts = unknown = judged = 0
    for i, problem in enumerate(track(problems, "collocation", transient=True)):
        coarse, fine = Collocation(ORDER), Collocation(ORDER).doubled()
        try:
            truth = fine.multipliers(problem.delay_equation(), max(12, int(ours.outside[i]) + 4))
            before = coarse.multipliers(problem.delay_equation(), 2)
        except TooMuchWork:
            unknown += 1
            continue
        judged += 1
        largest = np.abs(truth).max()
        own = max(own, abs(np.abs(before).max() / largest - 1))
        error = max(error, abs(modulus[i] / largest - 1))
        if abs(largest - 1) > ON_CIRCLE:
            verdicts += bool(not np.isnan(stable[i]) and stable[i] != (largest < 1))
            counts += bool(ours.outside[i] >= 0 and ours.outside[i] != (np.abs(truth) > 1).sum())
    undecided = int(np.isnan(stable).sum())
    return Accuracy(judged, unknown, error, own, verdicts, counts, undecided, int((ours.outside < 0).sum()))


def speed(problems: list[RubbingBlade]) -> dict[str, np.ndarray]:
    """Seconds a point of each method, shape (ROUNDS,), in turns."""
    cores = available_cores()
    batch_multipliers(problems)
    out: dict[str, list[float]] = {"one": [], "all": [], "dense": []}
    for k in track(range(ROUNDS), "speed", transient=True):
        for name, workers in (("one", 1), ("all", cores)):
            start = time.perf_counter()
            batch_multipliers(problems, workers=workers)
            out[name].append((time.perf_counter() - start) / len(problems))
        start = time.perf_counter()
        part = problems[k::ROUNDS][:DENSE_A_ROUND]
        for p in part:
            assert p.arcs is not None
            spectral_radius_with_arcs(p.omega, p.damping_ratio, p.contact_matrix, p.speed_hz, p.ke, p.arcs)
        out["dense"].append((time.perf_counter() - start) / len(part))
    return {name: np.array(values) for name, values in out.items()}


def table() -> Group:
    """What was measured, on one thread but where cores are named."""
    rng = np.random.default_rng(SEED)
    problems = [random_rubbing_blade(rng) for _ in range(POINTS)]
    with threadpool_limits(1):
        taken, found = speed(problems), accuracy(problems)
    right = Table(title=f"{POINTS} random points with 1 to 4 arcs against collocation of order {2 * ORDER}")
    for name in ("judged", "largest error of |μ|", f"order {ORDER} against it", "wrong verdicts",
                 "wrong counts", "verdicts undecided", "counts undecided"):  # fmt: skip
        right.add_column(name, justify="right")
    right.add_row(
        f"{found.judged}",
        f"{found.error:.1e}",
        f"{found.own_error:.1e}",
        str(found.wrong_verdicts),
        str(found.wrong_counts),
        str(found.undecided),
        str(found.undecided_counts),
    )
    fast = Table(
        title=f"Time a point, median of {ROUNDS} rounds in turns; ratio to the dense product at N = 60"
    )
    for name in ("method", "ms a point", "times faster", "smallest", "largest"):
        fast.add_column(name, justify="right")
    names = {
        "one": "batch, one process",
        "all": f"batch, {available_cores()} processes",
        "dense": "dense product",
    }
    for key, name in names.items():
        ratio = taken["dense"] / taken[key]
        fast.add_row(
            name,
            f"{1e3 * np.median(taken[key]):.3g}",
            f"{np.median(ratio):.3g}",
            f"{ratio.min():.3g}",
            f"{ratio.max():.3g}",
        )
    return Group(right, fast)


def main() -> None:
    """Measure and print."""
    Console(width=150).print(table())


if __name__ == "__main__":
    main()

"""`make bench ARGS=witness`: random points, the exact core against integration in time.

Half in permanent contact, half with arcs, each at least 1 % in K_e off the boundary. The two share no
discretization: `sdm_core.time_domain` integrates the equation of motion and knows no characteristic equation.
"""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.console import Console, Group
from rich.progress import track
from rich.table import Table
from threadpoolctl import threadpool_limits

from benchmarks.random_blades import random_rubbing_blade
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.stability import stability
from sdm_core.time_domain.witness import time_witness

POINTS, SEED, OFF = 200, 7, 0.01
KEPT = Path("out/bench/time_witness.json")


@dataclass(frozen=True)
class Compared:
    """One point, both answers.

    Attributes
    ----------
    radius_difference, chatter_difference
        Of |μ| and of the chatter frequency, relative; the nearest of nearly equal multipliers' frequencies.
    error_estimate
        That of the witness.
    """

    contact: str
    modes: int
    speed_ratio: float
    stable: bool | None
    same_verdict: bool
    spectral_radius: float
    radius_difference: float
    chatter_difference: float
    nearly_equal: int
    error_estimate: float
    exact_s: float
    witness_s: float


def points(count: int, seed: int) -> list[RubbingBlade]:
    """Points off the boundary: the verdict is the same with K_e 1 % smaller and larger."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        problem = random_rubbing_blade(rng, arcs=len(found) % 2 == 1)
        near = [stability(problem.with_ke(problem.ke * factor)).stable for factor in (1 - OFF, 1.0, 1 + OFF)]
        if None not in near and len(set(near)) == 1:
            found.append(problem)
    return found


def compared(problem: RubbingBlade) -> Compared:
    """Ask both."""
    began = time.perf_counter()
    exact = stability(problem)
    between = time.perf_counter()
    witness = time_witness(problem)
    end = time.perf_counter()
    frequencies = [witness.chatter_hz, *(hz for _, hz in witness.nearly_equal)]
    return Compared(
        "permanent" if problem.permanent else "arcs",
        len(problem.omega),
        problem.speed_hz / float(problem.omega[0] / (2 * np.pi)),
        exact.stable,
        exact.stable == witness.stable,
        exact.spectral_radius,
        abs(witness.spectral_radius - exact.spectral_radius) / exact.spectral_radius,
        float(np.nanmin(np.abs(np.array(frequencies) / exact.chatter_hz - 1))),
        len(witness.nearly_equal),
        witness.error_estimate / witness.spectral_radius,
        between - began,
        end - between,
    )


def table(count: int = POINTS, seed: int = SEED) -> Group:
    """What `make bench ARGS=witness` prints; every point goes to out/bench/time_witness.json."""
    with threadpool_limits(1):
        drawn = points(count, seed)
        time_witness(drawn[0])  # compiled before the clock runs
        found = [compared(problem) for problem in track(drawn, "integrating")]
    out = Table("contact", "points", "stable", "same verdict", "|μ| differs by", "chatter by", "pairs named")
    for contact in ("permanent", "arcs"):
        of = [c for c in found if c.contact == contact]
        out.add_row(
            contact,
            str(len(of)),
            str(sum(c.stable is True for c in of)),
            str(sum(c.same_verdict for c in of)),
            f"{max(c.radius_difference for c in of):.1e}",
            f"{max(c.chatter_difference for c in of):.1e}",
            str(sum(c.nearly_equal > 0 for c in of)),
        )
    KEPT.parent.mkdir(parents=True, exist_ok=True)
    KEPT.write_text(json.dumps([asdict(c) for c in found], indent=1))
    exact, witness = (np.array([getattr(c, f"{who}_s") for c in found]) for who in ("exact", "witness"))
    return Group(
        out,
        f"a point: exact core {np.median(exact) * 1e3:.1f} ms (largest {exact.max():.2f} s), "
        f"integration {np.median(witness) * 1e3:.0f} ms (largest {witness.max():.1f} s)",
    )


if __name__ == "__main__":
    Console().print(table())

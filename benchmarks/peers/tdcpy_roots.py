"""tdcpy: characteristic roots of a delay equation with constant coefficients (Wu and Michiels 2012)."""

from __future__ import annotations

import logging

import numpy as np
import tdcpy

from benchmarks.named_charts import Chart
from benchmarks.peers.methods import Answer
from sdm_core.rubbing_blade import RubbingBlade


class TdcpyRoots:
    """`tdcpy.roots` in the right half-plane: unstable where there is one, μ = e^{sτ} of the rightmost.

    Time is counted in delays: in seconds the discretization it chooses is too coarse where τ is far
    from 1 s, and unstable points were called stable. `tdcpy.spectral_abscissa` would give |μ| of
    stable points as well, but it returns an eigenvalue of the discretization there, or a singular value,
    not a root.
    """

    name = "tdcpy"
    most_points = 200

    def __init__(self) -> None:
        logging.getLogger("tdcpy").setLevel(logging.ERROR)  # a line at every second point

    def cannot(self, chart: Chart) -> str:
        return "" if chart.contact.permanent else "constant coefficients only"

    def prepare(self, chart: Chart) -> None: ...

    def answer(self, problem: RubbingBlade) -> Answer:
        equation = problem.delay_equation()
        matrices = np.stack([equation.a.constant, equation.b.constant], axis=2) * equation.tau
        roots, _ = tdcpy.roots(tdcpy.RDDE(A=matrices, hA=np.array([0.0, 1.0])), r=0.0)
        if not len(roots):
            return Answer(False, np.nan)
        return Answer(True, float(np.exp(roots.real.max())))

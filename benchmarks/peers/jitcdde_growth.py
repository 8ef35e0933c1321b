"""jitcdde: the response integrated in time, compiled to C (Bogacki and Shampine 3(2), Hermite past)."""

from __future__ import annotations

import shutil

import numpy as np
import symengine
from jitcdde import jitcdde, t, y
from jitcxde_common import conditional

from benchmarks.named_charts import Chart
from benchmarks.peers.methods import Answer
from sdm_core.rubbing_blade import RubbingBlade


class JitcddeGrowth:
    """|μ| as the growth of the response per revolution, from a random start.

    Time is counted in revolutions, velocities in ω. Arcs are jitcdde's own smoothed step
    (`conditional`), on which its step control works. The norm over each revolution is kept, and its
    logarithm fitted over the second half of the response, which ends when it has changed by a factor of 1e8.
    """

    name = "jitcdde"
    most_points = 100
    revolutions = 60
    samples = 64  # a revolution
    relative_tolerance = 1e-6
    width = 1e-5  # of the smoothed step

    def cannot(self, chart: Chart) -> str:
        return "" if shutil.which("cc") else "needs a C compiler"

    def prepare(self, chart: Chart) -> None:
        """Compile the equation of the chart; each point only sets parameters."""
        n = len(chart.blade.states[0].frequency_hz)
        omega = symengine.symbols(f"omega:{n}")
        damping = symengine.symbols(f"damping:{n}")
        force = symengine.symbols(f"force:{n * n}")
        engaged = self._engaged(chart)
        rates = {}
        for j in range(n):
            pushed = sum(force[j * n + k] * (y(k, t - 1) - y(k)) for k in range(n))
            rates[y(j)] = omega[j] * y(n + j)
            rates[y(n + j)] = -omega[j] * y(j) - damping[j] * y(n + j) + engaged * pushed
        parameters = [*omega, *damping, *force]
        self._equation = jitcdde(rates, control_pars=parameters, delays=[0, 1], max_delay=1, verbose=False)
        self._equation.compile_C(simplify=False)
        self._size = 2 * n

    def answer(self, problem: RubbingBlade) -> Answer:
        radius = self._growth(self._norms(problem))
        return Answer(radius > 1.0, radius)

    def _norms(self, problem: RubbingBlade) -> np.ndarray:
        """ln of the norm of the state over each revolution."""
        turn = problem.omega * problem.tau
        force = problem.ke * problem.contact_matrix * problem.tau / problem.omega[:, None]
        equation = self._equation
        equation.purge_past()
        equation.set_integration_parameters(
            rtol=self.relative_tolerance, atol=1e-14, first_step=1e-3, max_step=0.1, min_step=1e-14
        )
        equation.constant_past(np.random.default_rng(0).standard_normal(self._size))
        equation.set_parameters(*turn, *(2 * problem.damping_ratio * turn), *force.ravel())
        equation.step_on_discontinuities(propagations=1)
        start, norms = equation.t, []
        for revolution in range(self.revolutions):
            times = start + revolution + np.arange(1, self.samples + 1) / self.samples
            norms.append(np.log(np.linalg.norm([equation.integrate(time) for time in times])))
            if abs(norms[-1] - norms[0]) > np.log(1e8) and revolution >= 4:
                break
        return np.array(norms)

    def _growth(self, norms: np.ndarray) -> float:
        late = np.arange(len(norms) // 2, len(norms))
        return float(np.exp(np.polyfit(late, norms[late], 1)[0]))

    def _engaged(self, chart: Chart) -> symengine.Expr:
        """γ(t): t lies in an arc where cos 2π(t − middle) is above its value at the ends."""
        if chart.contact.permanent:
            return symengine.Integer(1)
        return sum(
            conditional(
                -symengine.cos(2 * symengine.pi * (t - (a + b) / 2)),
                -np.cos(np.pi * (b - a)),
                1,
                0,
                self.width,
            )
            for a, b in chart.contact.arcs
        )

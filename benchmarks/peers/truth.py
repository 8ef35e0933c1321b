"""What every method is judged by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from rich.progress import track

from benchmarks.named_charts import Chart
from sdm_core.collocation import Collocation
from sdm_core.floquet.characteristic import CharacteristicEquation
from sdm_core.permanent_contact.receptance import ContactReceptance
from sdm_core.permanent_contact.root_count import unstable_root_count
from sdm_core.rubbing_blade import RubbingBlade


@dataclass(frozen=True)
class Truth:
    """Counted verdicts, and |μ| from collocation, which shares nothing with any method compared.

    Attributes
    ----------
    unstable
        1.0, 0.0, or NaN where it is not known: all points of a chart in permanent contact, by the root
        count; with arcs the sample only, by the argument principle on the characteristic equation.
    sample
        Indices of the points at which |μ| is known.
    radius
        |μ| there.
    """

    unstable: np.ndarray
    sample: np.ndarray
    radius: np.ndarray

    @property
    def disagreements(self) -> int:
        """Verdicts of the sample on which count and collocation differ."""
        return int(((self.radius > 1.0) != (self.unstable[self.sample] == 1.0)).sum())


def truth(chart: Chart, sample: np.ndarray) -> Truth:
    """The truth of a chart."""
    witness = Collocation()
    radius = np.array(
        [
            abs(witness.multipliers(chart.problem(i), 1)[0])
            for i in track(sample, f"{chart.name}: truth", transient=True)
        ]
    )
    return Truth(_counted(chart, sample), sample, radius)


def _counted(chart: Chart, sample: np.ndarray) -> np.ndarray:
    unstable = np.full(len(chart), np.nan)
    if not chart.contact.permanent:
        for i in sample:
            count = CharacteristicEquation(chart.problem(i)).count_outside()
            unstable[i] = np.nan if count is None else float(count > 0)
        return unstable
    for speed in np.unique(chart.speed_hz):
        members = np.flatnonzero(chart.speed_hz == speed)
        problem = RubbingBlade.from_blade(chart.blade, chart.contact, float(speed), 0.0)
        receptance = ContactReceptance(problem.omega, problem.damping_ratio, problem.contact_factor)
        count = unstable_root_count(receptance, float(speed), chart.ke[members])
        unstable[members] = np.where(np.isnan(count), np.nan, count > 0)
    return unstable

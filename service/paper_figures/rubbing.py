"""The rubs behind [SBL] Figs. 11, 12 and 14: one blade in an oval casing, at many speeds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sdm_core.blade import Blade
from sdm_core.time_domain.liner.central_differences import CentralDifferences
from sdm_core.time_domain.liner.simulation import LinerRub
from sdm_core.time_domain.liner.speed_sweep import SpeedSweep, sweep_speeds
from service.paper_figures.study import Study
from service.simulation.constants import USUAL_KE, CasingConstants, LinerConstants

REVOLUTIONS = 50
"""[SBL] 5.1."""
SPEEDS, CELLS, ANGLES, LINES = 200, 4000, 500, 801
HIGHEST_FREQUENCY = 6.0
"""Of the spectra, over f₁; [SBL] Fig. 14 sees nothing above 5."""

KE = USUAL_KE
# [SBL] gives none of these: they are what `rubscreen simulate` takes where nothing is said.
ASSUMED = (
    f"assumed, for the paper gives none: K_e = {KE:,.0f} N/m, E = 1.8 GPa, σ_Y = 15 MPa, liner 5 mm thick, "
    "3.4 mm² under a node, two casing lobes of 0.2 mm grown in five revolutions, 0.1 mm of clearance"
)

Done = Callable[[], None]


@dataclass(frozen=True)
class Rubs:
    """The sweeps of one blade, each made once, when it is asked for."""

    study: Study
    done: Done = lambda: None

    @cached_property
    def leading_edge(self) -> SpeedSweep:
        """Contact at the leading edge alone."""
        return self._swept((self.study.blade.tip_nodes[0],))

    @cached_property
    def trailing_edge(self) -> SpeedSweep:
        """Contact at the trailing edge alone."""
        return self._swept((self.study.blade.tip_nodes[-1],))

    @cached_property
    def both_edges(self) -> SpeedSweep:
        """Contact at both, spectra of the leading edge."""
        return self._swept((self.study.blade.tip_nodes[0], self.study.blade.tip_nodes[-1]))

    def _swept(self, nodes: tuple[str, ...]) -> SpeedSweep:
        blade = self.study.blade
        f1 = self.study.first_frequency_hz
        speed = np.linspace(*self.study.ratios, SPEEDS) * f1
        return sweep_speeds(
            rub(blade, nodes),
            speed,
            REVOLUTIONS,
            CentralDifferences(CELLS),
            frequency_hz=np.linspace(0.0, HIGHEST_FREQUENCY * f1, LINES),
            extrapolate=True,
            progress=lambda done, total: self.done(),
        )


def rub(blade: Blade, nodes: tuple[str, ...], ke: float = KE) -> LinerRub:
    """One blade in the oval casing."""
    return LinerRub(blade, nodes, LinerConstants(ke).liner(), CasingConstants().casing(blade))

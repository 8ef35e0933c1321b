"""What the exact core answered while serving, for whoever wants to learn from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration

# At K_e: stable, or unstable, or the first crossing, or none up to there.
STABLE, UNSTABLE, CROSSING, NO_CROSSING = range(4)


@dataclass(frozen=True)
class ExactAnswers:
    """Exact answers about one blade in one contact.

    Attributes
    ----------
    speed_hz, ke
        Hz and N/m, shape (m,) each.
    finding
        `STABLE`, `UNSTABLE`, `CROSSING` or `NO_CROSSING`, shape (m,).
    """

    blade: Blade
    contact: ContactConfiguration
    speed_hz: np.ndarray
    ke: np.ndarray
    finding: np.ndarray

    def __len__(self) -> int:
        return len(self.speed_hz)

    @classmethod
    def from_verdicts(
        cls,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray,
        stable: np.ndarray,
    ) -> ExactAnswers:
        """From verdicts 1.0 and 0.0.

        Left out are the undecided (NaN), and K_e = 0, where every blade is stable.
        """
        said = np.isfinite(stable) & (ke > 0)
        finding = np.where(stable[said] == 1.0, STABLE, UNSTABLE)
        return cls(blade, contact, speed_hz[said], ke[said], finding)

    @classmethod
    def from_crossings(
        cls,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        critical_ke: np.ndarray,
        ke_max: float,
    ) -> ExactAnswers:
        """From first crossings, NaN where there is none up to `ke_max`."""
        crossed = np.isfinite(critical_ke)
        finding = np.where(crossed, CROSSING, NO_CROSSING)
        return cls(blade, contact, speed_hz, np.where(crossed, critical_ke, ke_max), finding)

    def brackets(self) -> ExactAnswers:
        """What bears on the first crossing at each speed.

        Of the verdicts that is the lowest K_e found unstable, and the highest found stable below it; a map
        has hundreds of others in each column that say nothing more.
        """
        kept = np.isin(self.finding, (CROSSING, NO_CROSSING))
        speeds, which = np.unique(self.speed_hz, return_inverse=True)
        unstable, stable = self.finding == UNSTABLE, self.finding == STABLE
        lowest = np.full(len(speeds), np.inf)
        np.minimum.at(lowest, which[unstable], self.ke[unstable])
        below = stable & (self.ke < lowest[which])
        highest = np.full(len(speeds), -np.inf)
        np.maximum.at(highest, which[below], self.ke[below])
        kept |= (unstable & (self.ke == lowest[which])) | (below & (self.ke == highest[which]))
        return ExactAnswers(self.blade, self.contact, self.speed_hz[kept], self.ke[kept], self.finding[kept])

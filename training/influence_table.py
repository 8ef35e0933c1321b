"""Derivatives of the first crossing as one table, whoever they come from."""

from __future__ import annotations

import numpy as np

from sdm_core.blade import Blade
from sdm_core.blade_sensitivity import Influence, boundary_sensitivities, influences_of
from sdm_core.contact import ContactConfiguration
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.sensitivity import Gradient
from training.answers import SensitivityAnswers
from training.boundary_gradient import boundary_gradients
from training.doubt import FirstCrossings
from training.surrogate import Surrogate
from training.verification_band import FIVE_PERCENT

# A gradient goes to the exact core (decision 15) where the network adds more than this to the
# gradient of the lobe it corrects, or two lobes lie within 5 %.
LARGEST_LEARNED_SHARE = 0.05
LEAST_LOBE_GAP = FIVE_PERCENT


class InfluenceTable:
    """First crossings at m speeds, and the p parameters that move them.

    Parameters
    ----------
    blade, contact, speed_hz
        The question; speeds in Hz, shape (m,).
    decided
        What the surrogate says of the crossings. Rows given to `solve` are replaced.
    """

    def __init__(
        self, blade: Blade, contact: ContactConfiguration, speed_hz: np.ndarray, decided: FirstCrossings
    ) -> None:
        self._blade, self._contact, self._speed_hz, self._decided = blade, contact, speed_hz, decided
        self._critical, self._error = decided.critical_ke.copy(), decided.error_estimate.copy()
        self._chatter = np.full(len(speed_hz), np.nan)
        self._problems = RubbingBlade.at_speeds(blade, contact, speed_hz)
        self._rows: dict[int, tuple[Influence, ...]] = {}

    def predict(self, surrogate: Surrogate, rows: np.ndarray) -> np.ndarray:
        """Have the surrogate answer these speeds, a mask; nothing changes where it sees no crossing.

        Returns
        -------
        Which of its gradients it is not sure of, shape (m,).
        """
        doubtful = np.zeros(len(self._speed_hz), dtype=bool)
        at = np.flatnonzero(rows & ~np.isnan(self._critical))
        if len(at) == 0:
            return doubtful
        found = boundary_gradients(surrogate, self._blade, self._contact, self._speed_hz[at])
        for i, ke, gradient in zip(at.tolist(), found.critical_ke, found.gradients, strict=True):
            self._rows[i] = self._influences(i, gradient, float(ke))
        doubtful[at] = ~(found.learned_share <= LARGEST_LEARNED_SHARE) | (found.lobe_gap < LEAST_LOBE_GAP)
        return doubtful

    def solve(self, rows: np.ndarray, ke_max: float) -> np.ndarray:
        """Have the exact core answer these speeds, a mask of shape (m,); their critical K_e, N/m."""
        found = boundary_sensitivities(self._blade, self._contact, self._speed_hz[rows], ke_max)
        for i, each in zip(np.flatnonzero(rows).tolist(), found, strict=True):
            self._critical[i], self._error[i] = each.value, each.error_estimate
            self._chatter[i], self._rows[i] = each.chatter_hz, each.influences
        return self._critical[rows]

    def answers(
        self, ke_max: float, source: np.ndarray, model: str | None, solver: str
    ) -> SensitivityAnswers:
        """The table."""
        nothing = Gradient.unknown(self._problems[0])
        rows = [
            self._rows[i] if i in self._rows else self._influences(i, nothing, np.nan)
            for i in range(len(self._speed_hz))
        ]
        numbers = np.array([[(each.value, each.derivative, each.relative) for each in row] for row in rows])
        value, derivative, relative = np.moveaxis(numbers, 2, 0)
        return SensitivityAnswers(
            self._speed_hz,
            ke_max,
            self._critical,
            self._chatter,
            self._error,
            tuple(each.parameter for each in rows[0]),
            tuple(each.unit for each in rows[0]),
            value,
            derivative,
            relative,
            source,
            self._decided.reason,
            model,
            solver,
            self._decided.certificate,
        )

    def _influences(self, i: int, gradient: Gradient, ke: float) -> tuple[Influence, ...]:
        return tuple(influences_of(self._problems[i], self._blade, self._contact, gradient, ke))

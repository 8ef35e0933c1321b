"""Semi-discretization with the number of steps chosen until the answer has converged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.delay_equation import DelayEquation
from sdm_core.semi_discretization.dense import Averaged

ORDER = 2  # of the averaged scheme in the step


@dataclass(frozen=True)
class ConvergedMultiplier:
    """Dominant multiplier with what is known of its error.

    Attributes
    ----------
    multiplier
        μ, extrapolated to a vanishing step.
    error_estimate
        Relative error of |μ|.
    steps
        Steps per revolution of the finest solution.
    converged
        Whether the estimate is within the tolerance asked for.
    """

    multiplier: complex
    error_estimate: float
    steps: int
    converged: bool


@dataclass(frozen=True)
class Converged:
    """Doubles the steps until Richardson's extrapolations agree to the tolerance.

    With an error c·N⁻² the extrapolation (4μ_{2N} − μ_N)/3 removes the leading term; the estimate
    is the change from the last extrapolation to this one, or a quarter of the one before. The
    leading few multipliers are extrapolated side by side, because the largest at a coarse step
    need not be the largest.

    Parameters
    ----------
    tolerance
        Relative error of |μ| asked for.
    first_steps
        N to start from.
    largest_state
        Bound on the rows of the monodromy matrix; when it stops the refinement the answer says
        that it has not converged.
    """

    tolerance: float = 1e-4
    first_steps: int = 20
    largest_state: int = 2000

    def dominant(self, equation: DelayEquation) -> ConvergedMultiplier:
        """Dominant multiplier of the equation."""
        # No oscillation may fall between two steps.
        mean_a, _ = equation.means(np.zeros(1), np.full(1, equation.tau))
        fastest = float(np.abs(np.linalg.eigvals(mean_a[0]).imag).max()) * equation.tau / (2 * np.pi)
        steps = max(self.first_steps, 4 * int(np.ceil(min(fastest, self.largest_state))))
        spectra: list[np.ndarray] = []
        answer = ConvergedMultiplier(complex(np.nan, np.nan), np.inf, 0, False)
        while Averaged(steps).state_size(equation) <= self.largest_state:
            spectra.append(_leading(Averaged(steps).multipliers(equation)))
            answer = self._extrapolated(spectra, steps)
            if answer.converged:
                break
            steps *= 2
        return answer

    def _extrapolated(self, spectra: list[np.ndarray], steps: int) -> ConvergedMultiplier:
        fine = spectra[-1]
        if len(spectra) < 4:
            return ConvergedMultiplier(complex(fine[0]), np.inf, steps, False)
        middle = _nearest(fine, spectra[-2])
        coarse = _nearest(middle, spectra[-3])
        coarsest = _nearest(coarse, spectra[-4])
        better = _richardson(fine, middle)
        change = np.abs(better - _richardson(middle, coarse))
        # Where arcs end between two steps the error does not fall smoothly, and one small change may
        # be chance: the change before it counts too, at the rate of the scheme.
        before = np.abs(_richardson(middle, coarse) - _richardson(coarse, coarsest))
        change = np.maximum(change, before / 2**ORDER)
        slow = np.abs(middle - coarse) < 2 * np.abs(fine - middle)  # not yet falling as N⁻²
        change = np.where(slow, np.maximum(change, np.abs(fine - middle)), change)
        best = int(np.argmax(np.abs(better)))
        # What any of the others may still gain counts against the answer.
        rival = np.max(np.abs(better) + np.where(slow, change, 0.0)) - np.abs(better[best])
        estimate = float(max(change[best], rival) / max(np.abs(better[best]), 1e-300))
        return ConvergedMultiplier(complex(better[best]), estimate, steps, estimate <= self.tolerance)


def _richardson(fine: np.ndarray, coarse: np.ndarray) -> np.ndarray:
    return fine + (fine - coarse) / (2**ORDER - 1)


def _leading(mu: np.ndarray, most: int = 10) -> np.ndarray:
    """The largest multipliers of the upper half-plane."""
    upper = mu[mu.imag >= -1e-14 * np.abs(mu)]
    return upper[:most]


def _nearest(mu: np.ndarray, candidates: np.ndarray) -> np.ndarray:
    """For each multiplier the nearest of another spectrum."""
    return candidates[np.argmin(np.abs(mu[:, None] - candidates[None, :]), axis=1)]

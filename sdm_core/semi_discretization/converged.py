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
    is the change from the last extrapolation to this one, and never less than what the observed
    ratio of successive changes supports.

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
        # Neither an oscillation nor a switch of the coefficients may fall between two steps.
        mean_a, _ = equation.means(np.zeros(1), np.full(1, equation.tau))
        fastest = float(np.abs(np.linalg.eigvals(mean_a[0]).imag).max()) * equation.tau / (2 * np.pi)
        steps = max(self.first_steps, 2 * int(np.ceil(fastest)))
        raw: list[complex] = []
        better: list[complex] = []
        while True:
            method = Averaged(steps)
            if raw and method.state_size(equation) > self.largest_state:
                break
            if method.state_size(equation) > 2 * self.largest_state:
                return ConvergedMultiplier(complex(np.nan, np.nan), np.inf, 0, False)
            mu = method.multipliers(equation)
            raw.append(_closest(mu, raw[-1]) if raw else _upper(mu[0]))
            if len(raw) > 1:
                better.append(raw[-1] + (raw[-1] - raw[-2]) / (2**ORDER - 1))
            if len(better) > 1:
                estimate = self._estimate(raw, better)
                if estimate <= self.tolerance:
                    return ConvergedMultiplier(better[-1], estimate, steps, True)
            steps *= 2
        best = better[-1] if better else raw[-1]
        estimate = self._estimate(raw, better) if len(better) > 1 else np.inf
        return ConvergedMultiplier(best, estimate, steps // 2, False)

    @staticmethod
    def _estimate(raw: list[complex], better: list[complex]) -> float:
        change = abs(better[-1] - better[-2])
        ratio = abs(raw[-2] - raw[-3]) / max(abs(raw[-1] - raw[-2]), 1e-300)
        if ratio < 2:  # not yet in the regime that extrapolation needs
            change = max(change, abs(raw[-1] - raw[-2]))
        return change / max(abs(better[-1]), 1e-300)


def _upper(mu: complex) -> complex:
    return complex(mu.real, abs(mu.imag))


def _closest(mu: np.ndarray, previous: complex) -> complex:
    """The dominant multiplier of the finer solution, followed within a group of equal modulus."""
    rivals = mu[np.abs(mu) >= abs(mu[0]) * (1 - 1e-6)]
    rivals = np.array([_upper(m) for m in rivals])
    return complex(rivals[np.argmin(np.abs(rivals - previous))])

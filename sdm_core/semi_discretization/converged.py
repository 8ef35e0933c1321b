"""Semi-discretization with the number of steps chosen until the answer has converged."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sdm_core.delay_equation import DelayEquation
from sdm_core.errors import InvalidInput, TooMuchWork
from sdm_core.semi_discretization.averaged import StructuredAveraged
from sdm_core.semi_discretization.structured import Structured
from sdm_core.validation import number

_FOLLOWED = 20  # multipliers of both half-planes
_AVERAGED = StructuredAveraged(aligned=True)


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
    leading, leading_error
        The largest ones of the upper half-plane and the relative errors of their moduli.
    """

    multiplier: complex
    error_estimate: float
    steps: int
    converged: bool
    leading: tuple[complex, ...] = ()
    leading_error: tuple[float, ...] = ()

    @property
    def outside(self) -> int | None:
        """Multipliers outside the circle; None where one may lie on it, or all that are known are outside."""
        modulus = np.abs(self.leading)
        if not self.converged or not (modulus < 1).any():
            return None
        unsure = np.abs(modulus - 1) <= np.array(self.leading_error) * modulus
        each = np.where(np.abs(np.imag(self.leading)) > 0, 2, 1)
        return None if unsure.any() else int(((modulus > 1) * each).sum())


@dataclass(frozen=True)
class Converged:
    """Doubles the steps until Richardson's extrapolations agree to the tolerance.

    With an error c·N⁻ᵖ the extrapolation (2ᵖμ_{2N} − μ_N)/(2ᵖ − 1) removes the leading term; the
    estimate is the change from the last extrapolation to this one, or 2⁻ᵖ of the one before. The
    leading few multipliers are extrapolated side by side, because the largest at a coarse step
    need not be the largest.

    Parameters
    ----------
    tolerance
        Relative error of |μ| asked for.
    first_steps
        N to start from.
    largest_state
        Bound on the entries of the discrete state; when it stops the refinement the answer says
        that it has not converged.
    scheme
        What is refined; its own number of steps does not matter.
    """

    tolerance: float = 1e-4
    first_steps: int = 20
    largest_state: int = 100_000
    scheme: Structured = _AVERAGED

    def __post_init__(self) -> None:
        number("tolerance", self.tolerance, 1e-14, 1.0, "of |μ|")
        for name in ("first_steps", "largest_state"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < 2:
                raise InvalidInput(name, value, "give a whole number from 2 up")
        if not isinstance(self.scheme, Structured):
            raise InvalidInput(
                "scheme", type(self.scheme).__name__, "give StructuredAveraged, Linear or Gauss, as an object"
            )

    def dominant(self, equation: DelayEquation) -> ConvergedMultiplier:
        """Dominant multiplier of the equation."""
        # No oscillation may fall between two steps; those of high order hold more of one.
        mean_a, _ = equation.means(np.zeros(1), np.full(1, equation.tau))
        fastest = float(np.abs(np.linalg.eigvals(mean_a[0]).imag).max()) * equation.tau / (2 * np.pi)
        oscillations = int(np.ceil(min(fastest, self.largest_state)))
        steps = max(self.first_steps, -(-8 * oscillations // self.scheme.order))
        spectra: list[np.ndarray] = []
        answer = ConvergedMultiplier(complex(np.nan, np.nan), np.inf, 0, False)
        while not answer.converged:
            scheme = replace(self.scheme, steps=steps)
            try:
                if scheme.state_size(equation) > self.largest_state:
                    break
                spectra.append(_leading(scheme.multipliers(equation, _FOLLOWED)))
            except TooMuchWork:
                break
            answer = self._extrapolated(spectra, steps)
            steps *= 2
        return answer

    def _extrapolated(self, spectra: list[np.ndarray], steps: int) -> ConvergedMultiplier:
        fine, falls = spectra[-1], 2**self.scheme.order
        if len(spectra) < 4:
            return ConvergedMultiplier(complex(fine[0]), np.inf, steps, False)
        middle = _nearest(fine, spectra[-2])
        coarse = _nearest(middle, spectra[-3])
        coarsest = _nearest(coarse, spectra[-4])
        better = _richardson(fine, middle, falls)
        change = np.abs(better - _richardson(middle, coarse, falls))
        # Where coefficients jump inside a step the error does not fall smoothly, and one small change may
        # be chance: the change before it counts too, at the rate of the scheme.
        before = np.abs(_richardson(middle, coarse, falls) - _richardson(coarse, coarsest, falls))
        change = np.maximum(change, before / falls)
        slow = np.abs(middle - coarse) < 2 * np.abs(fine - middle)  # not yet falling
        change = np.where(slow, np.maximum(change, np.abs(fine - middle)), change)
        best = int(np.argmax(np.abs(better)))
        # What any of the others may still gain counts against the answer.
        rival = np.max(np.abs(better) + np.where(slow, change, 0.0)) - np.abs(better[best])
        estimate = float(max(change[best], rival) / max(np.abs(better[best]), 1e-300))
        order = np.argsort(-np.abs(better), kind="stable")
        each = change[order] / np.maximum(np.abs(better[order]), 1e-300)
        return ConvergedMultiplier(
            complex(better[best]),
            estimate,
            steps,
            estimate <= self.tolerance,
            tuple(complex(mu) for mu in better[order]),
            tuple(float(error) for error in each),
        )


def _richardson(fine: np.ndarray, coarse: np.ndarray, falls: int) -> np.ndarray:
    return fine + (fine - coarse) / (falls - 1)


def _leading(mu: np.ndarray, most: int = 10) -> np.ndarray:
    """The largest multipliers of the upper half-plane."""
    upper = mu[mu.imag >= -1e-14 * np.abs(mu)]
    return upper[:most]


def _nearest(mu: np.ndarray, candidates: np.ndarray) -> np.ndarray:
    """For each multiplier the nearest of another spectrum."""
    return candidates[np.argmin(np.abs(mu[:, None] - candidates[None, :]), axis=1)]

"""What integration in time alone says of a point: stable or not, how fast, at which frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.time_domain.fitted_growth import chatter_frequency
from sdm_core.time_domain.method_of_steps import RTOL
from sdm_core.time_domain.motion import check_problem, state_weights
from sdm_core.time_domain.revolution_map import FloquetMode, leading_floquet_modes

NEARLY_EQUAL = 1e-3
"""Multipliers whose moduli differ by less than this share are named beside the dominant one."""
_SAMPLES = 16  # a vibration of the fastest mode, for the frequency
_LISTED = 4


@dataclass(frozen=True)
class TimeWitness:
    """A point as integrated over one revolution, again and again (`leading_floquet_modes`).

    Attributes
    ----------
    stable
        None where |μ| is closer to 1 than the error.
    multiplier
        The dominant one, of the upper half-plane.
    spectral_radius, error_estimate
        |μ|, and its change when every step is cut in two.
    growth_per_revolution
        ln |μ|.
    chatter_hz
        Frequency of the largest component of the contact displacement, Hz; NaN where nothing of it moves.
    nearly_equal
        (|μ|, chatter frequency in Hz) of the multipliers nearly as large as the dominant one.
    """

    stable: bool | None
    multiplier: complex
    spectral_radius: float
    error_estimate: float
    growth_per_revolution: float
    chatter_hz: float
    nearly_equal: tuple[tuple[float, float], ...]


def time_witness(problem: RubbingBlade, rtol: float = RTOL) -> TimeWitness:
    """Ask integration in time.

    Raises
    ------
    TooMuchWork
        When the tolerance takes too many steps a revolution, or Arnoldi's method does not converge.

    Examples
    --------
    >>> from sdm_core.rubbing_blade import single_state_problem
    >>> problem = single_state_problem([100.0], 0.002, [[1.0]], [1.0], speed_hz=30.0, ke=500.0)
    >>> time_witness(problem).stable  # below 2ξ(1 + ξ)ω² it is stable at every speed
    True
    """
    check_problem(problem)
    modes = leading_floquet_modes(
        problem.delay_equation(), _LISTED, weights=state_weights(problem), rtol=rtol
    )
    first = modes[0]
    size, error = abs(first.multiplier), first.error_estimate
    beside = [mode for mode in modes[1:] if abs(mode.multiplier) > (1 - NEARLY_EQUAL) * size]
    return TimeWitness(
        None if abs(size - 1) <= error else bool(size < 1),
        first.multiplier,
        size,
        error,
        first.growth_per_revolution,
        _chatter(problem, first),
        tuple((abs(mode.multiplier), _chatter(problem, mode)) for mode in beside),
    )


def _chatter(problem: RubbingBlade, mode: FloquetMode) -> float:
    n, tau = len(problem.omega), problem.tau
    fastest = problem.omega.max() / (2 * np.pi) * tau
    many = int(max(256, np.ceil(_SAMPLES * fastest)))
    modal = mode.at(np.arange(many) / many * tau)[:, :n]
    contact = modal @ problem.contact_shape.T
    if np.abs(contact).max() <= 1e-9 * np.abs(modal).max() * np.abs(problem.contact_shape).max():
        return float("nan")
    return chatter_frequency(mode.multiplier, contact, problem.speed_hz)

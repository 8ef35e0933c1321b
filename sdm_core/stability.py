"""The front door: is this blade, or this delay equation, stable?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.arc_stability import batch_multipliers
from sdm_core.characteristic import CharacteristicEquation
from sdm_core.delay_equation import DelayEquation
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.semi_discretization import Averaged, Converged

DEFAULT_TOLERANCE = 1e-4


@dataclass(frozen=True)
class Characteristic:
    """Exact characteristic equation with the argument principle as proof (rubbing blades only)."""


Method = Characteristic | Averaged | Converged


@dataclass(frozen=True)
class StabilitySolution:
    """Verdict on one point, with what is known of its error.

    Attributes
    ----------
    stable
        None where the answer is not decided to the tolerance.
    unstable_multipliers
        Floquet multipliers outside the unit circle; None where the method does not count them.
    multiplier
        The dominant one, of the upper half-plane.
    spectral_radius
        |μ|.
    growth_per_revolution
        ln |μ|.
    crossing
        Kind of the dominant multiplier: ``hopf`` (a complex pair), ``flip`` (near −1) or
        ``fold`` (near +1).
    chatter_hz
        |arg μ/2π + k| Ω, k the largest Fourier component of the contact displacement over a
        revolution (DESIGN, section 1); NaN where the method does not resolve it.
    error_estimate
        Relative error of the spectral radius; infinite where unknown.
    method
        What was computed, in words.
    cost
        Fundamental matrices, or steps per revolution.
    """

    stable: bool | None
    unstable_multipliers: int | None
    multiplier: complex
    spectral_radius: float
    growth_per_revolution: float
    crossing: str
    chatter_hz: float
    error_estimate: float
    method: str
    cost: int


def stability(
    problem: RubbingBlade | DelayEquation,
    method: Method | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
) -> StabilitySolution:
    """Stability of the equilibrium of a linear delay equation.

    Parameters
    ----------
    problem
        A rubbing blade, or any linear delay equation with period equal to delay.
    method
        None chooses: the exact characteristic equation for a blade, converged
        semi-discretization otherwise. `Averaged(N)` is semi-discretization with a fixed N, whose
        answer carries an unknown error and is named so.
    tolerance
        Relative error of |μ| within which a verdict counts as decided.

    Examples
    --------
    >>> from sdm_core.delay_equation import delayed_mathieu
    >>> round(stability(delayed_mathieu(3.0, 2.0, -0.15, 0.1)).spectral_radius, 4)
    0.5121
    """
    if method is None:
        method = Characteristic() if isinstance(problem, RubbingBlade) else Converged(tolerance)
    if isinstance(method, Characteristic):
        if not isinstance(problem, RubbingBlade):
            raise TypeError("Characteristic needs a RubbingBlade; use Converged for a general equation")
        return _by_characteristic(problem)
    equation = problem.delay_equation() if isinstance(problem, RubbingBlade) else problem
    if isinstance(method, Averaged):
        mu = complex(method.multipliers(equation)[0])
        name = f"semi-discretization, averaged, fixed N = {method.steps}, error unknown"
        return _solution(mu, np.inf, bool(abs(mu) < 1), None, np.nan, name, method.steps)
    found = method.dominant(equation)
    margin = max(found.error_estimate, 1e-12)
    decided = found.converged and abs(abs(found.multiplier) - 1) > margin * abs(found.multiplier)
    name = f"semi-discretization, averaged, converged at N = {found.steps}"
    if not found.converged:
        name = f"semi-discretization, averaged, not converged at N = {found.steps}"
    stable = bool(abs(found.multiplier) < 1) if decided else None
    return _solution(found.multiplier, found.error_estimate, stable, None, np.nan, name, found.steps)


def _by_characteristic(problem: RubbingBlade) -> StabilitySolution:
    equation = CharacteristicEquation(problem)
    count = equation.count_outside()
    mu, error = equation.dominant(count)
    stable = None if count is None else count == 0
    if count is None:  # too strong a contact to count: a multiplier far outside is proof enough
        alone = batch_multipliers([problem])
        if alone.stable[0] == 0.0:
            mu, error, stable = complex(alone.multiplier[0]), float(alone.error_estimate[0]), False
    chatter = equation.chatter_hz(mu) if np.isfinite(error) else np.nan
    name = "exact characteristic equation, argument principle"
    return _solution(mu, error, stable, count, chatter, name, equation.evaluations)


def _solution(
    mu: complex,
    error: float,
    stable: bool | None,
    count: int | None,
    chatter: float,
    method: str,
    cost: int,
) -> StabilitySolution:
    angle = abs(np.angle(mu))
    crossing = "fold" if angle < 1e-9 else "flip" if np.pi - angle < 1e-9 else "hopf"
    radius = abs(mu)
    growth = float(np.log(radius)) if radius > 0 else -np.inf
    return StabilitySolution(stable, count, mu, radius, growth, crossing, chatter, error, method, cost)

"""The front door: is this blade, or this delay equation, stable?"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sdm_core.delay_equation import DelayEquation
from sdm_core.errors import InvalidInput
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.floquet.characteristic import CharacteristicEquation
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.semi_discretization import Averaged, Converged, Gauss, Structured
from sdm_core.truncation import modes_enough

DEFAULT_TOLERANCE = 1e-4
LISTED = 6
"""Leading multipliers that an exact answer gives."""
_BEYOND = 10.0  # times K_e, up to which a critical K_e is looked for

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Characteristic:
    """Exact characteristic equation with the argument principle as proof (rubbing blades only)."""


Method = Characteristic | Averaged | Structured | Converged


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
    multipliers
        The leading ones of the upper half-plane, largest first, at most `LISTED`: those within a quarter
        of the largest or outside the circle.
    spectral_radius
        |μ|.
    growth_per_revolution
        ln |μ|.
    crossing
        Kind of the dominant multiplier: ``hopf`` (a complex pair), ``flip`` (real, below 0) or
        ``fold`` (real, above 0).
    chatter_hz
        |arg μ/2π + k| Ω, k the largest Fourier component of the contact displacement over a
        revolution (DESIGN, section 1); NaN where the method does not resolve it, or the contact does
        not move.
    wear_lobes
        Lobes that chatter would wear into the liner per revolution, chatter frequency over Ω.
    truncation_change
        Relative change of the critical K_e at this speed when the mode of highest frequency is dropped; NaN
        where it was not asked for, there is only one mode, or no critical K_e within ten times K_e.
    warnings
        What the user should know, in words.
    error_estimate
        Relative error of the spectral radius; infinite where unknown.
    method
        What was computed, in words.
    cost_s
        Time taken, s; of points solved together their average.
    """

    stable: bool | None
    unstable_multipliers: int | None
    multiplier: complex
    multipliers: tuple[complex, ...]
    spectral_radius: float
    growth_per_revolution: float
    crossing: str
    chatter_hz: float
    wear_lobes: float
    truncation_change: float
    warnings: tuple[str, ...]
    error_estimate: float
    method: str
    cost_s: float


def stability(
    problem: RubbingBlade | DelayEquation,
    method: Method | None = None,
    tolerance: float = DEFAULT_TOLERANCE,
    *,
    truncation: bool = True,
) -> StabilitySolution:
    """Stability of the equilibrium of a linear delay equation.

    Parameters
    ----------
    problem
        A rubbing blade, or any linear delay equation with period equal to delay.
    method
        None chooses: the exact characteristic equation for a blade, semi-discretization of order 6,
        converged, otherwise. A scheme with a fixed number of steps, like `Averaged(N)`, gives an answer
        that carries an unknown error and is named so.
    tolerance
        Relative error of |μ| within which a verdict counts as decided.
    truncation
        Whether to find out what the mode of highest frequency contributes: two boundaries at this speed
        (exact method only).

    Examples
    --------
    >>> from sdm_core.delay_equation import delayed_mathieu
    >>> round(stability(delayed_mathieu(3.0, 2.0, -0.15, 0.1)).spectral_radius, 4)
    0.5121
    """
    start = time.perf_counter()
    if not isinstance(problem, RubbingBlade | DelayEquation):
        raise InvalidInput(
            "problem",
            type(problem).__name__,
            "give RubbingBlade.from_blade(blade, contact, speed_hz, ke) or a DelayEquation",
        )
    if method is not None and not isinstance(method, Method):
        raise InvalidInput(
            "method", method, "give an object like Characteristic(), Gauss(60) or Converged(1e-6)"
        )
    if method is None and isinstance(problem, RubbingBlade):
        method = Characteristic()
    if isinstance(method, Characteristic):
        if not isinstance(problem, RubbingBlade):
            raise InvalidInput(
                "method", "Characteristic", "use Converged: the exact equation is that of a rubbing blade"
            )
        nothing: tuple[str, ...] = ()
        asked = truncation and problem.ke > 0
        change, warnings = modes_enough(problem, _BEYOND * problem.ke) if asked else (np.nan, nothing)
        return _exact([problem], start, [change], [warnings])[0]
    equation = problem.delay_equation() if isinstance(problem, RubbingBlade) else problem
    if isinstance(method, Averaged | Structured):
        mu = tuple(complex(m) for m in method.multipliers(equation)[: 2 * LISTED] if m.imag >= 0)
        order = 2 if isinstance(method, Averaged) else method.order
        name = f"semi-discretization of order {order}, fixed N = {method.steps}, error unknown"
        return _solution(mu, np.inf, bool(abs(mu[0]) < 1), None, np.nan, np.nan, name, start)
    method = method or Converged(tolerance, scheme=Gauss())
    found = method.dominant(equation)
    margin = max(found.error_estimate, 1e-12)
    decided = found.converged and abs(abs(found.multiplier) - 1) > margin * abs(found.multiplier)
    result = "converged" if found.converged else "not converged"
    name = f"semi-discretization of order {method.scheme.order}, {result} at N = {found.steps}"
    stable = bool(abs(found.multiplier) < 1) if decided else None
    leading = found.leading or (found.multiplier,)
    return _solution(leading, found.error_estimate, stable, found.outside, np.nan, np.nan, name, start)


def stabilities(
    problems: Sequence[RubbingBlade], *, progress: Progress | None = None, workers: int | None = None
) -> list[StabilitySolution]:
    """`stability` of many rubbing blades by the exact characteristic equation, solved together.

    What the highest mode contributes is not asked.

    Parameters
    ----------
    progress, workers
        As in `batch_multipliers`.
    """
    if not isinstance(problems, Sequence):
        raise InvalidInput("problems", type(problems).__name__, "give a list of RubbingBlade")
    for i, problem in enumerate(problems):
        if not isinstance(problem, RubbingBlade):
            raise InvalidInput(f"problems[{i}]", type(problem).__name__, "give a list of RubbingBlade")
    nothing: list[tuple[str, ...]] = [()] * len(problems)
    unknown = [np.nan] * len(problems)
    return _exact(problems, time.perf_counter(), unknown, nothing, progress=progress, workers=workers)


def _exact(
    problems: Sequence[RubbingBlade],
    start: float,
    change: Sequence[float],
    warnings: Sequence[tuple[str, ...]],
    **how: int | Progress | None,
) -> list[StabilitySolution]:
    found = batch_multipliers(problems, listed=LISTED, **how)  # type: ignore[arg-type]
    out = []
    for i, problem in enumerate(problems):
        mu = tuple(complex(m) for m in found.leading[i] if m != 0) or (complex(found.multiplier[i]),)
        error, verdict = float(found.error_estimate[i]), found.stable[i]
        chatter = CharacteristicEquation(problem).chatter_hz(mu[0]) if np.isfinite(error) else np.nan
        out.append(
            _solution(
                mu,
                error,
                None if np.isnan(verdict) else bool(verdict == 1.0),
                int(found.outside[i]) if found.outside[i] >= 0 else None,
                chatter,
                chatter / problem.speed_hz,
                "exact characteristic equation, argument principle",
                start,
                change[i],
                warnings[i],
                len(problems),
            )
        )
    return out


def _solution(
    mu: tuple[complex, ...],
    error: float,
    stable: bool | None,
    count: int | None,
    chatter: float,
    lobes: float,
    method: str,
    start: float,
    change: float = np.nan,
    warnings: tuple[str, ...] = (),
    together: int = 1,
) -> StabilitySolution:
    angle, radius = abs(np.angle(mu[0])), abs(mu[0])
    return StabilitySolution(
        stable=stable,
        unstable_multipliers=count,
        multiplier=mu[0],
        multipliers=mu[:LISTED],
        spectral_radius=radius,
        growth_per_revolution=float(np.log(radius)) if radius > 0 else -np.inf,
        crossing="fold" if angle < 1e-9 else "flip" if np.pi - angle < 1e-9 else "hopf",
        chatter_hz=float(chatter),
        wear_lobes=float(lobes),
        truncation_change=change,
        warnings=warnings,
        error_estimate=error,
        method=method,
        cost_s=(time.perf_counter() - start) / together,
    )

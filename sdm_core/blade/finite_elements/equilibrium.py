"""Equilibrium of a blade under centrifugal load, with large displacements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from sdm_core.blade.factorization import SymmetricFactor
from sdm_core.blade.finite_elements.solid_model import SolidModel
from sdm_core.errors import InvalidInput

# Out-of-balance force over the load at which Newton's iteration stops.
TOLERANCE = 1e-10
# Below this an unbalance that no longer falls is rounding, as slender blades have it.
ROUNDING = 1e-7
_MOST_ITERATIONS = 16
_DIVERGED = 1e6
# Over all steps of the load: rotor 37 and the example profile take 5 to 7.
MOST_ITERATIONS_IN_ALL = 100
# Smallest share of the load taken in one step before giving up.
_SMALLEST_STEP = 1 / 256


class NoEquilibrium(InvalidInput):
    """The blade finds no equilibrium at the rotor speed."""


@dataclass(frozen=True)
class Equilibrium:
    """A blade turning steadily.

    Attributes
    ----------
    speed_hz
        Rotor speed, Hz.
    displacement
        From the shape at rest, m, shape (N,).
    stiffness
        Tangent about it, with stress stiffening and spin softening, N/m, shape (N, N).
    unbalance
        Out-of-balance force over the centrifugal load.
    iterations
        Newton steps taken.
    """

    speed_hz: float
    displacement: np.ndarray
    stiffness: csc_array
    unbalance: float
    iterations: int


def equilibrium(
    model: SolidModel,
    speed_hz: float,
    start: Equilibrium | None = None,
    said: Callable[[str], None] = lambda what: None,
) -> Equilibrium:
    """Solve f(u) = Ω²S(X + u) by Newton's method, the load Ω² raised in steps where it must be.

    Parameters
    ----------
    start
        An equilibrium at another speed to start from, its displacement scaled with Ω².
    said
        Told of each Newton step.

    Raises
    ------
    NoEquilibrium
        When the steps become too small. Whether what is found is stable, its modes show.
    """
    load = (2 * np.pi * speed_hz) ** 2
    u, reached, count = np.zeros(model.size), 0.0, 0
    if load == 0.0:
        return Equilibrium(0.0, u, model.stiffness_at_rest(), 0.0, 0)
    if start is not None and start.speed_hz > 0:
        guess = start.displacement * (speed_hz / start.speed_hz) ** 2
        found = _newton(model, load, guess, said)
        if found is not None:
            return Equilibrium(speed_hz, *found)
    step = 1.0
    while reached < 1.0:
        target = min(reached + step, 1.0)
        found = _newton(model, target * load, u * (target / reached if reached else 1.0), said)
        if found is None:
            step *= 0.5
            if step < _SMALLEST_STEP:
                raise _none_beyond(reached, speed_hz)
            continue
        u, tangent, unbalance, iterations = found
        count += iterations
        if count > MOST_ITERATIONS_IN_ALL and target < 1.0:
            raise _none_beyond(target, speed_hz)
        reached = target
    return Equilibrium(speed_hz, u, tangent, unbalance, count)


def _none_beyond(reached: float, speed_hz: float) -> NoEquilibrium:
    return NoEquilibrium(
        "rotor speed",
        f"{speed_hz:.5g} Hz",
        f"no equilibrium found beyond {np.sqrt(reached) * speed_hz:.4g} Hz: lower the design speed, or "
        "stiffen the blade",
    )


def _newton(
    model: SolidModel, load: float, u: np.ndarray, said: Callable[[str], None]
) -> tuple[np.ndarray, csc_array, float, int] | None:
    """Displacement, tangent, unbalance and steps taken; None where it does not converge."""
    softening = load * model.mass_across_axis
    before = np.inf
    for iteration in range(_MOST_ITERATIONS):
        internal, stiffness = model.tangent(u)
        tangent = stiffness - softening
        external = load * model.centrifugal_load + softening @ u
        residual = external - internal
        unbalance = float(np.linalg.norm(residual) / np.linalg.norm(external))
        if unbalance < TOLERANCE or (unbalance < ROUNDING and unbalance > 0.25 * before):
            return u, tangent, unbalance, iteration
        # Large turns make the unbalance rise and fall before it converges; one that is still large after
        # half the steps does not.
        if not unbalance < _DIVERGED or (iteration > _MOST_ITERATIONS // 2 and unbalance > 0.1):
            return None
        said(f"Newton step {iteration + 1}, unbalance {unbalance:.0e}")
        before = unbalance
        u = u + SymmetricFactor(tangent).solve(residual)
    return None

"""A K_e below which no blade of an uncertain family can chatter at any speed: proven, not searched."""

from __future__ import annotations

import numpy as np

from sdm_core.assessment.single_mode import FLOOR_SPEEDS
from sdm_core.assessment.uncertain_blade import Uncertainty
from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.rubbing_blade import LEAST_DAMPING, check_blade_and_contact

# Chatter frequencies tried: each interval between two is bounded from above, so that none is left out.
_INTERVALS = 20_000
_STRETCHES = 16
# Between two speeds at which modal data are taken they stay within their range over the stretch, widened by
# this share of it: the states' interpolant is a cubic, and 25 speeds a stretch leave it no room for more.
_BETWEEN = 0.05


def guaranteed_ke(
    blade: Blade,
    contact: ContactConfiguration,
    speed_range_hz: tuple[float, float],
    uncertainty: Uncertainty,
) -> float | None:
    """The largest K_e, N/m, for which this bound proves every blade of the family stable.

    In permanent contact stability is lost where K_e = −1/(2 Re λ), λ an eigenvalue of the complex symmetric
    W^½H(iω)W^½ = Σ_j g_j g_jᵀ/D_j with g_j = W^½φ_j and D_j = ω_j² − ω² + 2iξ_jω_jω. λ lies in the numerical
    range, hence

        −Re λ ≤ max_{|y|=1} −y^H Re(·) y ≤ Σ_j G_jj max(0, −Re 1/D_j),

    whatever the other modes do. Of each term, with u = ω² − ω_j²,

        −Re 1/D_j = u/(u² − 4ξ_j²ω²u + 4ξ_j²ω⁴)

    the largest over damping is at the lowest ξ_j, over amplitude at the largest, and over ω_j at
    u = 2ξ_jω² or, that being outside, at the end of the interval nearest to it: it rises up to there and
    falls beyond. The largest sum over all ω bounds K_e from below, at every speed of the range.

    Returns
    -------
    None where contact varies round the casing: the argument needs permanent contact. Infinite where no
    mode touches.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> least = guaranteed_ke(
    ...     example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), (60.0, 300.0), Uncertainty()
    ... )
    >>> 3000 < least < 4000  # half of the nominal least K_e, 7978 N/m, less 6 % for the frequency
    True
    """
    check_blade_and_contact(blade, contact)
    if not contact.permanent:
        return None
    omega, shape = blade.at_speeds(np.linspace(*speed_range_hz, FLOOR_SPEEDS))
    strength = shape**2 @ contact.weight_vector(blade.tip_nodes)
    damping = np.maximum(blade.damping_ratio, LEAST_DAMPING) * uncertainty.damping[0]
    # Speed by speed in short stretches, each with the ends of what its data range over.
    step = FLOOR_SPEEDS // _STRETCHES
    largest = 0.0
    for start in range(0, FLOOR_SPEEDS - 1, step):
        here = slice(start, start + step + 1)
        (low, high), (_, most) = _widened(omega[here]), _widened(strength[here])
        low, high = low * uncertainty.frequency[0], high * uncertainty.frequency[1]
        # The terms peak between ω_j and twice as high; above, each falls with ω.
        edges = np.geomspace(low.min(), 2 * high.max(), _INTERVALS + 1)
        total = np.zeros(_INTERVALS)
        for j, strongest in enumerate(most * uncertainty.amplitude[1] ** 2):
            total += strongest * _largest_flexibility(edges, low[j], high[j], damping[j])
        largest = max(largest, float(total.max()))
    return np.inf if largest == 0 else 1.0 / (2.0 * largest)


def _widened(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest over the rows, and a little beyond for what lies between them."""
    low, high = values.min(axis=0), values.max(axis=0)
    beyond = _BETWEEN * (high - low)
    return low - beyond, high + beyond


def _largest_flexibility(edges: np.ndarray, low: float, high: float, damping: float) -> np.ndarray:
    """Bound of max(0, −Re 1/D) for ω_j in [low, high] and ω between two edges, shape (intervals,).

    With s = ω², t = ω_j² and u = s − t it is u/(u² + 4ξ²st). In the interval s ≥ s₀, and t is at least
    both low² and s₀ − u: with these put in, one maximum over u is left on either side of u = s₀ − low².
    """
    s0, s1 = edges[:-1] ** 2, edges[1:] ** 2
    least, most = np.maximum(s0 - high**2, 0.0), s1 - low**2
    bend = np.clip(s0 - low**2, least, np.maximum(most, least))

    def value(u: np.ndarray) -> np.ndarray:
        return u / (u**2 + 4 * damping**2 * s0 * np.maximum(low**2, s0 - u))

    below = value(np.clip(2 * damping * s0, least, bend))
    above = value(np.clip(2 * damping * np.sqrt(s0) * low, bend, np.maximum(most, bend)))
    return np.where(most > 0, np.maximum(below, above), 0.0)

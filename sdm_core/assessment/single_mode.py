"""One mode in permanent contact, in closed form: the floor of its lobes and their speeds."""

from __future__ import annotations

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.rubbing_blade import LEAST_DAMPING, check_blade_and_contact

FLOOR_SPEEDS = 400
"""Speeds over a range at which floors are taken: smooth in Ω, they change little between two."""


def floor_ke(
    omega: np.ndarray | float, damping_ratio: np.ndarray | float, strength: np.ndarray | float
) -> np.ndarray:
    """The K_e below which one mode is stable at every rotor speed, N/m.

        min over ω of −1/(2 Re H_jj(iω)) = 2ξ(1 + ξ)ω_j²/G_jj     (DESIGN, section 6),

    at the chatter frequency ω_j√(1 + 2ξ).

    Parameters
    ----------
    omega
        ω_j, rad/s.
    damping_ratio
        ξ_j.
    strength
        G_jj = Σ w φ_j², kg^-1; 0 gives infinity: the mode does not touch.

    Examples
    --------
    >>> float(floor_ke(2.0, 0.5, 3.0))
    2.0
    """
    omega, damping, strength = np.broadcast_arrays(omega, damping_ratio, np.asarray(strength, dtype=float))
    floor = np.full(strength.shape, np.inf)
    touching = strength > 0
    floor[touching] = (2 * damping * (1 + damping) * omega**2)[touching] / strength[touching]
    return floor


def tip_phase(damping_ratio: np.ndarray | float) -> np.ndarray:
    """Part of a turn by which chatter at a lobe's tip exceeds whole wear lobes: 3/4 and a little more.

    There e^{−iωτ} = 1 + 1/(K_e H) = (ξ + i√(1 + 2ξ))/(1 + ξ), from which
    ωτ/2π = k + 1 − arctan(√(1 + 2ξ)/ξ)/2π.

    Examples
    --------
    >>> float(tip_phase(0.0))
    0.75
    """
    damping = np.asarray(damping_ratio, dtype=float)
    return 1.0 - np.arctan2(np.sqrt(1 + 2 * damping), damping) / (2 * np.pi)


def floors_over_speed(
    blade: Blade, contact: ContactConfiguration, speed_range_hz: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """The floor of each mode over a range of rotor speeds: with stiffening it moves with Ω.

    Returns
    -------
    Speeds in Hz, shape (m,), and floors in N/m, shape (m, n), as in permanent contact.
    """
    check_blade_and_contact(blade, contact)
    speed = np.linspace(*speed_range_hz, FLOOR_SPEEDS)
    omega, shape = blade.at_speeds(speed)
    strength = shape**2 @ contact.weight_vector(blade.tip_nodes)
    damping = np.maximum(blade.damping_ratio, LEAST_DAMPING)
    return speed, floor_ke(omega, damping, strength)

"""Where the blade's energy comes from and goes to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class EnergyAccount:
    """Energy of the blade and work done on it, from the start to the end of each revolution.

    Half a step after t_n the scheme has the energy

        E_{n+½} = ½ |(x_{n+1} − x_n)/h|² + ½ x_nᵀ Λ² x_{n+1},

    kinetic and strain energy to second order in h. Multiplying the scheme by (x_{n+1} − x_{n−1})/2 shows
    that E_{n+½} − E_{n−½} is half the work of damping, contact and friction over the displacement from
    x_{n−1} to x_{n+1}: exactly, so that `imbalance_j` is rounding, whatever the step. That work is in
    turn the integral of force times velocity to second order in h, where the force does not jump.

    Attributes
    ----------
    start_j
        E at the start.
    energy_j
        E at the end of each revolution, J, shape (revolutions,).
    damping_j, contact_j, friction_j
        Work done on the blade since the start, J, shape (revolutions,).
    """

    start_j: float
    energy_j: np.ndarray
    damping_j: np.ndarray
    contact_j: np.ndarray
    friction_j: np.ndarray

    @property
    def imbalance_j(self) -> np.ndarray:
        """Energy that came from nowhere, J, shape (revolutions,)."""
        return self.energy_j - self.start_j - self.damping_j - self.contact_j - self.friction_j

    @property
    def turnover_j(self) -> float:
        """What rounding is to be measured against, J: the largest of all terms."""
        terms = (self.energy_j, self.damping_j, self.contact_j, self.friction_j)
        return max(self.start_j, *(float(np.abs(term).max(initial=0.0)) for term in terms))


def scheme_energy(now: np.ndarray, before: np.ndarray, omega: np.ndarray, step: float) -> float:
    """E between two instants of modal coordinates, each of shape (n,), J."""
    velocity = (now - before) / step
    return float(0.5 * velocity @ velocity + 0.5 * (omega**2 * now) @ before)

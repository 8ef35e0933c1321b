"""The response at one rotor speed, as it is kept and drawn."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

from sdm_core.time_domain.liner.rub_history import RubHistory

_PREFIX = "response_"


@dataclass(frozen=True)
class Response:
    """m samples, R tip nodes, r of them in contact, n modes, q revolutions.

    Attributes
    ----------
    time_s
        s, shape (m,).
    displacement_m
        Of every tip node in the contact direction, m, shape (m, R).
    force_n
        On each contact node, the mean since the sample before, N, shape (m, r).
    modal_energy_j
        Kinetic and strain energy of each mode, J, shape (m, n).
    energy_j, damping_j, contact_j, friction_j
        The blade's energy at the end of each revolution, and the work done on it by then, J, shape (q,).
    samples_per_revolution
        As a number of no dimension.
    """

    time_s: np.ndarray
    displacement_m: np.ndarray
    force_n: np.ndarray
    modal_energy_j: np.ndarray
    energy_j: np.ndarray
    damping_j: np.ndarray
    contact_j: np.ndarray
    friction_j: np.ndarray
    samples_per_revolution: np.ndarray

    @classmethod
    def of(cls, history: RubHistory) -> Self:
        """That of a simulation."""
        account = history.energy
        return cls(
            history.time_s,
            history.displacement_m,
            history.force_n,
            history.modal_energy_j,
            account.energy_j,
            account.damping_j,
            account.contact_j,
            account.friction_j,
            np.array(history.samples_per_revolution),
        )

    @property
    def revolutions(self) -> int:
        """Simulated, fewer than asked for where the liner was worn through."""
        return len(self.energy_j)

    @property
    def imbalance_j(self) -> float:
        """Energy that came from nowhere in the end, J."""
        return float(self.energy_j[-1] - self.damping_j[-1] - self.contact_j[-1] - self.friction_j[-1])

    def account(self) -> dict[str, float]:
        """At the end, as JSON."""
        return {
            "energy_j": float(self.energy_j[-1]),
            "work_of_damping_j": float(self.damping_j[-1]),
            "work_of_contact_j": float(self.contact_j[-1]),
            "work_of_friction_j": float(self.friction_j[-1]),
            "imbalance_j": self.imbalance_j,
        }

    def arrays(self) -> dict[str, np.ndarray]:
        """By names that tell them from those of `SimulatedSpeeds`."""
        return {_PREFIX + f.name: getattr(self, f.name) for f in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Any) -> Self | None:
        """That among `arrays`; None where there is none."""
        names = [f.name for f in fields(cls)]
        if _PREFIX + names[0] not in arrays:
            return None
        return cls(**{name: np.asarray(arrays[_PREFIX + name]) for name in names})

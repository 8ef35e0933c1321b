"""Wear maps: worn profiles unfolded side by side over rotor speed ([SBL] Figs. 11 and 12)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sdm_core.errors import InvalidInput
from sdm_core.time_domain.liner.speed_sweep import SpeedSweep
from sdm_core.whole_files import staged


@dataclass(frozen=True)
class WearMap:
    """Depth removed under one node, over speed and angle.

    Attributes
    ----------
    node
        Contact node.
    speed_hz
        Hz, shape (m,).
    speed_ratio
        Over the blade's first frequency at rest, shape (m,).
    angle_rad
        Shape (a,).
    worn_m
        m, shape (m, a).
    lobes
        Wear lobes, the ovalisation's left aside, shape (m,).
    worn_through
        Where the liner was worn through before the last revolution, shape (m,).
    """

    node: str
    speed_hz: np.ndarray
    speed_ratio: np.ndarray
    angle_rad: np.ndarray
    worn_m: np.ndarray
    lobes: np.ndarray
    worn_through: np.ndarray

    @classmethod
    def of_sweep(cls, sweep: SpeedSweep, node: str | None = None, angles: int | None = None) -> WearMap:
        """The map of one contact node.

        Parameters
        ----------
        node
            The first contact node where left out.
        angles
            Cells are taken together to this number, a divisor of theirs, each showing its deepest.

        Raises
        ------
        InvalidInput
            For a node that was not in contact, or a number of angles that does not divide.
        """
        node = sweep.rub.nodes[0] if node is None else node
        if node not in sweep.rub.nodes:
            raise InvalidInput("node", node, f"name a contact node: {', '.join(sweep.rub.nodes)}")
        i = sweep.rub.nodes.index(node)
        worn = np.array([found.worn_m[i] for found in sweep.results])
        angles = worn.shape[1] if angles is None else angles
        if angles < 1 or worn.shape[1] % angles:
            raise InvalidInput("angles", angles, f"give a divisor of the {worn.shape[1]} cells")
        together = worn.shape[1] // angles
        speed = sweep.speed_hz
        return cls(
            node,
            speed,
            speed / sweep.rub.blade.first_frequency_hz,
            2 * np.pi * (np.arange(angles) + (together - 1) / (2 * together)) / angles,
            worn.reshape(len(worn), angles, together).max(axis=2),
            np.array([found.lobes[i] for found in sweep.results]),
            np.array([found.worn_through for found in sweep.results]),
        )

    @property
    def deepest_m(self) -> np.ndarray:
        """Largest depth at each speed, m, shape (m,)."""
        return self.worn_m.max(axis=1)

    @property
    def unevenness(self) -> float:
        """How much the map depends on speed; 0 for profiles that are the same at all speeds.

        Standard deviation of the depth over speeds, root mean square over angles, relative to the mean depth.
        """
        mean = self.worn_m.mean()
        return 0.0 if mean == 0 else float(np.sqrt(self.worn_m.var(axis=0).mean()) / mean)

    def save(self, path: str | Path) -> None:
        """As npz, whole or not at all."""
        arrays = {key: value for key, value in vars(self).items() if key != "node"}
        with staged(path, "wear map") as beside, beside.open("wb") as file:
            np.savez_compressed(file, node=np.array(self.node), **arrays)

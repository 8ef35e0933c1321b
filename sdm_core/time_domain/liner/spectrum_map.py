"""Spectrum maps: how the tip vibrates over rotor speed ([SBL] Fig. 14)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sdm_core.time_domain.liner.speed_sweep import SpeedSweep
from sdm_core.whole_files import staged


@dataclass(frozen=True)
class SpectrumMap:
    """Amplitude of one tip node's displacement over the last revolutions, over speed and frequency.

    Attributes
    ----------
    node
        Tip node.
    speed_hz
        Hz, shape (m,).
    frequency_hz
        Hz, shape (k,).
    amplitude_m
        m, shape (m, k).
    natural_hz
        Natural frequencies at each speed, the lines of Campbell's diagram, Hz, shape (m, n).
    first_frequency_hz
        The blade's, at rest, by which [SBL] divides both axes.
    """

    node: str
    speed_hz: np.ndarray
    frequency_hz: np.ndarray
    amplitude_m: np.ndarray
    natural_hz: np.ndarray
    first_frequency_hz: float

    @classmethod
    def of_sweep(cls, sweep: SpeedSweep) -> SpectrumMap:
        """The map of the node whose spectra were taken."""
        return cls(
            sweep.node,
            sweep.speed_hz,
            sweep.frequency_hz,
            np.array([found.spectrum_m for found in sweep.results]),
            np.array([found.natural_hz for found in sweep.results]),
            sweep.rub.blade.first_frequency_hz,
        )

    def engine_orders(self, orders: np.ndarray) -> np.ndarray:
        """Frequencies of engine orders at each speed, Hz, shape (m, orders)."""
        return self.speed_hz[:, None] * np.asarray(orders, dtype=float)

    @property
    def strongest_hz(self) -> np.ndarray:
        """Frequency of the largest amplitude at each speed, Hz, shape (m,)."""
        return self.frequency_hz[self.amplitude_m.argmax(axis=1)]

    def save(self, path: str | Path) -> None:
        """As npz, whole or not at all."""
        arrays = {key: value for key, value in vars(self).items() if key != "node"}
        with staged(path, "spectrum map") as beside, beside.open("wb") as file:
            np.savez_compressed(file, node=np.array(self.node), **arrays)

"""How many lobes the blade has carved into the liner."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class WearLobes:
    """Harmonics of a worn profile round the casing.

    Attributes
    ----------
    count
        Lobes per revolution: the strongest harmonic, that of the casing's ovalisation left aside; 0 where
        nothing is worn, or all of it evenly.
    amplitude_m
        Of that harmonic, m.
    ovalisation
        Lobes of the casing, 0 for a round one.
    ovalisation_amplitude_m
        Of that harmonic in the worn profile, m.
    """

    count: int
    amplitude_m: float
    ovalisation: int
    ovalisation_amplitude_m: float


def wear_lobes(worn_m: np.ndarray, ovalisation: int = 0) -> WearLobes:
    """Lobes of one worn profile, shape (cells,).

    Grooves of the ovalisation are not sinusoidal: they hold multiples of its harmonic, in falling strength.
    A count that is such a multiple, with an amplitude below that of the ovalisation, need not be vibration.

    Examples
    --------
    >>> angle = 2 * np.pi * np.arange(360) / 360
    >>> wear_lobes(1e-4 * (2 + np.cos(2 * angle) + 0.5 * np.cos(5 * angle)), ovalisation=2).count
    5
    """
    amplitude = 2 * np.abs(np.fft.rfft(np.asarray(worn_m, dtype=float))) / len(worn_m)
    # Rounding of an even profile is no lobe.
    amplitude[amplitude < 1e-9 * max(float(np.max(worn_m)), 1e-300)] = 0.0
    amplitude[0] = 0.0
    oval = float(amplitude[ovalisation]) if ovalisation else 0.0
    rest = amplitude.copy()
    if ovalisation:
        rest[ovalisation] = 0.0
    count = int(np.argmax(rest))
    return WearLobes(count, float(rest[count]), ovalisation, oval)

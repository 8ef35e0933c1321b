"""Cutting stiffnesses at which stability changes at one rotor speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Crossings:
    """Roots on the imaginary axis at one speed, by rising K_e.

    Attributes
    ----------
    ke
        N/m, shape (c,).
    frequency_hz
        ω/2π, Hz: the chatter frequency there.
    direction
        +1 where a pair of roots becomes unstable as K_e rises, −1 where one becomes stable again.
    error_estimate
        Relative error of `ke`.
    proven
        False when another method contradicts these crossings, or could not confirm them.
    """

    ke: np.ndarray
    frequency_hz: np.ndarray
    direction: np.ndarray
    error_estimate: np.ndarray
    proven: bool = True

    @classmethod
    def none(cls) -> Crossings:
        """No crossing."""
        return cls(*np.zeros((4, 0)))

    @property
    def consistent(self) -> bool:
        """False when a crossing must have been missed: fewer than no unstable roots."""
        return bool((np.cumsum(self.direction) >= 0).all())

    def unstable_intervals(self, ke_max: float) -> tuple[tuple[float, float], ...]:
        """Intervals of K_e up to `ke_max` with unstable roots, N/m."""
        pairs, intervals, start = 0, [], 0.0
        for ke, direction in zip(self.ke, self.direction, strict=True):
            if ke > ke_max:
                break
            before, pairs = pairs, pairs + int(direction)
            if before <= 0 < pairs:
                start = float(ke)
            elif pairs <= 0 < before:
                intervals.append((start, float(ke)))
        if pairs > 0:
            intervals.append((start, float(ke_max)))
        return tuple(intervals)

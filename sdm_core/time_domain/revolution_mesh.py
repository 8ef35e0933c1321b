"""The steps of one revolution: they end where coefficients jump, and are cut where the error asks for it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from sdm_core.time_domain.runge_kutta import NODES

# Coefficients are read this far inside a step (in steps), so that a jump at its end is seen from within.
_INSIDE = 1e-10


@dataclass(frozen=True)
class RevolutionMesh:
    """Ends of the steps of one revolution, s, from 0 to τ, shape (steps + 1,)."""

    ends: np.ndarray

    @classmethod
    def uniform(cls, pieces: np.ndarray, longest: float) -> RevolutionMesh:
        """Equal steps no longer than `longest`, s, in each of the intervals whose ends are `pieces`."""
        parts = [
            np.linspace(start, end, 1 + max(1, int(np.ceil((end - start) / longest))))[:-1]
            for start, end in pairwise(pieces)
        ]
        return cls(np.concatenate([*parts, pieces[-1:]]))

    @property
    def steps(self) -> np.ndarray:
        """Lengths, s."""
        return np.diff(self.ends)

    @cached_property
    def stage_times(self) -> np.ndarray:
        """Times of the stages and of the dense output's further stages, s, shape (steps, 16)."""
        return self.ends[:-1, None] + self.steps[:, None] * NODES

    @property
    def inner_times(self) -> np.ndarray:
        """The same, never on a step's end."""
        return self.ends[:-1, None] + self.steps[:, None] * np.clip(NODES, _INSIDE, 1 - _INSIDE)

    def cut(self, parts: np.ndarray) -> RevolutionMesh:
        """Every step cut into as many equal parts as said, shape (steps,)."""
        if (parts == 1).all():
            return self
        pieces = [
            start + (end - start) * np.arange(many) / many
            for start, end, many in zip(self.ends[:-1], self.ends[1:], parts, strict=True)
        ]
        return RevolutionMesh(np.concatenate([*pieces, self.ends[-1:]]))

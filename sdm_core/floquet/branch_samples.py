"""Branches of multipliers at sampled K_e, and what may happen to them between two samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_SHARP = 0.02  # of ln K_e


@dataclass
class BranchSamples:
    """What is known at some K_e of some cases, by case and K_e.

    Attributes
    ----------
    case, x
        Speed and ln K_e.
    outside
        Multipliers outside the circle, −1 where not decided; 1 stands for one or more where
        `followed` is false.
    growth, slope, angle, turn
        ln |μ| and arg μ of branches near the circle and their derivatives to ln K_e, shape (s, l);
        growth −inf where there is none.
    followed
        False where contact is too strong for series.
    solved
        True where a crossing lies between this sample and the next.
    """

    case: np.ndarray
    x: np.ndarray
    outside: np.ndarray
    growth: np.ndarray
    slope: np.ndarray
    angle: np.ndarray
    turn: np.ndarray
    followed: np.ndarray
    solved: np.ndarray

    def merged(self, other: BranchSamples) -> BranchSamples:
        wide = max(self.growth.shape[1], other.growth.shape[1])
        order = np.lexsort((np.r_[self.x, other.x], np.r_[self.case, other.case]))

        def both(name: str) -> np.ndarray:
            a, b = getattr(self, name), getattr(other, name)
            if a.ndim == 2:
                empty = -np.inf if name == "growth" else 0.0
                a, b = (np.pad(v, ((0, 0), (0, wide - v.shape[1])), constant_values=empty) for v in (a, b))
            return np.concatenate([a, b])[order]

        return BranchSamples(*(both(name) for name in self.__dataclass_fields__))

    def may_cross(self, width: np.ndarray) -> np.ndarray:
        """Whether the leading branch may come to the circle and back between two samples of one verdict.

        `width` are the distances in ln K_e between neighbours, shape (s − 1,).

        A branch between its two tangents has its peak below their meeting point where it is concave; a
        quarter of what the slopes could add is allowed for other shapes. Where a pair meets on the real
        axis and goes on as two real multipliers, or the reverse, one of them may rise as a square root.
        """
        left, right = slice(None, -1), slice(1, None)
        stable = self.outside == 0
        h = width[:, None]
        with np.errstate(invalid="ignore"):
            # At each end by the tangents of the other.
            ahead = self.growth[left] + self.slope[left] * h
            behind = self.growth[right] - self.slope[right] * h
            after, before = self._meeting(left, h, 1.0), self._meeting(right, h, -1.0)
            from_left = np.maximum(self.growth[left], ahead) + after
            from_right = np.maximum(self.growth[right], behind) + before
            peaks = np.array([from_left.max(axis=1), from_right.max(axis=1)])
            meets = (after > 0).any(axis=1) | (before > 0).any(axis=1)
            valley = np.maximum(ahead.max(axis=1), behind.max(axis=1))
        peak = np.where(meets, peaks.max(axis=0), peaks.min(axis=0))
        steepest = np.maximum(np.abs(self.slope[left]).max(axis=1), np.abs(self.slope[right]).max(axis=1))
        margin = 0.25 * steepest * width
        island = stable[left] & stable[right] & (peak + margin > 0)
        # A window of stability: every branch outside comes in, and another goes out before the next sample.
        window = valley - margin < 0
        # A bubble that a pair blows on the real axis turns sharply: near the circle only closeness tells.
        top = np.minimum(self.growth[left].max(axis=1), self.growth[right].max(axis=1))
        window |= (top < steepest * width) & (width > _SHARP)
        return island | (~stable[left] & ~stable[right] & window)

    def _meeting(self, at: slice, h: np.ndarray, sense: float) -> np.ndarray:
        """What ln |μ| may gain within h where two multipliers meet on the real axis, shape (s, l).

        With δ² = b (x₀ − x) the distance δ from meeting, b is 2δ|dδ/dx|, and beyond the meeting the
        two part by √(b h) at most.
        """
        angle, turn = self.angle[at], self.turn[at]
        there = np.isfinite(self.growth[at])
        off = np.minimum(np.abs(angle), np.pi - np.abs(angle))  # of a pair from the axis
        closing = np.where(np.abs(angle) < 0.5 * np.pi, -turn, turn) * np.sign(angle) * sense
        # Two real multipliers of one sign, next to one another by size: half their distance.
        growth, slope = self.growth[at], self.slope[at]
        real = there & (off == 0)
        gap, shrinks = np.zeros_like(growth), np.zeros_like(growth)
        for j in range(growth.shape[1] - 1):
            twins = real[:, j] & real[:, j + 1] & (angle[:, j] == angle[:, j + 1])
            with np.errstate(invalid="ignore"):
                gap[:, j] = np.where(twins, 0.5 * (growth[:, j] - growth[:, j + 1]), 0.0)
                shrinks[:, j] = np.where(twins, -0.5 * (slope[:, j] - slope[:, j + 1]) * sense, 0.0)
        distance, speed = np.where(off > 0, off, gap), np.where(off > 0, closing, shrinks)
        soon = there & (speed > 0) & (distance > 0) & (distance < 4 * speed * h)
        return np.where(soon, np.sqrt(2 * distance * np.maximum(speed, 0.0) * h), 0.0)

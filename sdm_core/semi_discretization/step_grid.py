"""How a revolution is cut into steps, and the coefficients over each."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sdm_core.delay_equation import DelayEquation

_INSIDE = np.array([0.137, 0.5, 0.791])  # places in a step at which its coefficients are compared
_FEW_STEPS = 16  # a revolution of fewer is not halved further when shares are rounded
_EPS = np.finfo(float).eps


@dataclass(frozen=True)
class StepGrid:
    """The steps of a revolution in order, one entry each, or one for many where nothing depends on time.

    Attributes
    ----------
    start, length
        s, shapes (entries,).
    repeat
        Steps that each entry stands for, shape (entries,).
    """

    start: np.ndarray
    length: np.ndarray
    repeat: np.ndarray

    def __getitem__(self, entries: slice) -> StepGrid:
        return StepGrid(self.start[entries], self.length[entries], self.repeat[entries])

    @classmethod
    def uniform(cls, equation: DelayEquation, steps: int) -> StepGrid:
        """N equal steps, as in [SBL] Eq. 7; one entry where nothing depends on time."""
        length = equation.tau / steps
        if equation.is_constant:
            return cls(np.zeros(1), np.full(1, length), np.full(1, steps))
        return cls(length * np.arange(steps), np.full(steps, length), np.ones(steps, dtype=int))

    @classmethod
    def aligned(cls, equation: DelayEquation, steps: int) -> StepGrid:
        """About N steps, as long as the pieces allow, with no break of the coefficients inside one.

        Each piece has its share, one step at least, and twice as many at twice N, so that errors fall
        as Richardson's extrapolation takes them to. A piece without delayed term and with constant A
        is one step, however long: nothing is discretized there.
        """
        if equation.is_constant:
            return cls.uniform(equation, steps)
        base = steps
        while base % 2 == 0 and base >= 2 * _FEW_STEPS:
            base //= 2
        parts = []
        for begin, end in pairwise(equation.pieces):
            inside = begin + (end - begin) * (1 - np.cos(np.pi * np.arange(1, 32) / 32)) / 2
            a, b = equation.a.at(inside), equation.b.at(inside)
            free = bool((a == a[0]).all()) and not b.any()
            share = max(1, round(base * (end - begin) / equation.tau))
            count = 1 if free else share * (steps // base)
            length = (end - begin) / count
            parts.append((begin + length * np.arange(count), np.full(count, length)))
        start, length = (np.concatenate(each) for each in zip(*parts, strict=True))
        return cls(start, length, np.ones(len(start), dtype=int))

    def means(self, equation: DelayEquation) -> tuple[np.ndarray, np.ndarray]:
        """Means of A and B over each step ([SBL] Eq. 10), shapes (entries, d, d).

        Means of a constant differ in the last bits from step to step; its value is taken instead, so
        that equal steps are seen to be equal and free ones free.
        """
        a, b = equation.means(self.start, self.start + self.length)
        if equation.is_constant:
            return a, b
        times = self.start[:, None] + self.length[:, None] * _INSIDE
        slack = 64 * _EPS * equation.tau / self.length
        same = np.ones(len(a), dtype=bool)
        values = []
        for mean, matrix in ((a, equation.a), (b, equation.b)):
            at = [matrix.at(times[:, k]) for k in range(len(_INSIDE))]
            size = slack * max(np.abs(mean).max(), *(np.abs(v).max() for v in at))
            for value in at:
                same &= (value == at[0]).all(axis=(1, 2)) & (np.abs(value - mean).max(axis=(1, 2)) <= size)
            values.append(at[0])
        value_a, value_b = values
        return np.where(same[:, None, None], value_a, a), np.where(same[:, None, None], value_b, b)

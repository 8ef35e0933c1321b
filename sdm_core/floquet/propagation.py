"""Motion over one revolution, whatever the engagement: what multipliers and boundaries are found from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, Self

import numpy as np

from sdm_core.floquet.arc_propagation import ArcPropagation
from sdm_core.floquet.arc_steps import ArcSteps
from sdm_core.floquet.smooth_propagation import SmoothPropagation
from sdm_core.rubbing_blade import RubbingBlade


class Fundamental(Protocol):
    """What gives M(c) of problem `case` each, shape (k, 2n, 2n), for c of shape (k,)."""

    def fundamental(self, case: np.ndarray, c: np.ndarray) -> np.ndarray: ...

    def __getitem__(self, rows: np.ndarray) -> Self: ...


class Propagation(Fundamental, Protocol):
    """M(c), the fundamental matrix of ẍ + 2ξΛẋ + (Λ² − c γ(Ωt) G) x = 0, for a batch of blades.

    `ArcPropagation` says what each member is.
    """

    @property
    def angle(self) -> np.ndarray: ...

    @property
    def damping_ratio(self) -> np.ndarray: ...

    @property
    def coupling(self) -> np.ndarray: ...

    @property
    def size(self) -> int: ...

    @property
    def phase_shift(self) -> np.ndarray: ...

    @property
    def rounding(self) -> np.ndarray: ...

    def __len__(self) -> int: ...


def kind(problem: RubbingBlade) -> tuple[int, bool]:
    """Problems of one kind can be propagated together: number of modes, smooth engagement."""
    return len(problem.omega), problem.engagement is not None


def propagation_of(problems: Sequence[RubbingBlade]) -> Propagation:
    """Of problems of one `kind`."""
    if problems[0].engagement is None:
        return ArcPropagation.of(problems)
    return SmoothPropagation.of(problems)


def for_many(motion: Propagation, radius: np.ndarray) -> Fundamental:
    """The same M(c), made ready for many |c| ≤ `radius` of each problem, N/m, shape (b,)."""
    return ArcSteps.of(motion, radius) if isinstance(motion, ArcPropagation) else motion

"""What the schemes on the contact history have in common: settings, grid, multipliers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from hashlib import blake2b

import numpy as np

from sdm_core.delay_equation import DelayEquation
from sdm_core.errors import InvalidInput, TooMuchWork
from sdm_core.interruption import checkpoint
from sdm_core.semi_discretization import reduced_equation
from sdm_core.semi_discretization.contact_map import ContactMap
from sdm_core.semi_discretization.step_grid import StepGrid
from sdm_core.semi_discretization.step_maps import ContactCoordinates, StepMaps

LARGEST_STEPS = 1_000_000
LARGEST_MAPS = 30_000_000  # entries of all step maps: 240 MB
_FEW_RUNS = 64  # up to which the reduced equation costs less than the Krylov iteration
_AT_ONCE = 1_000_000  # entries of the coefficients treated at once


@dataclass(frozen=True)
class Structured(ABC):
    """Semi-discretization on the contact history, O(N) in memory.

    A scheme says how it holds the delayed contact displacement over a step. The multipliers are the
    zeros of the reduced equation (`reduced_equation`) where a revolution has few different steps
    (permanent contact, arcs), which takes O(log N) operations; else, and where the circle
    cannot be resolved, they come from Arnoldi iteration on the map of a revolution, O(N) a turn.

    Parameters
    ----------
    steps
        N a revolution, 2 to `LARGEST_STEPS`.
    """

    steps: int = 60

    def __post_init__(self) -> None:
        whole = isinstance(self.steps, int) and not isinstance(self.steps, bool)
        if not whole or not 2 <= self.steps <= LARGEST_STEPS:
            raise InvalidInput("steps", self.steps, f"give a whole number of steps from 2 to {LARGEST_STEPS}")

    @property
    @abstractmethod
    def order(self) -> int:
        """Power of the step with which the error of a multiplier falls."""

    @property
    @abstractmethod
    def values_a_step(self) -> int:
        """Values of the contact displacement kept over a step."""

    @abstractmethod
    def grid(self, equation: DelayEquation) -> StepGrid:
        """The steps of a revolution."""

    @abstractmethod
    def coefficients(self, equation: DelayEquation, grid: StepGrid) -> tuple[np.ndarray, np.ndarray]:
        """What the scheme takes of A and B over each step, shapes (entries, points, d, d)."""

    @abstractmethod
    def step_maps(self, a: np.ndarray, b: np.ndarray, length: np.ndarray, contact: np.ndarray) -> StepMaps:
        """The steps from A (K, points, d, d), B̂ (K, points, d, r), lengths (K,) in s and C (r, d)."""

    def multipliers(self, equation: DelayEquation, count: int = 6) -> np.ndarray:
        """The `count` multipliers of largest modulus, largest first, both half-planes.

        Fewer where the discrete map has no more.

        Raises
        ------
        InvalidInput
            For an unusable count.
        TooMuchWork
            When the steps do not fit into memory, or motion overflows within a revolution.
        """
        if not isinstance(count, int | np.integer) or isinstance(count, bool) or count < 1:
            raise InvalidInput("count", count, "give a whole number from 1 up")
        monodromy = self.contact_map(equation)
        found = None
        if len(monodromy.kind) <= _FEW_RUNS and monodromy.size > count:
            found = reduced_equation.leading(monodromy, int(count))
        if found is None:
            found = monodromy.eigenvalues(int(count))
        return found[np.argsort(-np.abs(found), kind="stable")][:count]

    def state_size(self, equation: DelayEquation) -> int:
        """Most entries the state of the discrete map can have, without building it."""
        rows = len(ContactCoordinates.of(equation).contact)
        return equation.size + self.values_a_step * rows * int(self.grid(equation).repeat.sum())

    def contact_map(self, equation: DelayEquation) -> ContactMap:
        """The monodromy operator, equal steps of the revolution computed once."""
        coordinates = ContactCoordinates.of(equation)
        grid = self.grid(equation)
        known: dict[bytes, int] = {}
        parts: list[StepMaps] = []
        kinds: list[np.ndarray] = []
        entries, made = 0, 0
        chunk = max(1, _AT_ONCE // (8 * equation.size**2))
        for i in range(0, len(grid.start), chunk):
            checkpoint()
            piece = grid[i : i + chunk]
            a, b = coordinates.of_coefficients(*self.coefficients(equation, piece))
            first, inverse = _distinct(a, b, piece.length, known)
            if len(first):
                maps = self.step_maps(a[first], b[first], piece.length[first], coordinates.contact)
                parts.append(maps)
                made += len(maps)
                entries += sum(m.size for m in (maps.p, maps.r, maps.x, maps.y))
            if entries > LARGEST_MAPS:
                raise TooMuchWork("steps", self.steps, "take fewer: their maps need too much memory")
            kinds.append(inverse)
        kind = np.concatenate(kinds)
        starts = np.flatnonzero(np.r_[True, kind[1:] != kind[:-1]])
        return ContactMap(StepMaps.joined(parts), kind[starts], np.add.reduceat(grid.repeat, starts))


@dataclass(frozen=True)
class MeanCoefficients(Structured):
    """Schemes that replace the coefficients by their means over a step ([SBL] Eq. 10): of second order.

    Where an arc ends inside a step the mean keeps the second order, with a constant that wobbles with N; on
    `aligned` steps it stays the same whenever N doubles.

    Parameters
    ----------
    aligned
        Cut every smooth piece of the revolution into steps of its own, instead of N equal ones.
    """

    aligned: bool = False

    @property
    def order(self) -> int:
        return 2

    def grid(self, equation: DelayEquation) -> StepGrid:
        return (StepGrid.aligned if self.aligned else StepGrid.uniform)(equation, self.steps)

    def coefficients(self, equation: DelayEquation, grid: StepGrid) -> tuple[np.ndarray, np.ndarray]:
        a, b = grid.means(equation)
        return a[:, None], b[:, None]


def _distinct(
    a: np.ndarray, b: np.ndarray, length: np.ndarray, known: dict[bytes, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Places of steps not met before, and the number of each step among all met; `known` grows."""
    rows = np.concatenate([a.reshape(len(a), -1), b.reshape(len(b), -1), length[:, None]], axis=1)
    new = np.r_[True, (rows[1:] != rows[:-1]).any(axis=1)]
    first, numbers = [], []
    for i in np.flatnonzero(new):
        key = blake2b(rows[i].tobytes(), digest_size=16).digest()  # the rows would fill the memory
        if key not in known:
            known[key] = len(known)
            first.append(i)
        numbers.append(known[key])
    return np.array(first, dtype=int), np.array(numbers)[np.cumsum(new) - 1]

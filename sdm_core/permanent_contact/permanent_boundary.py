"""Stability boundaries in permanent contact for many blades and speeds at once, each with its proof."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sdm_core.crossings import Crossings
from sdm_core.interruption import checkpoint
from sdm_core.permanent_contact.closed_form import CrossingTable, all_crossings
from sdm_core.permanent_contact.receptance import ContactReceptance, swept
from sdm_core.permanent_contact.root_count import unstable_root_count
from sdm_core.rubbing_blade import LEAST_DAMPING, RubbingBlade

_CHECK = 1e-4  # distance from a crossing, relative in K_e, at which the root count proves it
_AT_ONCE = 4096  # cases by the entries of their F: bounds memory and the time between checkpoints
_TOLERANCES = (1e-2, 1e-4)  # of the sweep, the second where the first proves nothing

Progress = Callable[[int, int], None]
RootCount = Callable[[ContactReceptance, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def permanent_crossings(
    problems: Sequence[RubbingBlade],
    ke_max: float | np.ndarray,
    *,
    progress: Progress | None = None,
    root_count: RootCount = unstable_root_count,
) -> list[Crossings]:
    """Crossings up to `ke_max` of each problem, each taken as in permanent contact.

    The first crossing is proven by the argument principle on either side of it, and so is the sum of
    all at the largest K_e; where a count contradicts, the sweep is repeated finer. Neighbouring
    problems with the same modes share one sweep and one grid of the count.

    Parameters
    ----------
    problems
        Any blades at any speeds; their K_e and arcs are not looked at.
    ke_max
        N/m, one number or one a problem.
    progress
        Called with the number of problems done and of all.
    root_count
        The proof, as `unstable_root_count`.

    Raises
    ------
    TooMuchWork
        For a speed so low that more crossings are possible than one call may solve.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> from sdm_core.contact import ContactConfiguration
    >>> problems = RubbingBlade.at_speeds(
    ...     example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), np.array([200.0, 250.0])
    ... )
    >>> [crossings.proven for crossings in permanent_crossings(problems, 2.5e4)]
    [True, True]
    """
    largest = np.broadcast_to(np.asarray(ke_max, dtype=float), len(problems))
    found: list[Crossings] = [Crossings.none()] * len(problems)
    done = 0
    for cases in _batches(problems):
        checkpoint()
        for i, crossings in zip(cases.index, _solved(cases, largest[cases.index], root_count), strict=True):
            found[i] = crossings
        done += len(cases.index)
        if progress is not None:
            progress(done, len(problems))
    return found


@dataclass(frozen=True)
class _Cases:
    """Cases of one rank p that are solved together.

    Attributes
    ----------
    index
        Place of each case among the problems, shape (c,).
    speed_hz
        Ω, Hz, shape (c,).
    sets
        Set of modes of each case, rising, shape (c,).
    receptance
        The sets of modes.
    """

    index: np.ndarray
    speed_hz: np.ndarray
    sets: np.ndarray
    receptance: ContactReceptance

    def __getitem__(self, rows: np.ndarray) -> _Cases:
        used, sets = np.unique(self.sets[rows], return_inverse=True)
        return _Cases(self.index[rows], self.speed_hz[rows], sets, self.receptance[used])

    @classmethod
    def joined(cls, parts: Sequence[_Cases]) -> _Cases:
        """One after another, padded to the most modes any has with modes out of contact."""
        most = max(part.receptance.omega.shape[1] for part in parts)

        def padded(table: np.ndarray, mode: str) -> np.ndarray:
            width = [(0, 0)] * table.ndim
            width[1] = (0, most - table.shape[1])
            return np.pad(table, width, mode=mode)  # type: ignore[call-overload]

        before = np.cumsum([0] + [len(part.receptance.omega) for part in parts])
        stacks = [part.receptance for part in parts]
        return cls(
            np.concatenate([part.index for part in parts]),
            np.concatenate([part.speed_hz for part in parts]),
            np.concatenate([part.sets + n for part, n in zip(parts, before[:-1], strict=True)]),
            ContactReceptance(
                np.concatenate([padded(s.omega, "edge") for s in stacks]),
                np.concatenate([padded(s.damping_ratio, "edge") for s in stacks]),
                np.concatenate([padded(s.factor, "constant") for s in stacks]),
            ),
        )


def _solved(cases: _Cases, ke_max: np.ndarray, root_count: RootCount) -> list[Crossings]:
    out: list[Crossings] = [Crossings.none()] * len(cases.index)
    left = np.arange(len(out))
    for tolerance in _TOLERANCES:
        table, proven = _attempt(cases[left], ke_max[left], tolerance, root_count)
        for row, i in enumerate(left):
            out[i] = table.of(row)
        left = left[~proven]
        if len(left) == 0:
            break
    for i in left:
        out[i] = replace(out[i], error_estimate=np.full(len(out[i].ke), np.inf), proven=False)
    return out


def _attempt(
    cases: _Cases, ke_max: np.ndarray, tolerance: float, root_count: RootCount
) -> tuple[CrossingTable, np.ndarray]:
    """Crossings, and whether each case is proven."""
    stack, sets = cases.receptance, cases.sets
    if stack.rank == 0:
        return all_crossings(stack, cases.speed_hz, ke_max, sets), np.ones(len(sets), dtype=bool)
    most = np.maximum.reduceat(ke_max, np.searchsorted(sets, np.arange(sets[-1] + 1)))
    table = all_crossings(stack, cases.speed_hz, ke_max, sets, sweep=swept(stack, most, tolerance))
    checks, expected, close = _checks(table, ke_max)
    count = root_count(stack, cases.speed_hz, checks, sets)
    consistent = np.ones(len(sets), dtype=bool)
    consistent[table.case[table.unstable_pairs < 0]] = False
    return table, consistent & ((count == expected) | close).all(axis=1)


def _checks(table: CrossingTable, ke_max: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """K_e to count at: below and above the first crossing, and the largest; shape (c, 3) each.

    Also the unstable roots expected there, and whether a crossing is too close to count.
    """
    begin, end = table.start[:-1], table.start[1:]
    none = begin == end
    # One more row, so that the first crossing of a last case without any can be looked up.
    ke, pairs = np.r_[table.ke, np.inf], np.r_[table.unstable_pairs, 0.0]
    first = np.where(none, ke_max, ke[begin])
    checks = np.column_stack([first * (1 - _CHECK), first * (1 + _CHECK), ke_max])
    checks[none] = ke_max[none, None]
    cases = np.arange(len(ke_max))[:, None]
    # Complex numbers sort by real part, then imaginary part.
    after = np.searchsorted(table.case + 1j * table.ke, cases + 1j * checks, side="right")
    expected = np.where(after > begin[:, None], 2 * pairs[after - 1], 0.0)
    below = (after > begin[:, None]) & (np.abs(ke[after - 1] / checks - 1) < 1e-6)
    above = (after < end[:, None]) & (np.abs(ke[after] / checks - 1) < 1e-6)
    return checks, expected, below | above


def _batches(problems: Sequence[RubbingBlade]) -> Iterator[_Cases]:
    """The problems by rank p, as many together as `_AT_ONCE` allows."""
    by_shape: dict[tuple[int, ...], list[int]] = {}
    for i, problem in enumerate(problems):
        by_shape.setdefault(problem.contact_shape.shape, []).append(i)
    by_rank: dict[int, list[_Cases]] = {}
    for index in by_shape.values():
        for cases in _of_one_shape(problems, np.array(index)):
            by_rank.setdefault(cases.receptance.rank, []).append(cases)
    for parts in by_rank.values():
        cases = _Cases.joined(parts)
        size = cases.receptance.factor[0].size + 1
        new = np.diff(cases.sets, prepend=-1) > 0
        cost = np.cumsum(size * (1 + 4 * new))
        for rows in np.split(np.arange(len(cost)), np.flatnonzero(np.diff(cost // _AT_ONCE)) + 1):
            yield cases[rows]


def _of_one_shape(problems: Sequence[RubbingBlade], index: np.ndarray) -> Iterator[_Cases]:
    """Problems with as many modes and nodes, by rank; neighbours with the same modes share a set."""
    omega = np.array([problems[i].omega for i in index])
    damping = np.maximum(np.array([problems[i].damping_ratio for i in index]), LEAST_DAMPING)
    shape = np.array([problems[i].contact_shape for i in index])
    speed = np.array([problems[i].speed_hz for i in index])
    same = (np.diff(omega, axis=0) == 0).all(axis=1) & (np.diff(damping, axis=0) == 0).all(axis=1)
    same &= (np.diff(shape, axis=0) == 0).all(axis=(1, 2))
    new = np.r_[True, ~same]
    sets = np.cumsum(new) - 1
    # F as in `RubbingBlade.contact_factor`, of all sets at once.
    u, s, _ = np.linalg.svd(np.swapaxes(shape[new], 1, 2), full_matrices=False)
    rank = ((s > 1e-12 * s[:, :1]) & (s > 0)).sum(axis=1)
    for p in np.unique(rank):
        factor = u[:, :, :p] * s[:, None, :p]
        stack = ContactReceptance(omega[new], damping[new], factor)
        yield _Cases(index, speed, sets, stack)[rank[sets] == p]

"""Leading multipliers and verdicts of many rubbing blades at once, arcs or permanent contact."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import partial

import numpy as np

from sdm_core.errors import InvalidInput
from sdm_core.floquet.characteristic import CharacteristicEquation, count_outside
from sdm_core.floquet.contact_expansion import ContactExpansion
from sdm_core.floquet.disc_search import DiscSearch, likely_reach
from sdm_core.floquet.fredholm import LeadingMultipliers, leading_multipliers
from sdm_core.floquet.propagation import for_many, kind, propagation_of
from sdm_core.parallel import available_cores, checked_workers, shared
from sdm_core.rubbing_blade import RubbingBlade

_LARGEST_EXPONENT = 14.0  # of the growth on the rim: e^14 costs six digits
_CIRCLE = 1.3  # R of discs |u| < R that hold the unit circle, times that of the least damped mode
_FARTHER, _FARTHEST = 3.0, 12.0  # R of those tried for multipliers deep inside, likewise
_WIDER, _WIDEST = 1.4, 0.99  # from one disc to the next, and R of the last, where the circle is out of reach
_MOST_DISCS = 8
_CHUNK, _FEWEST = 250, 50  # problems solved together
_WORTH_SHARING = 4000  # problems, for which it pays to start processes

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class BatchMultipliers:
    """Dominant multipliers of many problems.

    Attributes
    ----------
    multiplier
        Of largest modulus, upper half-plane, shape (b,).
    error_estimate
        Relative error of its modulus; infinite where the proof did not succeed.
    outside
        Multipliers outside the unit circle, −1 where not decided.
    by_series
        False where the series did not reach the circle.
    leading, leading_error
        The largest ones of the upper half-plane and their relative errors, shape (b, listed), zero
        where there are no more or where they are not known.
    """

    multiplier: np.ndarray
    error_estimate: np.ndarray
    outside: np.ndarray
    by_series: np.ndarray
    leading: np.ndarray
    leading_error: np.ndarray

    @classmethod
    def unknown(cls, count: int, listed: int) -> BatchMultipliers:
        """Of problems not solved yet."""
        return cls(
            np.zeros(count, dtype=complex),
            np.full(count, np.inf),
            np.full(count, -1),
            np.zeros(count, dtype=bool),
            np.zeros((count, listed), dtype=complex),
            np.zeros((count, listed)),
        )

    def listed(self, at: np.ndarray, found: LeadingMultipliers, rows: np.ndarray) -> None:
        """Take over multipliers found for the problems `at`."""
        self.multiplier[at] = found.multiplier[rows, 0]
        self.error_estimate[at] = found.error_estimate[rows, 0]
        most = min(self.leading.shape[1], found.multiplier.shape[1])
        self.leading[at, :most] = found.multiplier[rows, :most]
        self.leading_error[at, :most] = found.error_estimate[rows, :most]

    @property
    def stable(self) -> np.ndarray:
        """1.0 stable, 0.0 unstable, NaN not decided; one multiplier outside is enough to be unstable."""
        modulus = np.abs(self.multiplier)
        with np.errstate(invalid="ignore"):
            unstable = (self.outside > 0) | (modulus * (1 - self.error_estimate) > 1)
        return np.where(unstable, 0.0, np.where(self.outside == 0, 1.0, np.nan))


def batch_multipliers(
    problems: Sequence[RubbingBlade],
    *,
    dominant: bool = True,
    thorough: bool = True,
    listed: int = 1,
    progress: Progress | None = None,
    workers: int | None = None,
) -> BatchMultipliers:
    """Dominant multiplier and number of unstable ones of each problem.

    Problems with equally many modes are solved together, at most `_CHUNK` at a time: memory stays
    bounded, and the work can be stopped between array operations (`interruption`).

    Parameters
    ----------
    dominant
        False where only the number of unstable ones is asked for: multipliers far inside the circle
        are then not looked for, and come back as zero.
    thorough
        False where points that no series reaches may stay undecided rather than be solved one by one.
    listed
        How many leading multipliers are made exact and given.
    progress
        Called with problems solved and their number.
    workers
        Processes to share the work. None takes all cores that this process may use where there are
        problems enough to be worth it.
    """
    if not isinstance(listed, int) or listed < 1:
        raise InvalidInput("listed", listed, "give a whole number from 1 up")
    out = BatchMultipliers.unknown(len(problems), listed)
    if workers is None:
        workers = available_cores() if len(problems) >= _WORTH_SHARING else 1
    workers = checked_workers(workers)
    kinds = [kind(p) for p in problems]
    parts = []
    for one in sorted(set(kinds), reverse=True):  # those that take longest first
        members = np.flatnonzero([k == one for k in kinds])
        size = min(_CHUNK, max(_FEWEST, -(-len(members) // workers)))
        parts += [members[i : i + size] for i in range(0, len(members), size)]
    solve = partial(_solve, dominant=dominant, thorough=thorough, listed=listed)
    finished = 0
    for i, found in shared(solve, [[problems[k] for k in rows] for rows in parts], workers):
        for f in fields(BatchMultipliers):
            getattr(out, f.name)[parts[i]] = getattr(found, f.name)
        finished += len(parts[i])
        if progress is not None:
            progress(finished, len(problems))
    return out


def _solve(problems: list[RubbingBlade], *, dominant: bool, thorough: bool, listed: int) -> BatchMultipliers:
    """Of problems of one kind with equally many modes."""
    out = BatchMultipliers.unknown(len(problems), listed)
    motion = propagation_of(problems)
    ke = np.array([p.ke for p in problems])
    # Without contact the series is a constant: any tiny disc holds it.
    centre = np.maximum(ke, 1e-18 / np.maximum(motion.phase_shift, 1e-300))
    # Over a revolution, to first order, at |Im c| = K_e.
    growth = np.maximum(motion.phase_shift * centre, 1e-300)
    slowest = np.exp((motion.damping_ratio * motion.angle).min(axis=1))
    # At least as far as the circle, else the largest disc whose series holds its digits.
    held = _LARGEST_EXPONENT / growth
    todo = np.flatnonzero(_CIRCLE * slowest < held)
    if len(todo):
        reach = np.maximum(_CIRCLE, np.minimum(_CIRCLE * slowest, held))[todo]
        found = leading_multipliers(
            ContactExpansion.of(motion[todo], centre[todo], reach), ke[todo], polished=listed
        )
        decided = found.outside >= 0
        out.listed(todo[decided], found, decided)
        out.outside[todo] = found.outside
        out.by_series[todo] = decided
    # Those whose dominant multiplier lies farther inside than the disc reaches.
    inner = out.by_series & (out.multiplier == 0) & dominant
    rest = ~out.by_series
    pending = np.flatnonzero(rest | inner)
    if len(pending) == 0:
        return out
    largest = np.where(inner, np.minimum(_FARTHEST * slowest, held), _WIDEST)
    many = for_many(motion[pending], ((1 + np.maximum(largest, 1.0)) * centre)[pending])
    if rest.any():
        out.outside[rest] = count_outside(motion[rest], ke[rest], many[rest[pending]])
    # Much contact: multipliers far outside the circle are found on a smaller disc, and prove instability
    # even where rounding hides the number of the others.
    strong = rest & (growth * _CIRCLE >= 1.0) & (dominant | (out.outside < 0))
    first = _FARTHER * slowest
    first[strong] = likely_reach(many[strong[pending]], centre[strong], growth[strong], _WIDEST)
    seek, many = np.flatnonzero(inner | strong), many[(inner | strong)[pending]]
    wider = np.where(inner, _FARTHEST / _FARTHER, _WIDER)
    search = DiscSearch.of(first[seek], largest[seek], wider[seek])
    for _ in range(_MOST_DISCS):
        if len(seek) == 0:
            break
        expansion = ContactExpansion.of(motion[seek], centre[seek], search.reach, many)
        found = leading_multipliers(expansion, ke[seek], polished=listed)
        far = found.resolved & (found.multiplier[:, 0] != 0)
        out.listed(seek[far], found, far)
        search, go = search.after(found.resolved, far)
        seek, many = seek[go], many[go]
    for k in pending if thorough else ():
        count, equation = int(out.outside[k]), CharacteristicEquation(problems[k])
        if out.multiplier[k] != 0 or not (dominant or count < 0):
            continue
        found_one = equation.dominant(None if count < 0 else count) if dominant else equation.one_outside()
        out.multiplier[k], out.error_estimate[k] = found_one
        out.leading[k, 0], out.leading_error[k, 0] = found_one
    return out

"""Leading multipliers and verdicts of many rubbing blades at once, arcs or permanent contact."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sdm_core.characteristic import CharacteristicEquation, count_outside
from sdm_core.contact_expansion import ContactExpansion
from sdm_core.fredholm import LeadingMultipliers, leading_multipliers
from sdm_core.parallel import available_cores, in_threads
from sdm_core.propagation import kind, propagation_of
from sdm_core.rubbing_blade import RubbingBlade

_LARGEST_EXPONENT = 14.0  # of the growth on the rim: e^14 costs six digits
# Discs tried in turn where the circle is out of reach; moderate growth has a multiplier on a smaller one.
_MODERATE, _MODERATE_EXPONENT = 60.0, 6.0
_STRONG_EXPONENTS = (12.0, 9.0, 15.0, 18.0, 6.0, 10.5, 21.0, 13.5)
_REACHES = (1.3, 3.0, 12.0)  # times that of the least damped mode; each round those not found yet
_CHUNK, _FEWEST = 250, 50  # problems solved together

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
    threads: int | None = None,
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
        Called with problems solved and their number, in the calling thread.
    threads
        Threads to share the work; None takes all cores that this process may use.
    """
    b = len(problems)
    out = BatchMultipliers(
        np.zeros(b, dtype=complex),
        np.full(b, np.inf),
        np.full(b, -1),
        np.zeros(b, dtype=bool),
        np.zeros((b, listed), dtype=complex),
        np.zeros((b, listed)),
    )
    kinds = [kind(p) for p in problems]
    threads = available_cores() if threads is None else threads
    parts = []
    for one in sorted(set(kinds)):
        members = np.flatnonzero([k == one for k in kinds])
        size = min(_CHUNK, max(_FEWEST, -(-len(members) // threads)))
        parts += [members[i : i + size] for i in range(0, len(members), size)]
    finished = 0

    def solve(rows: np.ndarray) -> int:
        _solve([problems[k] for k in rows], rows, out, dominant, thorough)
        return len(rows)

    for solved in in_threads(solve, parts, threads):
        finished += solved
        if progress is not None:
            progress(finished, b)
    return out


def _list(out: BatchMultipliers, at: np.ndarray, found: LeadingMultipliers, rows: np.ndarray) -> None:
    out.multiplier[at] = found.multiplier[rows, 0]
    out.error_estimate[at] = found.error_estimate[rows, 0]
    most = min(out.leading.shape[1], found.multiplier.shape[1])
    out.leading[at, :most] = found.multiplier[rows, :most]
    out.leading_error[at, :most] = found.error_estimate[rows, :most]


def _solve(
    problems: list[RubbingBlade], rows: np.ndarray, out: BatchMultipliers, dominant: bool, thorough: bool
) -> None:
    motion, listed = propagation_of(problems), out.leading.shape[1]
    ke = np.array([p.ke for p in problems])
    # Without contact the series is a constant: any tiny disc holds it.
    centre = np.maximum(ke, 1e-18 / np.maximum(motion.phase_shift, 1e-300))
    growth = np.maximum(
        motion.phase_shift * centre, 1e-300
    )  # over a revolution, to first order, at |Im c| = K_e
    slowest = np.exp((motion.damping_ratio * motion.angle).min(axis=1))
    todo = np.flatnonzero(growth * _REACHES[0] * slowest < _LARGEST_EXPONENT)
    for factor in _REACHES:
        if len(todo) == 0:
            break
        # At least as far as the circle, else the largest disc whose series holds its digits.
        reach = np.maximum(_REACHES[0], np.minimum(factor * slowest[todo], _LARGEST_EXPONENT / growth[todo]))
        series = ContactExpansion.of(motion[todo], centre[todo], reach)
        found = leading_multipliers(series, ke[todo], polished=listed)
        decided = (found.outside >= 0) & ((found.multiplier[:, 0] != 0) | (not dominant))
        at = rows[todo[decided]]
        _list(out, at, found, decided)
        out.outside[at] = found.outside[decided]
        out.by_series[at] = True
        todo = todo[~decided]
    rest = np.flatnonzero(~out.by_series[rows])
    if len(rest) == 0:
        return
    out.outside[rows[rest]] = count_outside(motion[rest], ke[rest])
    # Much contact: multipliers far outside the circle are found on a smaller disc, and prove instability
    # even where rounding hides the number of the others.
    wanted = growth[rest] * _REACHES[0] >= 1.0
    strong = rest[wanted & (dominant | (out.outside[rows[rest]] < 0))]
    for exponent in (_MODERATE_EXPONENT, *_STRONG_EXPONENTS):
        if len(strong) == 0:
            break
        exponents = np.where(growth[strong] < _MODERATE, exponent, max(exponent, _STRONG_EXPONENTS[0]))
        reach = np.minimum(exponents / growth[strong], 0.99)
        expansion = ContactExpansion.of(motion[strong], centre[strong], reach)
        found = leading_multipliers(expansion, ke[strong], polished=listed)
        far = found.resolved & (found.multiplier[:, 0] != 0)
        _list(out, rows[strong[far]], found, far)
        strong = strong[~far]
    for k in rest if thorough else ():
        count, equation = int(out.outside[rows[k]]), CharacteristicEquation(problems[k])
        if out.multiplier[rows[k]] != 0 or not (dominant or count < 0):
            continue
        found_one = equation.dominant(None if count < 0 else count) if dominant else equation.one_outside()
        out.multiplier[rows[k]], out.error_estimate[rows[k]] = found_one
        out.leading[rows[k], 0], out.leading_error[rows[k], 0] = found_one

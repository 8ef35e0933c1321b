"""Argument principle on circles: zeros of many analytic functions counted at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

_LARGEST_STEP = 1.2  # rad of phase between neighbouring points of a circle
_LARGEST_BEND = 0.7  # change of the logarithm from one interval to the next, beyond its linear course
_MOST_POINTS = 60_000
_NARROWEST = 1e-13  # rad

Value = Callable[[np.ndarray, np.ndarray], np.ndarray]


def half_turns(value: Value, first_points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turns of the phase of each function from angle 0 to π, in multiples of π; NaN where not followed.

    Points are added where the phase turns much between neighbours, or where its logarithm bends: of
    two zeros that hide each other's turn between two points the size of the function tells.

    Parameters
    ----------
    value
        f(case, angle) of the functions, flat; f(−angle) is the conjugate. A value that is zero or
        not finite gives the case up.
    first_points
        Points on the half circle to begin with, shape (b,); zero for functions not to be followed.

    Returns
    -------
    Turns, shape (b,), and the angle at which each function is smallest among the points seen.
    """
    b = len(first_points)
    first = np.where(first_points > 0, np.maximum(first_points, 3), 0)
    case = np.repeat(np.arange(b), first)
    start = np.cumsum(first) - first
    angle = np.pi * (np.arange(len(case)) - start[case]) / (first[case] - 1)
    f = value(case, angle) if len(case) else np.zeros(0, dtype=complex)
    turns, lowest, nearest = np.full(b, np.nan), np.full(b, np.inf), np.zeros(b)
    while len(case):
        _smallest(case, angle, f, lowest, nearest)
        with np.errstate(all="ignore"):
            usable = np.isfinite(f) & (f != 0)
        failed = np.zeros(b, dtype=bool)
        failed[case[~usable]] = True
        failed |= np.bincount(case, minlength=b) > _MOST_POINTS
        keep = ~failed[case]
        case, angle, f = case[keep], angle[keep], f[keep]
        if len(case) == 0:
            break
        step, coarse = _steps(case, angle, f)
        failed[case[:-1][coarse & (np.diff(angle) < _NARROWEST)]] = True
        unfinished = np.zeros(b, dtype=bool)
        unfinished[case[:-1][coarse]] = True
        inner = case[1:] == case[:-1]
        total = np.bincount(case[:-1][inner], step[inner], minlength=b)
        done = np.zeros(b, dtype=bool)
        done[case] = True
        done &= ~unfinished & ~failed
        turns[done] = total[done] / np.pi
        coarse &= ~failed[case[:-1]]
        left = np.flatnonzero(coarse)
        middle = 0.5 * (angle[left] + angle[left + 1])
        new = value(case[left], middle) if len(left) else np.zeros(0, dtype=complex)
        case, angle, f = (
            np.insert(case, left + 1, case[left]),
            np.insert(angle, left + 1, middle),
            np.insert(f, left + 1, new),
        )
        go = (unfinished & ~failed)[case]
        case, angle, f = case[go], angle[go], f[go]
    return turns, nearest


def _steps(case: np.ndarray, angle: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turn of the phase over each interval and whether the interval is too coarse."""
    inner = case[1:] == case[:-1]
    step = np.where(inner, np.angle(f[1:] / f[:-1]), 0.0)
    width = np.where(inner, np.diff(angle), 1.0)
    slope = (np.log(np.abs(f[1:]) / np.abs(f[:-1])) + 1j * step) / width
    # Beyond an end the function goes on as its mirror image: size even, phase odd.
    before, after = np.r_[0.0, slope[:-1]], np.r_[slope[1:], 0.0]
    first, last = np.r_[True, ~inner[:-1]], np.r_[~inner[1:], True]
    before = np.where(first, -slope.conj(), before)
    after = np.where(last, -slope.conj(), after)
    bend = np.maximum(np.abs(slope - before), np.abs(slope - after)) * width
    return step, inner & ((np.abs(step) > _LARGEST_STEP) | (bend > _LARGEST_BEND))


def _smallest(
    case: np.ndarray, angle: np.ndarray, f: np.ndarray, lowest: np.ndarray, nearest: np.ndarray
) -> None:
    size = np.where(np.isfinite(f), np.abs(f), np.inf)
    order = np.lexsort((size, case))
    head = order[np.r_[True, np.diff(case[order]) > 0]]
    better = size[head] < lowest[case[head]]
    lowest[case[head[better]]] = size[head[better]]
    nearest[case[head[better]]] = angle[head[better]]

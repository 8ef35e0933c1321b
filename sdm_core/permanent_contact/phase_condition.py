"""Where the phase of the delay lets a root lie on the imaginary axis in permanent contact: first guesses."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from sdm_core.errors import TooMuchWork
from sdm_core.interruption import checkpoint
from sdm_core.permanent_contact.receptance import ContactReceptance, Sweep

MOST_CANDIDATES = 1_000_000
_AT_ONCE = 30_000  # guesses handed on together
_SUBDIVISION = np.linspace(0.0, 1.0, 5)
_HALVINGS = 40


@dataclass(frozen=True)
class Guesses:
    """Near solutions of ψ(ω) = ωτ + π − 2α = 2πk (`closed_form.all_crossings`).

    Attributes
    ----------
    case, turn
        The case (delay and set of modes), and k; shape (m,).
    w, z
        ω in rad/s and 1/λ in N/m, shape (m,).
    spread
        Width of the interval of the sweep it lies in, rad/s, shape (m,).
    """

    case: np.ndarray
    turn: np.ndarray
    w: np.ndarray
    z: np.ndarray
    spread: np.ndarray

    def __getitem__(self, rows: np.ndarray) -> Guesses:
        return Guesses(self.case[rows], self.turn[rows], self.w[rows], self.z[rows], self.spread[rows])


@dataclass(frozen=True)
class _Lines:
    """Stretches of a sweep that are taken as straight in 1/λ.

    Attributes
    ----------
    w, z
        ω and 1/λ at both ends, shape (2, k).
    spread
        Width of the interval of the sweep, rad/s, shape (k,).
    sets
        Set of modes, rising, shape (k,).
    """

    w: np.ndarray
    z: np.ndarray
    spread: np.ndarray
    sets: np.ndarray

    @property
    def slope(self) -> np.ndarray:
        """dψ/dω at both ends but for τ, 2 Im(z′/z), s, shape (2, k)."""
        return 2 * ((self.z[1] - self.z[0]) / (self.w[1] - self.w[0]) / self.z).imag

    def __getitem__(self, rows: np.ndarray) -> _Lines:
        return _Lines(self.w[:, rows], self.z[:, rows], self.spread[rows], self.sets[rows])

    def at(self, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """ω and 1/λ at shares of the way from left to right."""
        (w, w_end), (z, z_end) = self.w, self.z
        return w + share * (w_end - w), z + share * (z_end - z)

    def pairs(self, sets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Every pair of a case and a line with its set of modes."""
        first = np.searchsorted(self.sets, sets)
        return _expanded(first, np.searchsorted(self.sets, sets, side="right") - first)


def loss_angle(value: np.ndarray) -> np.ndarray:
    """α = arg(−λ), between 0 and π, from λ or 1/λ."""
    return np.arctan2(np.abs(value.imag), -value.real)  # rounding may leave Im λ = 0


def guesses(
    receptance: ContactReceptance, sweep: Sweep, tau: np.ndarray, sets: np.ndarray, ke_max: float
) -> Iterator[Guesses]:
    """First guesses at every root with K_e up to a little above `ke_max`, some at a time.

    Parameters
    ----------
    tau, sets
        Delay in s and set of modes of each case, shape (cases,).

    Raises
    ------
    TooMuchWork
        Where a case has `MOST_CANDIDATES` or more.
    """
    # A root needs Re λ < 0; a little to spare, because the line is an approximation.
    a, b = sweep.z_left.T, sweep.z_right.T
    low = (a.real < 0.05 * np.abs(a)) | (b.real < 0.05 * np.abs(b))
    soft = np.minimum(np.abs(a), np.abs(b)) - 0.5 * np.abs(b - a) < 3 * ke_max
    i, branch = np.nonzero(low & soft)
    w, z = np.array([sweep.left[i], sweep.right[i]]), np.array([a[i, branch], b[i, branch]])
    lines = _Lines(w, z, w[1] - w[0], sweep.sets[i])
    yield from _passing(_pieces(lines, ke_max), tau, sets)
    yield from _turning(receptance, lines, tau, sets)


def _pieces(lines: _Lines, ke_max: float) -> _Lines:
    """The lines in four, where K_e = |1/λ|²/(−2 Re 1/λ) may be small enough."""
    w, z = (table.T for table in lines.at(_SUBDIVISION[:, None]))
    small = np.abs(z) ** 2 < 2.4 * ke_max * (0.05 * np.abs(z) - z.real)
    row, piece = np.nonzero(small[:, :-1] | small[:, 1:])
    w, z = (np.array([table[row, piece], table[row, piece + 1]]) for table in (w, z))
    return _Lines(w, z, lines.spread[row], lines.sets[row])


def _passing(lines: _Lines, tau: np.ndarray, sets: np.ndarray) -> Iterator[Guesses]:
    """Where ψ, straight from end to end, passes 2πk.

    The k are counted by rounding ψ/2π up at both ends, which joins without gap or overlap from
    line to line.
    """
    case, i = lines.pairs(sets)
    rate = tau[case] / (2 * np.pi)
    start, end = lines.w[:, i] * rate + (0.5 - loss_angle(lines.z) / np.pi)[:, i]
    passed = np.ceil(np.minimum(start, end))
    every = np.ceil(np.maximum(start, end)) - passed
    total = np.bincount(case, every, minlength=len(tau))
    if not (total < MOST_CANDIDATES).all():
        worst = int(total.argmax())
        raise TooMuchWork(
            "speed_hz",
            float(1 / tau[worst]),
            f"raise it or lower K_e: {total[worst]:.3g} possible crossings to solve",
        )
    run = np.cumsum(every.astype(int))
    for begin in range(0, int(run[-1]) if len(run) else 0, _AT_ONCE):
        number = np.arange(begin, min(begin + _AT_ONCE, run[-1]))
        rows = np.searchsorted(run, number, side="right")
        turn = passed[rows] + number - (run[rows] - every[rows])
        found = lines[i[rows]]
        w, z = found.at((turn - start[rows]) / (end[rows] - start[rows]))
        yield Guesses(case[rows], turn, w, z, found.spread)


def _turning(
    receptance: ContactReceptance, lines: _Lines, tau: np.ndarray, sets: np.ndarray
) -> Iterator[Guesses]:
    """Where ψ turns back within an interval of the sweep, on either side of its turning point.

    Next to the turning point two solutions may hide that the straight line does not show, and
    Newton's method wanders. Both sides are searched by bisection of the exact phase.
    """
    # 1/λ strays from the line by 1e-2, so that the slope of a half interval is wrong by 2e-2/width.
    lines = lines[lines.slope.min(axis=0) - 0.03 / lines.spread < -tau.min()]
    slope = np.empty((2, len(lines.sets)))
    for side in (0, 1):
        lam, by_w = receptance.eigenvalue_near(lines.w[side], lines.z[side], lines.sets)
        slope[side] = -2 * (by_w / lam).imag
    case, i = lines.pairs(sets)
    rate = tau[case] + slope[:, i]
    turns = (lines.w[:, i] * tau[case] + np.pi - 2 * loss_angle(lines.z)[:, i]) / (2 * np.pi)
    # The turning point is the top of sign · ψ, and at most |ψ′| · width above its ends.
    sign = np.sign(rate[0])
    top = (sign * turns).max(axis=0)
    reach = np.abs(rate).max(axis=0) * lines.spread[i] / (2 * np.pi)
    near = (rate[0] * rate[1] < 0) & (np.floor(top + reach) > np.floor(top - 0.05))
    case, i, sign = case[near], i[near], sign[near]
    if len(case) == 0:
        return
    line, t = lines[i], tau[case]

    def exact(share: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, ...]:
        """ψ/2π, its slope, ω and 1/λ."""
        w, z = line[rows].at(share)
        for _ in range(1 if receptance.rank <= 2 else 3):  # from a guess good to 1e-2
            lam, by_w = receptance.eigenvalue_near(w, z, line.sets[rows])
            z = 1 / lam
        turn = (w * t[rows] + np.pi - 2 * loss_angle(lam)) / (2 * np.pi)
        return turn, t[rows] - 2 * (by_w / lam).imag, w, z

    rows = np.arange(len(case))
    middle = _bisected(np.zeros(len(rows)), np.ones(len(rows)), lambda s: sign * exact(s, rows)[1] > 0)
    start, peak, end = (exact(share, rows)[0] for share in (0 * middle, middle, 0 * middle + 1))
    for low, high, a, b in ((0 * middle, middle, start, peak), (middle, 0 * middle + 1, peak, end)):
        first = np.ceil(np.minimum(a, b))
        rows, turn = _expanded(first.astype(int), (np.ceil(np.maximum(a, b)) - first).astype(int))
        rising = (b > a)[rows]
        share = _bisected(low[rows], high[rows], lambda s: (exact(s, rows)[0] < turn) == rising)  # noqa: B023
        _, _, w, z = exact(share, rows)
        yield Guesses(case[rows], turn.astype(float), w, z, line.spread[rows])


def _bisected(low: np.ndarray, high: np.ndarray, before: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Where `before` ceases to hold between low and high, shape (k,)."""
    for _ in range(_HALVINGS):
        checkpoint()
        middle = 0.5 * (low + high)
        left = before(middle)
        low, high = np.where(left, middle, low), np.where(left, high, middle)
    return 0.5 * (low + high)


def _expanded(first: np.ndarray, count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Owner and member of every element of the ranges [first, first + count)."""
    owner = np.repeat(np.arange(len(first)), count)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(count) - count - first, count)

"""First crossings of many cases with arcs of contact, by verdicts of the batched exact core."""

from __future__ import annotations

import numpy as np

from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.rubbing_blade import RubbingBlade

# A verdict takes 0.2 to 0.5 ms where every crossing of a speed takes 50 ms (decision 8), so that bracketing
# the crossing next to a guess, and looking for islands of instability below it, is the cheaper label. Steps
# and tolerances in log10 K_e.
_TOLERANCE = 1e-4
_FIRST_STEP = 0.6 * _TOLERANCE  # a good guess is then bracketed at once
_SECOND_STEP, _GROWTH, _LOWEST = 0.02, 3.0, -5.0
_FALSE_POSITIONS, _MOST_ROUNDS = 4, 60
# Where islands are looked for below the boundary found: those seen lay within a factor of five.
_BELOW = np.array([0.7, 0.57, 0.45, 0.34, 0.24, 0.15, 0.08, 0.03])


def crossings_by_verdicts(
    problems: list[RubbingBlade], guess: np.ndarray, scale: np.ndarray, largest_kappa: float
) -> np.ndarray:
    """κ of the first crossing, to 0.02 %; shape (m,).

    A bracket is stepped out from a guess with growing steps and closed by false position on ln|μ|. Below the
    crossing found, islands of instability are looked for: at eight stiffnesses down to a fifth, and at the
    top of the parabola through ln|μ| wherever it has one between them. One in fifty random blades has an
    island; those narrower than the steps may be missed.

    Parameters
    ----------
    problems
        With arcs, any K_e.
    guess
        log10 κ to start from.
    scale
        N/m, K_e = κ·scale, shape (m,).

    Returns
    -------
    Infinite where the blade is stable at `largest_kappa`, NaN where a verdict was not decided.
    """
    search = _Search(problems, scale, float(np.log10(largest_kappa)))
    search.close(np.arange(len(problems)), guess)
    search.close(search.islands())
    return search.kappa


class _Search:
    """Brackets in log10 κ, and ln|μ| at their ends."""

    def __init__(self, problems: list[RubbingBlade], scale: np.ndarray, top: float) -> None:
        m = len(problems)
        self.problems, self.scale, self.top = problems, scale, top
        self.low, self.high = np.full(m, -np.inf), np.full(m, np.inf)
        self.growth_low, self.growth_high = np.full(m, np.nan), np.full(m, np.nan)
        self.kappa = np.full(m, np.nan)

    def ask(self, rows: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Verdicts, and ln|μ| where it is known, of cases at log10 κ."""
        ke = self.scale[rows] * 10.0**x
        problems = [self.problems[i].with_ke(float(k)) for i, k in zip(rows, ke, strict=True)]
        found = batch_multipliers(problems, dominant=False, workers=1)
        with np.errstate(divide="ignore"):
            growth = np.log(np.abs(found.multiplier))
        return found.stable, np.where(np.isfinite(growth), growth, np.nan)

    def close(self, rows: np.ndarray, guess: np.ndarray | None = None) -> None:
        """Close the brackets of cases, starting from a guess where there is none yet."""
        step = np.full(len(self.kappa), _FIRST_STEP)
        at = np.empty(len(self.kappa))
        # Not at the guess itself: exactly on the boundary nothing is decided.
        start = self._inside(rows) if guess is None else guess[rows] - 0.5 * _FIRST_STEP
        at[rows] = np.clip(start, _LOWEST, self.top)
        for turn in range(_MOST_ROUNDS):
            if len(rows) == 0:
                return
            x = at[rows]
            stable, growth = self.ask(rows, x)
            yes, no = stable == 1.0, stable == 0.0
            self.low[rows[yes]], self.growth_low[rows[yes]] = x[yes], growth[yes]
            self.high[rows[no]], self.growth_high[rows[no]] = x[no], growth[no]
            open_above = yes & (x >= self.top)
            self.kappa[rows[open_above]] = np.inf
            closed = self.high[rows] - self.low[rows] <= _TOLERANCE
            done = rows[closed]
            self.kappa[done] = 10.0 ** (0.5 * (self.low[done] + self.high[done]))
            undecided = rows[np.isnan(stable)]
            rows = rows[~(open_above | closed | np.isnan(stable) | (self.high[rows] <= _LOWEST))]
            slow = turn > _FALSE_POSITIONS and turn % 2 == 0  # one end stays where it is
            up = np.minimum(self.low[rows] + step[rows], self.top)
            down = np.maximum(self.high[rows] - step[rows], _LOWEST)
            no_top, no_bottom = np.isinf(self.high[rows]), np.isinf(self.low[rows])
            at[rows] = np.where(no_top, up, np.where(no_bottom, down, self._inside(rows, halve=slow)))
            open_end = rows[no_top | no_bottom]
            step[open_end] = np.maximum(_SECOND_STEP, _GROWTH * step[open_end])
            at[undecided] -= 0.2 * _TOLERANCE  # on a boundary, as near as can be told
            rows = np.concatenate([rows, undecided])

    def _inside(self, rows: np.ndarray, *, halve: bool = False) -> np.ndarray:
        """Where to ask within brackets: at the root of the straight line through ln|μ|, else half way."""
        low, high = self.low[rows], self.high[rows]
        with np.errstate(invalid="ignore", divide="ignore"):
            middle = 0.5 * (low + high)
            share = -self.growth_low[rows] / (self.growth_high[rows] - self.growth_low[rows])
            root = low + share * (high - low)
            # A little past the root, towards the farther end: the bracket then closes from both sides.
            root += np.where(share < 0.5, 1, -1) * np.minimum(0.4 * _TOLERANCE, 0.1 * (high - low))
        return np.where((share > 0.0) & (share < 1.0) & (not halve), root, middle)

    def islands(self) -> np.ndarray:
        """Cases with an island below, their brackets now at its lower edge."""
        rows = np.flatnonzero(np.isfinite(self.kappa) | np.isinf(self.kappa))
        above = np.where(np.isinf(self.kappa[rows]), self.top, np.log10(self.kappa[rows]))
        x = above[:, None] - _BELOW
        every = np.repeat(rows, len(_BELOW))
        stable, growth = (a.reshape(x.shape) for a in self.ask(every, x.ravel()))
        # The top of the parabola through three neighbours, where the middle one is the highest.
        left, middle, right = growth[:, :-2], growth[:, 1:-1], growth[:, 2:]
        i, j = np.nonzero((middle >= left) & (middle >= right) & (stable[:, 1:-1] == 1.0))
        before, after = (x[i, j + 1] - x[i, j]), (x[i, j + 2] - x[i, j + 1])
        rise, fall = (middle - left)[i, j] / before, (right - middle)[i, j] / after
        shift = 0.5 * (rise * after + fall * before) / np.maximum(rise - fall, 1e-300)
        peak = x[i, j + 1] + np.clip(shift, -0.5 * before, 0.5 * after)
        at_peak, growth_peak = self.ask(rows[i], peak)
        moved = []
        for row in range(len(rows)):
            here = i == row
            points = np.r_[x[row], peak[here]]
            verdict, ln_mu = np.r_[stable[row], at_peak[here]], np.r_[growth[row], growth_peak[here]]
            order = np.argsort(points)
            points, verdict, ln_mu = points[order], verdict[order], ln_mu[order]
            unstable = np.flatnonzero(verdict == 0.0)
            if len(unstable) == 0:
                continue
            case, first = rows[row], unstable[0]
            moved.append(case)
            self.kappa[case] = np.nan
            self.high[case], self.growth_high[case] = points[first], ln_mu[first]
            known = first > 0 and verdict[first - 1] == 1.0
            self.low[case] = points[first - 1] if known else -np.inf
            self.growth_low[case] = ln_mu[first - 1] if known else np.nan
        return np.array(moved, dtype=int)

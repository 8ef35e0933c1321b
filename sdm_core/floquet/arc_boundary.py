"""Stability boundaries with arcs of contact: multipliers followed over K_e, crossings by Newton's method."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from sdm_core.crossings import Crossings
from sdm_core.floquet.arc_stability import batch_multipliers
from sdm_core.floquet.branch_samples import BranchSamples
from sdm_core.floquet.characteristic import CharacteristicEquation
from sdm_core.floquet.contact_expansion import ContactExpansion
from sdm_core.floquet.fredholm import leading_multipliers, slopes
from sdm_core.floquet.propagation import kind, propagation_of
from sdm_core.interruption import checkpoint
from sdm_core.parallel import available_cores, checked_workers, shared
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.validation import KE_LIMIT, number

_WIDEST = 0.12  # of ln K_e between neighbouring samples
_GREATEST_GROWTH = 0.1  # of the contact's growth a revolution between them, so that no branch is overtaken
NARROWEST_ISLAND = 1e-3  # of ln K_e: what happens within less may be missed
NARROWEST_UNFOLLOWED = 5e-3  # likewise where contact is too strong for branches to be followed
_BRACKET = 1e-8  # of ln K_e, where Newton's method finds nothing
_BESIDE = 1e-6  # of ln K_e: samples on both sides of a crossing
_REACH = 1.3
_SERIES_HOLD = 14.0 / _REACH  # growth a revolution up to which series count multipliers
_BAND = 4.0  # K_e over which one series serves, where contact is strong
_WEAK = 1.0  # growth up to which one series serves down to zero
_FOLLOWED = 0.4  # of |ln |μ||: branches that may reach the circle between two samples
_MOST_ROUNDS = 60
_POINTS, _SPEEDS = 800, 20  # solved together
_WORTH_SHARING = 60  # speeds, for which it pays to start processes
# Between neighbouring stiffnesses beyond the series: of growth by e^11 a revolution, and of any.
_STRONG_RATIO, _STRONGEST_RATIO = 1.06, 2.0

Progress = Callable[[int, int], None]


def least_destabilising_ke(problem: RubbingBlade) -> float:
    """A K_e, N/m, below which no contact of any arcs is unstable (small-gain theorem).

    The force is −K_e γ (1 − delay) applied to H; γ has gain at most 1 and (1 − delay) at most 2,
    so 2 K_e sup_ω ‖H(iω)‖ < 1 is stable.
    """
    if problem.contact_factor.shape[1] == 0:
        return np.inf
    # ‖H(iω)‖ ≤ Σ_j |h_j(iω)| G_jj, and |h_j| is at most 1/(2ξω²√(1 − ξ²)), or 1/ω² above ξ = 1/√2.
    xi = np.minimum(problem.damping_ratio, np.sqrt(0.5))
    peak = 1.0 / (2 * xi * np.sqrt(1 - xi**2) * problem.omega**2)
    return float(1.0 / (2.0 * (peak * problem.contact_matrix.diagonal()).sum()))


def arc_crossings(problem: RubbingBlade, ke_max: float) -> Crossings:
    """`boundaries_with_arcs` at one speed."""
    return boundaries_with_arcs([problem], ke_max)[0]


def boundaries_with_arcs(
    problems: Sequence[RubbingBlade],
    ke_max: float,
    *,
    progress: Progress | None = None,
    workers: int | None = None,
) -> list[Crossings]:
    """K_e up to `ke_max` at which each blade becomes unstable or stable again.

    From the small-gain bound up the leading multipliers and their derivatives are known at samples
    of K_e, their number outside the circle by the argument principle. Between two samples the
    tangents tell whether a branch may cross the circle and come back: then the interval is
    halved, down to `NARROWEST_ISLAND`. Each change of the verdict is solved for arg μ and K_e together.
    A sample that cannot be decided is never called stable; where one lies below the first crossing
    the crossings are not `proven`.

    Parameters
    ----------
    problems
        Each its own speed; their K_e is not used.
    ke_max
        N/m.
    progress
        Called with speeds solved and their number.
    workers
        Processes to share the work; None as in `batch_multipliers`.
    """
    ke_max = number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    out: list[Crossings] = [Crossings.none()] * len(problems)
    kinds = [kind(p) for p in problems]
    if workers is None:
        workers = available_cores() if len(problems) >= _WORTH_SHARING else 1
    workers = checked_workers(workers)
    parts = []
    for one in sorted(set(kinds), reverse=True):  # those that take longest first
        rows = np.flatnonzero([k == one for k in kinds])
        size = min(_SPEEDS, max(4, -(-len(rows) // workers)))
        parts += [rows[i : i + size] for i in range(0, len(rows), size)]
    finished = 0
    solve = partial(_crossings, ke_max=ke_max)
    for i, found in shared(solve, [[problems[k] for k in rows] for rows in parts], workers):
        for row, crossings in zip(parts[i], found, strict=True):
            out[row] = crossings
        finished += len(parts[i])
        if progress is not None:
            progress(finished, len(problems))
    return out


def _crossings(problems: list[RubbingBlade], ke_max: float) -> list[Crossings]:
    return _Scan(problems, ke_max).crossings()


@dataclass
class _Crossing:
    case: int
    x: float
    mu: complex
    direction: float
    error: float


class _Scan:
    """All speeds of blades with equally many modes, up to one K_e."""

    def __init__(self, problems: list[RubbingBlade], ke_max: float) -> None:
        self.problems = problems
        self.top = float(np.log(ke_max))
        self.motion = propagation_of(problems)
        self.shift = self.motion.phase_shift
        low = np.array([least_destabilising_ke(p) for p in problems])
        self.open = np.flatnonzero(low < ke_max)
        self.bottom = np.log(np.maximum(np.where(np.isfinite(low), low, ke_max), 1e-300))
        self._series_of_bands(ke_max)
        self.found: list[_Crossing] = []
        self.undecided: dict[int, float] = {}  # ln K_e of the lowest such sample of a case

    def _series_of_bands(self, ke_max: float) -> None:
        case, centre, start = [], [], [0]
        for i in range(len(self.problems)):
            hold = min(ke_max, _SERIES_HOLD / max(self.shift[i], 1e-300))
            tops = [hold]
            while tops[-1] * self.shift[i] > _WEAK:
                tops.append(tops[-1] / _BAND)
            case += [i] * len(tops)
            centre += tops[::-1]
            start.append(len(case))
        self.band_case, self.band_top, self.band_start = np.array(case), np.array(centre), np.array(start)
        slowest = np.exp((self.motion.damping_ratio * self.motion.angle).min(axis=1))[self.band_case]
        growth = self.band_top * self.shift[self.band_case]
        with np.errstate(divide="ignore"):
            reach = np.clip(14.0 / growth, _REACH, _REACH * slowest)
        self.series = ContactExpansion.of(
            self.motion[self.band_case], self.band_top, np.maximum(reach, _REACH)
        )

    def crossings(self) -> list[Crossings]:
        """Of every case, in order."""
        case, x = self._grid()
        samples = self._sampled(case, x)
        for _ in range(_MOST_ROUNDS):
            checkpoint()
            case, x, solved = self._wanted(samples)
            if len(case) == 0:
                break
            new = self._sampled(case, x)
            new.solved = solved
            samples = samples.merged(new)
        out = [Crossings.none()] * len(self.problems)
        for i in self.open:
            out[i] = self._collected(int(i), samples)
        return out

    def _grid(self) -> tuple[np.ndarray, np.ndarray]:
        """Samples to begin with."""
        case, x = [], []
        for i in self.open:
            ke, at = float(np.exp(self.bottom[i])), []
            top = float(np.exp(self.top))
            while ke < top:
                at.append(ke)
                growth = ke * self.shift[i]
                if growth < _SERIES_HOLD:
                    ke += min(ke * np.expm1(_WIDEST), _GREATEST_GROWTH / max(self.shift[i], 1e-300))
                else:
                    ke *= min(_STRONG_RATIO ** min(growth / _SERIES_HOLD, 50.0), _STRONGEST_RATIO)
            at.append(top)
            case += [i] * len(at)
            x += list(np.log(at))
        return np.array(case, dtype=int), np.array(x)

    def _sampled(self, case: np.ndarray, x: np.ndarray) -> BranchSamples:
        parts = [self._sample(case[i : i + _POINTS], x[i : i + _POINTS]) for i in range(0, len(x), _POINTS)]
        out = parts[0] if parts else self._sample(case, x)
        for part in parts[1:]:
            out = out.merged(part)
        return out

    def _sample(self, case: np.ndarray, x: np.ndarray) -> BranchSamples:
        checkpoint()
        ke = np.exp(x)
        outside = np.full(len(x), -1)
        band = self._band(case, ke)
        followed = band >= 0
        rows = np.flatnonzero(followed)
        width = 1
        growth = slope = angle = turn = np.zeros((len(x), 1))
        if len(rows):
            own = self.series[band[rows]]
            found = leading_multipliers(own, ke[rows])
            followed[rows[~found.resolved]] = False
            outside[rows] = found.outside
            mu = found.multiplier
            with np.errstate(divide="ignore"):
                level = np.log(np.abs(mu))
            near = (np.abs(level) < _FOLLOWED) | ((np.arange(mu.shape[1]) == 0) & (level > 0))
            width = mu.shape[1]
            growth = np.full((len(x), width), -np.inf)
            slope, angle, turn = (np.zeros((len(x), width)) for _ in range(3))
            at, column = np.nonzero(near)
            if len(at):
                _, change, _ = slopes(own[at], ke[rows[at]], mu[at, column])
                good = np.isfinite(change)
                at, column, change = at[good], column[good], change[good]
                growth[rows[at], column] = level[at, column]
                angle[rows[at], column] = np.angle(mu[at, column])
                slope[rows[at], column], turn[rows[at], column] = change.real, change.imag
        strong = np.flatnonzero((outside < 0) & ~followed)
        if len(strong):
            problems = [self.problems[case[k]].with_ke(float(ke[k])) for k in strong]
            stable = batch_multipliers(problems, dominant=False, thorough=False, workers=1).stable
            outside[strong] = np.where(np.isnan(stable), -1, stable == 0.0)
        for k in np.flatnonzero((outside < 0) & followed):  # on the circle to rounding: a neighbour tells
            alone = CharacteristicEquation(self.problems[case[k]].with_ke(float(ke[k]) * (1 + 1e-7)))
            count = alone.count_outside()
            outside[k] = -1 if count is None else count
        for k in np.flatnonzero(outside < 0):
            lowest = self.undecided.get(int(case[k]), np.inf)
            self.undecided[int(case[k])] = min(lowest, float(x[k]))
        none = np.zeros(len(x), dtype=bool)
        out = BranchSamples(case, x, outside, growth, slope, angle, turn, followed, none)
        return out.merged(BranchSamples(*(getattr(out, f)[:0] for f in out.__dataclass_fields__)))

    def _band(self, case: np.ndarray, ke: np.ndarray) -> np.ndarray:
        """Row of the series that serves each point, −1 where contact is too strong."""
        # Complex numbers sort by real part, then imaginary part: by case, then by K_e.
        table = self.band_case + 1j * self.band_top * (1 + 1e-12)
        row = np.searchsorted(table, case + 1j * ke)
        held = row < self.band_start[case + 1]
        row = np.where(held, row, 0)
        return np.where(held & self.series.resolved[row], row, -1)

    def _wanted(self, s: BranchSamples) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Next samples, by case and K_e: middles of intervals, and both sides of new crossings."""
        inner = (s.case[1:] == s.case[:-1]) & ~s.solved[:-1]
        width = np.where(inner, np.diff(s.x), 0.0)
        stable = s.outside == 0
        changes = inner & (stable[1:] != stable[:-1])
        followed = s.followed[1:] & s.followed[:-1]
        split = inner & ~changes & followed & (width > NARROWEST_ISLAND) & s.may_cross(width)
        # Without branches on both sides only closeness tells that a stable interval hides no island.
        split |= inner & ~followed & stable[1:] & stable[:-1] & (width > NARROWEST_UNFOLLOWED)
        case, x, solved = [], [], []
        for i in np.flatnonzero(changes):
            crossing = self._solved(s, int(i))
            if crossing is None and width[i] > _BRACKET:
                split[i] = True
                continue
            if crossing is None:
                middle = 0.5 * (s.x[i] + s.x[i + 1])
                equation = CharacteristicEquation(self.problems[s.case[i]].with_ke(float(np.exp(middle))))
                direction = 1.0 if stable[i] else -1.0
                crossing = _Crossing(
                    int(s.case[i]), middle, equation.crossing_near(), direction, float(width[i])
                )
                s.solved[i] = True
            else:
                gap = max(10 * crossing.error, _BESIDE)
                sides = [crossing.x - gap, crossing.x + gap]
                inside = [side for side in sides if s.x[i] < side < s.x[i + 1]]
                case += [crossing.case] * len(inside)
                x += inside
                if inside and inside[0] == sides[0]:
                    solved += [True, False][: len(inside)]
                else:  # the sample before lies as near as that
                    s.solved[i] = True
                    solved += [False] * len(inside)
            self.found.append(crossing)
        at = np.flatnonzero(split)
        case += list(s.case[at])
        x += list(0.5 * (s.x[at] + s.x[at + 1]))
        solved += [False] * len(at)
        order = np.lexsort((x, case))
        return np.array(case, dtype=int)[order], np.array(x)[order], np.array(solved, dtype=bool)[order]

    def _solved(self, s: BranchSamples, i: int) -> _Crossing | None:
        """The crossing between samples i and i + 1, by Newton's method from the unstable side."""
        from_above = s.outside[i] == 0
        side = i + 1 if from_above else i
        out = np.flatnonzero(s.growth[side] > 0)
        if s.outside[side] not in (1, 2) or len(out) != 1:
            return None
        j = out[0]
        growth, slope = s.growth[side, j], s.slope[side, j]
        if slope == 0:
            return None
        move = -growth / slope
        x, angle = s.x[side] + move, s.angle[side, j] + s.turn[side, j] * move
        real = s.angle[side, j] in (0.0, np.pi)
        angle = s.angle[side, j] if real else angle
        change = np.inf
        noise = np.array([0.0])
        for _ in range(12):
            if not s.x[i] - 1e-9 <= x <= s.x[i + 1] + 1e-9:
                return None
            row = self._band(s.case[i : i + 1], np.exp(np.array([x])))
            if row[0] < 0:
                return None
            mu = np.exp(1j * np.array([angle]))
            residual, by_x, noise = slopes(self.series[row], np.exp(np.array([x])), mu)
            # ln μ at this K_e is i·angle + residual; on the circle its real part is zero.
            if not np.isfinite(residual[0]) or by_x[0].real == 0:
                return None
            move = float(-residual[0].real / by_x[0].real)
            x += move
            angle = angle if real else float(angle + residual[0].imag + by_x[0].imag * move)
            before, change = change, abs(move)
            if change < 1e-14 or (change >= before and change < 1e-9):
                break
        error = min(change, before) + float(noise[0] / abs(by_x[0].real))
        if not (error < 1e-6 and s.x[i] - 1e-9 <= x <= s.x[i + 1] + 1e-9):
            return None
        return _Crossing(
            int(s.case[i]), x, complex(np.exp(1j * angle)), 1.0 if from_above else -1.0, error + 1e-14
        )

    def _collected(self, case: int, samples: BranchSamples) -> Crossings:
        x, unstable = samples.x[samples.case == case], samples.outside[samples.case == case] != 0
        own = []
        for crossing in sorted((c for c in self.found if c.case == case), key=lambda c: c.x):
            # A second multiplier that leaves where one is out already changes no verdict.
            after = int(np.searchsorted(x, crossing.x))
            if 0 < after < len(x) and unstable[after - 1] != unstable[after]:
                own.append(crossing)
        ke = np.exp([c.x for c in own])
        hertz = [
            CharacteristicEquation(self.problems[case].with_ke(float(k))).chatter_hz(c.mu)
            for k, c in zip(ke, own, strict=True)
        ]
        direction = np.array([c.direction for c in own])
        lowest = self.undecided.get(case)
        sure = lowest is None or (len(own) > 0 and lowest > own[0].x)
        alternating = bool((direction == np.where(np.arange(len(own)) % 2 == 0, 1.0, -1.0)).all())
        return Crossings(
            ke,
            np.array(hertz),
            direction,
            np.array([c.error for c in own]),
            proven=alternating and sure,
        )

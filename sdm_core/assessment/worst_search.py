"""Search of an uncertain family of blades for the least and the largest critical K_e.

K_e is monotone in the damping of one mode alone (its floor is 2ξ(1 + ξ)ω²/G), but with several
modes not provably: damping a mode above the chatter frequency takes away some of its stiffening share.
At a fixed speed K_e rises and falls with frequency as lobes pass. So corners are not trusted: they are
tried, and many blades inside, and from the best of them K_e is descended with its exact derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import minimize
from scipy.stats import qmc

from sdm_core.assessment.uncertain_blade import (
    Factors,
    FirstCrossing,
    Uncertainty,
    Variable,
    first_crossings,
    problems_at,
    slopes,
)
from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.lobe_tips import SEARCH_MARGIN, deepest_lobe_tips, lobe_grid
from sdm_core.validation import KE_LIMIT

RANGE_SAMPLES, SPEED_SAMPLES = 8, 512
RANGE_STARTS, SPEED_STARTS = 2, 5
# Factors are followed along each mode's frequency with so many blades a lobe that passes.
_PER_LOBE = 12
# A search over a range of speeds costs a hundred times one at a speed.
RANGE_STEPS, SPEED_STEPS = 6, 24
_CORNERS = 12
_NEAR_FLOOR = 0.01
_TIP_TOLERANCE = 1e-5
# Lobes refined a blade: a grid ranks them to a percent only, and the deepest may not be its lowest.
_LOBES = 16
_BATCH = 256


@dataclass(frozen=True)
class Sample:
    """One blade of the family, asked of the exact core.

    Attributes
    ----------
    logs
        Logarithms of the factors, shape (v,).
    ke, speed_hz, chatter_hz
        Least K_e, N/m, infinite where there is none; where, Hz.
    proven
        False where the exact core could not prove it.
    """

    logs: np.ndarray
    ke: float
    speed_hz: float
    chatter_hz: float
    proven: bool


@dataclass
class Question:
    """What is asked of every blade of the family; counts how often.

    Attributes
    ----------
    blade, contact, uncertainty, variables
        The family.
    ke_max
        Largest K_e looked at, N/m.
    fixed_hz
        Rotor speeds, or None for a range.
    grid_hz
        Speeds at which lobes of any blade of the family are seen, for a range.
    likely_ke
        Where the least K_e of any blade of the family is likely to lie below, N/m: looked at first, and
        `ke_max` only where nothing is found.
    tried
        Blades asked so far.
    """

    blade: Blade
    contact: ContactConfiguration
    uncertainty: Uncertainty
    variables: tuple[Variable, ...]
    ke_max: float
    fixed_hz: np.ndarray | None
    grid_hz: np.ndarray | None
    likely_ke: float = np.inf
    tried: int = 0

    @classmethod
    def over_range(
        cls,
        blade: Blade,
        contact: ContactConfiguration,
        speed_range_hz: tuple[float, float],
        ke_max: float,
        uncertainty: Uncertainty,
    ) -> Question:
        """The least K_e over a range of speeds."""
        # Lobes of a blade of the family reach as deep as those of the nominal one at this K_e.
        deeper = uncertainty.amplitude[1] ** 2 / (uncertainty.damping[0] * uncertainty.frequency[0] ** 2)
        grid = lobe_grid(blade, contact, np.array(speed_range_hz), ke_max * deeper)
        variables = uncertainty.variables(blade.mode_count)
        return cls(blade, contact, uncertainty, variables, ke_max, None, grid)

    @classmethod
    def at_speeds(
        cls,
        blade: Blade,
        contact: ContactConfiguration,
        fixed_hz: np.ndarray,
        ke_max: float,
        uncertainty: Uncertainty,
    ) -> Question:
        """The least K_e over fixed rotor speeds."""
        variables = uncertainty.variables(blade.mode_count)
        return cls(blade, contact, uncertainty, variables, ke_max, fixed_hz, None)

    @property
    def searched(self) -> str:
        """How the family was searched, in words."""
        where = "over the range of speeds" if self.fixed_hz is None else "at the given speeds"
        return (
            f"{self.tried} blades {where}: nominal, common corners, corners by the sign of the derivatives, "
            "samples inside, descent with exact derivatives; by search, not by proof"
        )

    def asked(self, logs: np.ndarray) -> list[Sample]:
        """The least K_e of blades, from the logarithms of their factors, shape (m, v)."""
        self.tried += len(logs)
        if self.fixed_hz is None:
            return [self._over_range(row) for row in logs]
        out: list[Sample] = []
        size = max(1, _BATCH // len(self.fixed_hz))
        for start in range(0, len(logs), size):
            out += self._at_speeds(logs[start : start + size])
        return out

    def slopes(self, sample: Sample) -> np.ndarray | None:
        """d ln K_e/d ln factor of the least K_e, shape (v,): at a lobe's tip, or an end of the range, that of
        the crossing at constant speed, for the tip moves along the boundary's own tangent."""
        if not np.isfinite(sample.ke) or not sample.proven or self.contact.smooth:
            return None
        factors = Factors.of(self.variables, sample.logs, self.blade.mode_count)
        problem = problems_at(self.blade, self.contact, np.array([sample.speed_hz]), factors)[0]
        return slopes(problem, sample.ke, sample.chatter_hz, self.variables)

    def expect(self, nominal: Sample) -> None:
        """Take the nominal blade's K_e for a guide to where the others' lie."""
        family = self.uncertainty
        rise = family.damping[1] * family.frequency[1] ** 2 / family.amplitude[0] ** 2
        self.likely_ke = SEARCH_MARGIN * rise * nominal.ke

    def _over_range(self, logs: np.ndarray) -> Sample:
        if self.likely_ke < self.ke_max:
            found = self._least_below(logs, self.likely_ke)
            if np.isfinite(found.ke):
                return found
        return self._least_below(logs, self.ke_max)

    def _least_below(self, logs: np.ndarray, ke_max: float) -> Sample:
        grid = self.grid_hz
        assert grid is not None
        factors = Factors.of(self.variables, logs, self.blade.mode_count)
        reach = min(SEARCH_MARGIN * ke_max, KE_LIMIT)

        def exact(speed_hz: np.ndarray) -> FirstCrossing:
            # Not an ulp beyond the modal data.
            inside = np.clip(speed_hz, grid[0], grid[-1])
            return first_crossings(problems_at(self.blade, self.contact, inside, factors), reach)

        seen = exact(grid)
        tips = deepest_lobe_tips(
            seen,
            exact,
            self.blade.first_frequency_hz,
            ke_max=ke_max,
            count=_LOBES,
            tolerance=_TIP_TOLERANCE,
        )
        sure = bool(np.isfinite(seen.error_estimate).all())
        if not tips:
            return Sample(logs, np.inf, np.nan, np.nan, sure)
        return Sample(logs, tips[0].ke, tips[0].speed_hz, tips[0].chatter_hz, sure and tips[0].proven)

    def _at_speeds(self, logs: np.ndarray) -> list[Sample]:
        assert self.fixed_hz is not None
        modes, count = self.blade.mode_count, len(self.fixed_hz)
        problems = [
            problem
            for row in logs
            for problem in problems_at(
                self.blade, self.contact, self.fixed_hz, Factors.of(self.variables, row, modes)
            )
        ]
        found = first_crossings(problems, self.ke_max)
        ke = np.nan_to_num(found.critical_ke, nan=np.inf).reshape(-1, count)
        at = ke.argmin(axis=1)
        sure = np.isfinite(found.error_estimate).reshape(-1, count).all(axis=1)
        chatter = found.chatter_hz.reshape(-1, count)
        return [
            Sample(row, float(ke[i, k]), float(self.fixed_hz[k]), float(chatter[i, k]), bool(sure[i]))
            for i, (row, k) in enumerate(zip(logs, at, strict=True))
        ]


def extremes(
    question: Question, thoroughness: int, floor_ke: float | None = None
) -> tuple[Sample, Sample, Sample]:
    """The nominal blade, and those with the least and the largest K_e found.

    Descent is left out where the least is within `_NEAR_FLOOR` of `floor_ke`, below which none can
    lie. Where some blade has no K_e below the largest looked at, the first such is the best.
    """
    nominal = question.asked(np.zeros((1, len(question.variables))))[0]
    question.expect(nominal)
    samples = [nominal, *question.asked(_starts(question, thoroughness)), *_by_slope(question, nominal, -1)]
    if floor_ke is None or min(sample.ke for sample in samples) > (1 + _NEAR_FLOOR) * floor_ke:
        samples += _descended(question, samples, -1, thoroughness)
    worst = min(samples, key=lambda sample: sample.ke)
    if np.isfinite([sample.ke for sample in samples]).all():
        samples += _by_slope(question, nominal, +1)
        samples += _descended(question, samples, +1, thoroughness)
    return nominal, worst, max(samples, key=lambda sample: sample.ke)


def _starts(question: Question, thoroughness: int) -> np.ndarray:
    """Common corners, samples inside, and sweeps along the frequencies, shape (m, v)."""
    variables = question.variables
    low, high = np.array([v.low for v in variables]), np.array([v.high for v in variables])
    if not variables:
        return np.zeros((0, 0))
    quantities = sorted({v.quantity for v in variables})
    rows = []
    for ends in product((0, 1), repeat=len(quantities)):
        end = dict(zip(quantities, ends, strict=True))
        rows.append([(v.low, v.high)[end[v.quantity]] for v in variables])
    fixed = question.fixed_hz is not None
    count = thoroughness * (SPEED_SAMPLES if fixed else RANGE_SAMPLES)
    # A fixed seed: the same question gives the same answer.
    sobol = qmc.Sobol(len(variables), rng=np.random.default_rng(0))
    inside = low + (high - low) * sobol.random(1 << int(np.ceil(np.log2(count))))[:count]
    parts = [np.array(rows), inside]
    if fixed:
        parts.append(_sweeps(question, low))
    return np.vstack(parts)


def _sweeps(question: Question, low: np.ndarray) -> np.ndarray:
    """Each frequency through its range with damping at its lowest and the other factors nominal."""
    assert question.fixed_hz is not None
    least = np.array(
        [end if v.quantity == "damping" else 0.0 for v, end in zip(question.variables, low, strict=True)]
    )
    highest_hz = max(state.frequency_hz.max() for state in question.blade.states)
    rows = []
    for i, variable in enumerate(question.variables):
        if variable.quantity != "frequency":
            continue
        lobes = highest_hz / question.fixed_hz.min() * (variable.high - variable.low)
        for log in np.linspace(variable.low, variable.high, int(np.clip(_PER_LOBE * lobes, 9, 240))):
            row = least.copy()
            row[i] = log
            rows.append(row)
    return np.array(rows).reshape(-1, len(least))


def _by_slope(question: Question, start: Sample, direction: int) -> list[Sample]:
    """Corner after corner to which the derivatives point, until none is better."""
    found, at = [], start
    for _ in range(_CORNERS):
        slope = question.slopes(at)
        if slope is None or not len(slope):
            break
        rising = direction * slope > 0
        logs = np.array([v.high if up else v.low for v, up in zip(question.variables, rising, strict=True)])
        after = question.asked(logs[None])[0]
        found.append(after)
        if not direction * after.ke > direction * at.ke:
            break
        at = after
    return found


def _descended(
    question: Question, samples: Sequence[Sample], direction: int, thoroughness: int
) -> list[Sample]:
    """Local descent (direction −1) or ascent (+1) of ln K_e inside the box from the best samples."""
    variables = question.variables
    finite = [sample for sample in samples if np.isfinite(sample.ke)]
    if not variables or not finite:
        return []
    over_range = question.fixed_hz is None
    starts, steps = (RANGE_STARTS, RANGE_STEPS) if over_range else (SPEED_STARTS, SPEED_STEPS)
    found: list[Sample] = []
    bounds = [(v.low, v.high) for v in variables]
    for start in sorted(finite, key=lambda s: -direction * s.ke)[: starts * thoroughness]:
        if question.slopes(start) is None:
            continue
        minimize(
            _objective(question, direction, found),
            start.logs,
            jac=True,
            bounds=bounds,
            method="L-BFGS-B",
            options={"maxiter": steps * thoroughness, "maxfun": steps * thoroughness, "ftol": 1e-9},
        )
    return found


def _objective(
    question: Question, direction: int, found: list[Sample]
) -> Callable[[np.ndarray], tuple[float, np.ndarray]]:
    """−direction · ln K_e with its derivatives; every blade asked is kept in `found`."""
    nothing = float(np.log(question.ke_max)) + 1.0

    def objective(logs: np.ndarray) -> tuple[float, np.ndarray]:
        sample = question.asked(np.array(logs, dtype=float)[None])[0]
        found.append(sample)
        slope = question.slopes(sample)
        value = float(np.log(sample.ke)) if np.isfinite(sample.ke) else nothing
        if slope is None:
            slope = np.zeros(len(logs))
        return -direction * value, -direction * slope

    return objective

"""Robust verdict: the worst and the best blade of an uncertain family, named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sdm_core.assessment.guaranteed_floor import guaranteed_ke
from sdm_core.assessment.uncertain_blade import Factors, Uncertainty, Variable
from sdm_core.assessment.worst_search import Question, Sample, extremes
from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import check_range
from sdm_core.rubbing_blade import check_blade_and_contact
from sdm_core.validation import KE_LIMIT, number, speeds

STABLE_FOR_ALL = "stable for all"
UNSTABLE_FOR_SOME = "unstable for some"
UNSTABLE_FOR_ALL = "unstable for all"
UNDECIDED = "not decided"
# A factor is named when setting it back to nominal changes K_e by more than this.
_DECISIVE = 1e-3


@dataclass(frozen=True)
class Cause:
    """One factor of a case that matters.

    Attributes
    ----------
    described
        E.g. ``damping of mode 1 × 0.5``.
    quantity, modes, factor
        What is multiplied, numbers of the modes counted from 1, and by how much.
    effect
        By how much K_e changes, relative, when this factor alone is there compared with set back to nominal,
        the others staying: −0.5 where it halves K_e.
    """

    described: str
    quantity: str
    modes: tuple[int, ...]
    factor: float
    effect: float


@dataclass(frozen=True)
class RobustCase:
    """One blade of the family.

    Attributes
    ----------
    ke
        Least K_e that destabilises it, N/m; None where there is none below the largest looked at.
    speed_hz, chatter_hz
        Where, Hz; None likewise.
    damping, frequency, amplitude
        Factors on every mode, shape (n,).
    causes
        Factors that matter, the strongest first; empty for the nominal blade.
    proven
        False where the exact core could not prove the crossing.
    """

    ke: float | None
    speed_hz: float | None
    chatter_hz: float | None
    damping: tuple[float, ...]
    frequency: tuple[float, ...]
    amplitude: tuple[float, ...]
    causes: tuple[Cause, ...]
    proven: bool

    @property
    def described(self) -> str:
        """The case in words."""
        if self.ke is None:
            return "none below the largest K_e looked at"
        if not self.causes:
            return "nominal"
        return ", ".join(cause.described for cause in self.causes)


@dataclass(frozen=True)
class RobustVerdict:
    """What is left of a blade's stability when its data are off.

    Attributes
    ----------
    uncertainty
        Ranges of the factors.
    speed_range_hz, speed_hz
        The range over which the least K_e was taken, or the fixed rotor speeds; the other is None.
    ke_max, ke_liner
        Largest K_e looked at, and the liner's (None: not given), N/m.
    nominal, worst, best
        Blades with the K_e of the file, the least and the largest found.
    guaranteed_ke
        Proven bound: below it every blade of the family is stable at every speed asked for. None where
        contact varies round the casing. Worst case and bound together bracket the truth.
    verdict
        `STABLE_FOR_ALL`, `UNSTABLE_FOR_SOME`, `UNSTABLE_FOR_ALL` or `UNDECIDED`; None without a liner.
    verdict_proven
        True where the verdict does not rest on the search: stable for all by the bound, or some blade
        found unstable. That the best blade found is the best is never proven.
    blades_tried
        Blades of the family for which the exact core was asked.
    searched
        How, in words.
    """

    uncertainty: Uncertainty
    speed_range_hz: tuple[float, float] | None
    speed_hz: tuple[float, ...] | None
    ke_max: float
    ke_liner: float | None
    nominal: RobustCase
    worst: RobustCase
    best: RobustCase
    guaranteed_ke: float | None
    verdict: str | None
    verdict_proven: bool
    blades_tried: int
    searched: str

    @property
    def described(self) -> str:
        """The verdict in words, the worst case named."""
        if self.worst.ke is None:
            case = f"no K_e below {self.ke_max:,.0f} N/m destabilises any blade that was tried"
        else:
            case = (
                f"worst case {self.worst.ke:,.0f} N/m at {self.worst.speed_hz:.2f} Hz: {self.worst.described}"
            )
        parts = [] if self.verdict is None else [self.verdict]
        parts.append(case)
        if self.guaranteed_ke is not None:
            parts.append(f"proven: no blade of the family is unstable below {self.guaranteed_ke:,.0f} N/m")
        return "; ".join(parts)


def robust_over_range(
    blade: Blade,
    contact: ContactConfiguration,
    speed_range_hz: tuple[float, float],
    ke_max: float,
    *,
    uncertainty: Uncertainty | None = None,
    ke_liner: float | None = None,
    thoroughness: int = 1,
) -> RobustVerdict:
    """The least K_e over a range of speeds, for the worst and the best blade of the family.

    A shift of frequencies mostly moves lobes along the speeds, so over a range it matters little, while
    damping sets the floor of the lobes.

    Parameters
    ----------
    speed_range_hz
        Hz.
    ke_max
        Largest K_e of interest, N/m.
    uncertainty
        None: damping × 0.5 to 2, frequencies ± 3 %, mode by mode.
    ke_liner
        N/m.
    thoroughness
        Multiplies the blades tried.

    Raises
    ------
    InvalidInput
        For an unusable range, stiffness or setting.
    """
    check_blade_and_contact(blade, contact)
    check_range(*speed_range_hz)
    question = Question.over_range(
        blade, contact, speed_range_hz, _checked(ke_max, ke_liner, thoroughness), uncertainty or Uncertainty()
    )
    return _verdict(question, speed_range_hz, None, ke_liner, thoroughness)


def robust_at_speeds(
    blade: Blade,
    contact: ContactConfiguration,
    speed_hz: Sequence[float],
    ke_max: float,
    *,
    uncertainty: Uncertainty | None = None,
    ke_liner: float | None = None,
    thoroughness: int = 1,
) -> RobustVerdict:
    """The least K_e over fixed rotor speeds, for the worst and the best blade of the family.

    Here a shift of frequencies may put a lobe's tip on an operating point, inside the ranges of the
    factors rather than at their ends.

    Parameters
    ----------
    speed_hz
        Hz; the rest as in `robust_over_range`.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> found = robust_at_speeds(
    ...     example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), [200.0], 3e4, ke_liner=9000.0
    ... )
    >>> found.nominal.ke > 19000 > 5000 > found.worst.ke
    True
    """
    check_blade_and_contact(blade, contact)
    fixed = speeds("speed_hz", speed_hz)
    question = Question.at_speeds(
        blade, contact, fixed, _checked(ke_max, ke_liner, thoroughness), uncertainty or Uncertainty()
    )
    return _verdict(question, None, tuple(fixed.tolist()), ke_liner, thoroughness)


def _checked(ke_max: float, ke_liner: float | None, thoroughness: int) -> float:
    if isinstance(thoroughness, bool) or not isinstance(thoroughness, int) or not 1 <= thoroughness <= 100:
        raise InvalidInput("thoroughness", thoroughness, "give a whole number from 1 to 100")
    if ke_liner is not None:
        number("ke_liner", ke_liner, 0.0, KE_LIMIT, "N/m", open_low=True)
        if ke_max < ke_liner:
            raise InvalidInput("ke_max", ke_max, f"give at least the liner's K_e, {ke_liner:g} N/m")
    return number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)


def _verdict(
    question: Question,
    speed_range_hz: tuple[float, float] | None,
    fixed: tuple[float, ...] | None,
    ke_liner: float | None,
    thoroughness: int,
) -> RobustVerdict:
    at = (min(fixed), max(fixed)) if fixed is not None else speed_range_hz
    assert at is not None
    floor = guaranteed_ke(question.blade, question.contact, at, question.uncertainty)
    nominal, worst, best = extremes(question, thoroughness, floor)
    cases = [_case(question, sample) for sample in (nominal, worst, best)]
    verdict, sure = _against(ke_liner, worst, best, floor)
    return RobustVerdict(
        question.uncertainty,
        speed_range_hz,
        fixed,
        question.ke_max,
        ke_liner,
        cases[0],
        cases[1],
        cases[2],
        floor,
        verdict,
        sure,
        question.tried,
        question.searched,
    )


def _against(
    ke_liner: float | None, worst: Sample, best: Sample, floor: float | None
) -> tuple[str | None, bool]:
    """The verdict, and whether it does not rest on the search having found the extremes."""
    if ke_liner is None:
        return None, False
    if floor is not None and ke_liner < floor:
        return STABLE_FOR_ALL, True
    if not (worst.proven and best.proven):
        return UNDECIDED, False
    if worst.ke > ke_liner:
        return STABLE_FOR_ALL, False
    return (UNSTABLE_FOR_ALL, False) if best.ke <= ke_liner else (UNSTABLE_FOR_SOME, True)


def _case(question: Question, sample: Sample) -> RobustCase:
    factors = Factors.of(question.variables, sample.logs, question.blade.mode_count)
    known = np.isfinite(sample.ke)
    return RobustCase(
        sample.ke if known else None,
        sample.speed_hz if known else None,
        sample.chatter_hz if known else None,
        tuple(factors.damping.tolist()),
        tuple(factors.frequency.tolist()),
        tuple(factors.amplitude.tolist()),
        _causes(question, sample) if known else (),
        sample.proven,
    )


def _causes(question: Question, sample: Sample) -> tuple[Cause, ...]:
    """What each factor does to K_e, compared with that factor set back to nominal."""
    moved = [i for i, log in enumerate(sample.logs) if abs(log) > 1e-9]
    if not moved:
        return ()
    back = np.repeat(sample.logs[None, :], len(moved), axis=0)
    back[np.arange(len(moved)), moved] = 0.0
    causes = []
    for i, without in zip(moved, question.asked(back), strict=True):
        effect = sample.ke / without.ke - 1.0
        variable, factor = question.variables[i], float(np.exp(sample.logs[i]))
        if abs(effect) > _DECISIVE:
            causes.append(_cause(variable, factor, effect))
    return tuple(sorted(causes, key=lambda cause: -abs(np.log1p(max(cause.effect, -0.999)))))


def _cause(variable: Variable, factor: float, effect: float) -> Cause:
    numbers = tuple(j + 1 for j in variable.modes)
    return Cause(variable.described(factor), variable.quantity, numbers, factor, float(effect))

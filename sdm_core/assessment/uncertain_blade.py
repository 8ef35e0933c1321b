"""A blade whose damping, frequencies and amplitudes are known to a factor only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.crossings import Crossings
from sdm_core.errors import InvalidInput
from sdm_core.floquet.arc_boundary import boundaries_with_arcs
from sdm_core.permanent_contact.permanent_boundary import permanent_crossings
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.sensitivity import critical_ke_sensitivity
from sdm_core.validation import LARGEST_DAMPING, number

QUANTITIES = ("damping", "frequency", "amplitude")


@dataclass(frozen=True)
class Uncertainty:
    """Ranges of the factors by which a blade's modal data may be off.

    Attributes
    ----------
    damping, frequency, amplitude
        (low, high) factors on ξ_j, ω_j at every speed, and the mode shape of a mode; (1, 1) is exactly known.
        Damping is the least known: half to twice is the default.
    per_mode
        True where every mode has factors of its own, False where all modes share one each.

    Raises
    ------
    InvalidInput
        For a range that does not rise, or does not hold 1.

    Examples
    --------
    >>> Uncertainty(amplitude=(0.9, 1.1)).frequency
    (0.97, 1.03)
    """

    damping: tuple[float, float] = (0.5, 2.0)
    frequency: tuple[float, float] = (0.97, 1.03)
    amplitude: tuple[float, float] = (1.0, 1.0)
    per_mode: bool = True

    def __post_init__(self) -> None:
        for name in QUANTITIES:
            given = getattr(self, name)
            field = f"uncertainty.{name}"
            if not isinstance(given, list | tuple) or len(given) != 2:
                raise InvalidInput(field, given, "give a lowest and a highest factor")
            low = number(f"{field}[0]", given[0], 0.1, 1.0, "times the nominal value")
            high = number(f"{field}[1]", given[1], 1.0, 10.0, "times the nominal value")
            object.__setattr__(self, name, (low, high))

    def variables(self, modes: int) -> tuple[Variable, ...]:
        """Factors that are not exactly known, for a blade of so many modes."""
        groups = [(j,) for j in range(modes)] if self.per_mode else [tuple(range(modes))]
        return tuple(
            Variable(name, group, *np.log(getattr(self, name)).tolist())
            for name in QUANTITIES
            for group in groups
            if getattr(self, name)[0] < getattr(self, name)[1]
        )


@dataclass(frozen=True)
class Variable:
    """One uncertain factor.

    Attributes
    ----------
    quantity
        One of `QUANTITIES`.
    modes
        Indices of the modes it acts on.
    low, high
        Logarithm of the factor.
    """

    quantity: str
    modes: tuple[int, ...]
    low: float
    high: float

    def described(self, factor: float) -> str:
        """In words, e.g. ``damping of mode 2 × 0.5``, ``frequency of all modes −3.0 %``."""
        one = len(self.modes) == 1
        where = f"mode {self.modes[0] + 1}" if one else "all modes"
        if self.quantity == "damping":
            return f"damping of {where} × {factor:.3g}"
        change = 100 * (factor - 1)
        sign = "−" if change < 0 else "+"
        return f"{self.quantity} of {where} {sign}{abs(change):.1f} %"


@dataclass(frozen=True)
class Factors:
    """One blade of the uncertain ones: a factor for each mode.

    Attributes
    ----------
    damping, frequency, amplitude
        Shape (n,) each.
    """

    damping: np.ndarray
    frequency: np.ndarray
    amplitude: np.ndarray

    @classmethod
    def of(cls, variables: Sequence[Variable], logs: np.ndarray, modes: int) -> Factors:
        """From the logarithms of the factors that are uncertain, shape (v,)."""
        table = {name: np.ones(modes) for name in QUANTITIES}
        for variable, log in zip(variables, logs, strict=True):
            table[variable.quantity][list(variable.modes)] = np.exp(log)
        return cls(**table)

    def applied(self, problem: RubbingBlade) -> RubbingBlade:
        """The problem with its modal data multiplied."""
        return replace(
            problem,
            omega=problem.omega * self.frequency,
            damping_ratio=np.minimum(problem.damping_ratio * self.damping, LARGEST_DAMPING),
            contact_shape=problem.contact_shape * self.amplitude,
        )


@dataclass(frozen=True)
class FirstCrossing:
    """First crossings of many problems, as `boundary` has them of one blade; each of shape (m,)."""

    speed_hz: np.ndarray
    critical_ke: np.ndarray
    chatter_hz: np.ndarray
    error_estimate: np.ndarray


def first_crossings(problems: Sequence[RubbingBlade], ke_max: float) -> FirstCrossing:
    """First crossings up to `ke_max` by the exact core.

    NaN where there is none; the error is infinite where the proof did not succeed.
    """
    permanent = problems[0].permanent
    found = permanent_crossings(problems, ke_max) if permanent else boundaries_with_arcs(problems, ke_max)
    return FirstCrossing(
        np.array([p.speed_hz for p in problems]),
        np.array([c.ke[0] if len(c.ke) else np.nan for c in found]),
        np.array([c.frequency_hz[0] if len(c.ke) else np.nan for c in found]),
        np.array([_error(c) for c in found]),
    )


def _error(found: Crossings) -> float:
    if not found.proven:
        return np.inf
    return float(found.error_estimate[0]) if len(found.ke) else 0.0


def slopes(
    problem: RubbingBlade, ke: float, chatter_hz: float, variables: Sequence[Variable]
) -> np.ndarray | None:
    """d ln K_e/d ln factor of a crossing, shape (v,); None where it has no derivative.

    Parameters
    ----------
    problem
        With the factors applied.
    """
    multiplier = complex(np.exp(2j * np.pi * chatter_hz / problem.speed_hz))
    found = critical_ke_sensitivity(problem.with_ke(ke), multiplier)
    if not found.simple:
        return None
    gradient = found.critical_ke
    by_mode = {
        "damping": gradient.damping_ratio * problem.damping_ratio / ke,
        "frequency": gradient.omega * problem.omega / ke,
        "amplitude": 2 * (gradient.contact_matrix * problem.contact_matrix).sum(axis=1) / ke,
    }
    return np.array([by_mode[v.quantity][list(v.modes)].sum() for v in variables])


def problems_at(
    blade: Blade, contact: ContactConfiguration, speed_hz: np.ndarray, factors: Factors
) -> list[RubbingBlade]:
    """The rubbing blade with its factors at each of many speeds."""
    return [factors.applied(p) for p in RubbingBlade.at_speeds(blade, contact, speed_hz)]

"""The damping with which a blade just stays stable over a range of speeds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.interruption import checkpoint
from sdm_core.lobe_tips import CriticalSpeed, check_range, least_critical_ke
from sdm_core.rubbing_blade import check_blade_and_contact
from sdm_core.validation import KE_LIMIT, number

LARGEST_FACTOR = 1e3
LARGEST_DAMPING = 0.5  # beyond, a modal damping ratio means little and no lobe is left
# Lobes are looked for up to this many times the K_e that has to be met, where the secant starts from.
_LOOKED_UP_TO = 3.0


@dataclass(frozen=True)
class NeededDamping:
    """Damping ratios at which the least critical K_e over a range of speeds is a given one.

    Attributes
    ----------
    ke
        K_e that has to be met, N/m.
    factor
        On every damping ratio of the blade; below 1 where it could lose damping and still meet it.
    damping_ratio
        The blade's, times the factor, shape (n,).
    worst
        Tip of the deepest lobe then; None where no lobe comes as low even with the least damping tried.
    worst_now
        The same with the blade's own damping; None where that lobe is above every K_e looked at.
    steps
        Searches over the range of speeds.
    """

    ke: float
    factor: float
    damping_ratio: np.ndarray
    worst: CriticalSpeed | None
    worst_now: CriticalSpeed | None
    steps: int


def needed_damping(
    blade: Blade,
    contact: ContactConfiguration,
    speed_range_hz: tuple[float, float],
    ke: float,
    *,
    tolerance: float = 1e-3,
) -> NeededDamping:
    """Factor on every damping ratio with which the least critical K_e over a range of speeds is `ke`.

    Of one mode the least K_e is 2ξ(1 + ξ)ω²/G (DESIGN, section 6), so it is nearly in proportion to damping:
    a secant in logarithms, kept inside a bracket, takes a few searches by the exact core.

    Parameters
    ----------
    speed_range_hz
        Hz.
    ke
        To be met over the whole range, N/m: the liner's, with the margin wanted.
    tolerance
        On K_e, relative. The blade with the damping found is never below `ke`.

    Raises
    ------
    InvalidInput
        For an unusable range or stiffness, a blade without damping, or where no damping ratio below 0.5 is
        enough.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> found = needed_damping(
    ...     example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), (150.0, 300.0), 12000.0
    ... )
    >>> round(found.factor, 2), 12000.0 <= found.worst.ke <= 12012.0
    (1.34, True)
    """
    check_blade_and_contact(blade, contact)
    check_range(*speed_range_hz)
    number("ke", ke, 0.0, KE_LIMIT / _LOOKED_UP_TO, "N/m", open_low=True)
    number("tolerance", tolerance, 1e-6, 0.1, "of K_e")
    if not blade.damping_ratio.min() > 0.0:
        remedy = "give every mode some damping: it is multiplied, mode by mode"
        raise InvalidInput("blade.damping_ratio", float(blade.damping_ratio.min()), remedy)
    largest = float(blade.damping_ratio.max())
    least, most = 1.0 / LARGEST_FACTOR, min(LARGEST_FACTOR, LARGEST_DAMPING / largest)
    search = _Search(blade, contact, speed_range_hz, ke, 0.1 * tolerance)
    now = tip = search.tip(1.0)
    factor, short, enough = 1.0, _Tried(least, None, tried=False), _Tried(most, None, tried=False)
    # Aims above, so that what is found meets K_e and does not just miss it.
    aim = ke * (1.0 + 0.5 * tolerance)
    while True:
        checkpoint()
        value = None if tip is None else tip.ke
        met = value is None or value >= ke
        settled = value is not None and met and value <= ke * (1.0 + tolerance)
        if settled or (met and (factor == least or factor < short.factor * (1.0 + 1e-9))):
            return NeededDamping(ke, factor, blade.damping_ratio * factor, tip, now, search.steps)
        if not met and factor == most:
            found = f"{value:g} N/m with damping ratios up to {largest * most:g}"
            raise InvalidInput("ke", ke, f"give less: damping reaches {found}")
        if met:
            enough = _Tried(factor, value)
        else:
            short = _Tried(factor, value)
        factor = _next_factor(short, enough, aim)
        tip = search.tip(factor)


@dataclass(frozen=True)
class _Tried:
    """A factor on damping, and the least K_e with it; None where no lobe came as low, or it was not tried."""

    factor: float
    ke: float | None
    tried: bool = True


@dataclass
class _Search:
    blade: Blade
    contact: ContactConfiguration
    speed_range_hz: tuple[float, float]
    ke: float
    tolerance: float
    steps: int = 0

    def tip(self, factor: float) -> CriticalSpeed | None:
        """Tip of the deepest lobe with damping times `factor`."""
        self.steps += 1
        damped = replace(self.blade, damping_ratio=self.blade.damping_ratio * factor)
        reach, how = _LOOKED_UP_TO * self.ke, {"count": 1, "tolerance": self.tolerance}
        found = least_critical_ke(damped, self.contact, *self.speed_range_hz, reach, **how)  # type: ignore[arg-type]
        return found[0] if found else None


def _next_factor(short: _Tried, enough: _Tried, aim: float) -> float:
    """Where K_e would be `aim` if it went with a power of damping: with the first, where one end is known."""
    low, high = short.factor, enough.factor
    if short.ke is not None and enough.ke is not None:
        share = np.log(aim / short.ke) / np.log(enough.ke / short.ke)
        # Away from the ends: the bracket shrinks even where a kink between two lobes bends the curve.
        return float(low * (high / low) ** np.clip(share, 0.02, 0.98))
    if short.ke is not None:
        guess = low * aim / short.ke
        return guess if guess < high else _between(low, high, end=None if enough.tried else high)
    if enough.ke is not None:
        guess = high * aim / enough.ke
        return guess if guess > low else _between(low, high, end=None if short.tried else low)
    guess = high / _LOOKED_UP_TO
    return guess if guess > low else _between(low, high, end=None if short.tried else low)


def _between(low: float, high: float, end: float | None) -> float:
    """An end of the bracket that is still to be tried, else the middle."""
    return float(np.sqrt(low * high)) if end is None else end

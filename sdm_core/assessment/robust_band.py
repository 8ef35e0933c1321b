"""Band of first crossings over rotor speed, between the least and the most stable blades of a family."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.assessment.uncertain_blade import Factors, Uncertainty, first_crossings, problems_at
from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.rubbing_blade import check_blade_and_contact
from sdm_core.validation import KE_LIMIT, number, speeds

FEWEST_STEPS, MOST_STEPS = 13, 61
_PER_LOBE = 8


@dataclass(frozen=True)
class RobustBand:
    """First crossings of the family at each speed, N/m, each of shape (m,); NaN where there is none.

    Attributes
    ----------
    speed_hz, ke_max
        Hz; largest K_e looked at, N/m.
    nominal
        Of the blade as given.
    lowest, highest
        The extremes over the family; `highest` is NaN where some blade has no crossing below `ke_max`, as
        shifted lobes mostly leave one.
    lowest_damped
        Lowest over frequencies with damping at its largest and amplitudes at their least: up to here
        the floor of the lobes rises.
    steps
        Common factors of frequency tried.
    """

    speed_hz: np.ndarray
    ke_max: float
    nominal: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray
    lowest_damped: np.ndarray
    steps: int


def robust_band(
    blade: Blade,
    contact: ContactConfiguration,
    speed_hz: np.ndarray,
    ke_max: float,
    uncertainty: Uncertainty | None = None,
) -> RobustBand:
    """The band over factors that all modes share: for pictures, while verdicts look at each mode's own.

    Lowest with damping at its least and amplitudes at their largest, highest with both the other way, each
    over frequencies through their range, in steps of an eighth of a lobe of the highest mode or, where
    these are too many, `MOST_STEPS`.

    Parameters
    ----------
    speed_hz
        Hz, shape (m,).
    ke_max
        N/m.
    uncertainty
        None: damping × 0.5 to 2, frequencies ± 3 %.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> band = robust_band(
    ...     example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), np.array([241.0]), 1e5
    ... )
    >>> bool(band.lowest[0] < band.nominal[0] < band.highest[0])
    True
    """
    check_blade_and_contact(blade, contact)
    speed = speeds("speed_hz", speed_hz)
    number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    family = uncertainty or Uncertainty()
    one = np.ones(blade.mode_count)
    low, high = family.frequency
    highest_hz = max(state.frequency_hz.max() for state in blade.states)
    passing = highest_hz / speed.min() * np.log(high / low)
    steps = int(np.clip(np.ceil(_PER_LOBE * passing), FEWEST_STEPS, MOST_STEPS)) if high > low else 1

    def first(damping: float, frequency: float, amplitude: float) -> np.ndarray:
        factors = Factors(damping * one, frequency * one, amplitude * one)
        found = first_crossings(problems_at(blade, contact, speed, factors), ke_max)
        return np.nan_to_num(found.critical_ke, nan=np.inf)

    nominal = first(1.0, 1.0, 1.0)
    least, most = nominal.copy(), nominal.copy()
    damped = np.full(len(speed), np.inf)
    for frequency in np.geomspace(low, high, steps):
        least = np.minimum(least, first(family.damping[0], frequency, family.amplitude[1]))
        sturdy = first(family.damping[1], frequency, family.amplitude[0])
        most, damped = np.maximum(most, sturdy), np.minimum(damped, sturdy)
    nominal, least, most, damped = (
        np.where(np.isfinite(ke), ke, np.nan) for ke in (nominal, least, most, damped)
    )
    return RobustBand(speed, float(ke_max), nominal, least, most, damped, steps)

"""The lobes of each mode alone, and which mode owns which lobe of the whole blade."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sdm_core.assessment.mode_selection import mode_alone, with_modes
from sdm_core.assessment.single_mode import floors_over_speed
from sdm_core.blade import Blade
from sdm_core.boundary import BoundarySolution, boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.lobe_tips import SEARCH_MARGIN, CriticalSpeed, check_range, least_critical_ke
from sdm_core.rubbing_blade import RubbingBlade, check_blade_and_contact
from sdm_core.validation import KE_LIMIT, number

# As in `lobe_tips`: a mode's lobes are followed where its floor is below this many times `ke_max`.
FOLLOWED_UP_TO = 4.0
_LOBES = 400


@dataclass(frozen=True)
class ModeLobes:
    """One mode by itself, the others dropped.

    Attributes
    ----------
    mode
        Its number, counted from 1.
    frequency_hz
        At the two ends of the range of speeds, Hz.
    floor_ke, floor_speed_hz
        Least of 2ξ(1 + ξ)ω²/G_jj over the range, N/m, and the speed where it is: no lobe of this mode
        alone reaches below. None where contact is not permanent, or the mode does not touch.
    tips
        Tips of its lobes by the exact core, deepest first; empty where the floor is too high for
        them to matter.
    """

    mode: int
    frequency_hz: tuple[float, float]
    floor_ke: float | None
    floor_speed_hz: float | None
    tips: tuple[CriticalSpeed, ...]

    @property
    def critical_ke(self) -> float | None:
        """K_e of the deepest lobe, N/m."""
        return self.tips[0].ke if self.tips else None


@dataclass(frozen=True)
class LobeOwner:
    """The mode to which a lobe of the whole blade belongs.

    Attributes
    ----------
    tip
        The lobe's tip.
    mode
        Number of the mode whose natural frequency at that speed is nearest below or at the chatter
        frequency in proportion, counted from 1.
    frequency_hz
        Its natural frequency there, Hz.
    participation
        Share of every mode in 1/K_e at the tip, adding up to 1: with λ the eigenvalue of W^½HW^½ that
        crosses and y its eigenvector, K_e = −1/(2 Re λ) and λ = Σ_j (yᵀg_j)²/(D_j yᵀy) is a sum over
        modes (DESIGN, fact 2). Below 0 for a mode that holds the others back. Empty where contact is
        not permanent.
    ke_without
        First crossing at the same speed when the mode is dropped, N/m; None where there is none below
        the largest K_e looked at.
    """

    tip: CriticalSpeed
    mode: int
    frequency_hz: float
    participation: tuple[float, ...]
    ke_without: float | None


def mode_lobes(
    blade: Blade,
    contact: ContactConfiguration,
    speed_range_hz: tuple[float, float],
    ke_max: float,
    *,
    count: int = 8,
) -> tuple[ModeLobes, ...]:
    """Every mode alone over a range of rotor speeds.

    A mode whose floor lies above `ke_max` is followed up to somewhat above its floor, if that is within
    `FOLLOWED_UP_TO` times `ke_max`; beyond, the closed form alone is given.

    Parameters
    ----------
    speed_range_hz
        Hz.
    ke_max
        Largest K_e of interest, N/m.
    count
        Most lobes a mode.

    Raises
    ------
    InvalidInput
        For an unusable range or stiffness, or more lobes than can be followed.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> found = mode_lobes(
    ...     example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), (150.0, 300.0), 2.5e4, count=1
    ... )
    >>> [mode.floor_ke <= mode.critical_ke for mode in found[:4]]
    [True, True, True, True]
    """
    check_blade_and_contact(blade, contact)
    check_range(*speed_range_hz)
    number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    speed, floors = floors_over_speed(blade, contact, speed_range_hz)
    frequency = blade.at_speeds(np.array(speed_range_hz))[0] / (2 * np.pi)
    out = []
    for j in range(blade.mode_count):
        at = int(np.argmin(floors[:, j]))
        touches = bool(np.isfinite(floors[at, j]))
        known = touches and contact.permanent
        reach = ke_max
        if known and floors[at, j] * SEARCH_MARGIN > ke_max:
            reach = float(floors[:, j].max()) * SEARCH_MARGIN
        tips: tuple[CriticalSpeed, ...] = ()
        if touches and (not known or floors[at, j] <= FOLLOWED_UP_TO * ke_max):
            alone = mode_alone(blade, j + 1)
            # All of them, then the deepest: a grid ranks lobes to a percent only.
            tips = least_critical_ke(alone, contact, *speed_range_hz, reach, count=_LOBES)[:count]
        out.append(
            ModeLobes(
                j + 1,
                (float(frequency[0, j]), float(frequency[1, j])),
                float(floors[at, j]) if known else None,
                float(speed[at]) if known else None,
                tips,
            )
        )
    return tuple(out)


def mode_boundaries(
    blade: Blade, contact: ContactConfiguration, speed_hz: np.ndarray, ke_max: float
) -> dict[int, BoundarySolution]:
    """Boundary of every mode alone that has one below `ke_max` at some of the speeds, by its number.

    Parameters
    ----------
    speed_hz
        Hz, shape (m,).
    ke_max
        N/m.
    """
    check_blade_and_contact(blade, contact)
    found = {
        mode: boundary(mode_alone(blade, mode), contact, speed_hz, ke_max, truncation=False)
        for mode in range(1, blade.mode_count + 1)
    }
    return {mode: alone for mode, alone in found.items() if np.isfinite(alone.critical_ke).any()}


def lobe_owners(
    blade: Blade, contact: ContactConfiguration, tips: Sequence[CriticalSpeed], ke_max: float
) -> tuple[LobeOwner, ...]:
    """The mode that owns each tip of the blade's lobes, with what the others contribute.

    Parameters
    ----------
    tips
        From `least_critical_ke` of the same blade and contact.
    ke_max
        Up to where a crossing is looked for with the owner dropped, N/m.
    """
    check_blade_and_contact(blade, contact)
    number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    if not tips:
        return ()
    speed = np.array([tip.speed_hz for tip in tips])
    natural = blade.at_speeds(speed)[0] / (2 * np.pi)
    owner = np.array([nearest_mode(row, tip.chatter_hz) for row, tip in zip(natural, tips, strict=True)])
    without = np.full(len(tips), np.nan)
    if blade.mode_count > 1:
        for mode in np.unique(owner):
            others = [k for k in range(1, blade.mode_count + 1) if k != mode]
            at = owner == mode
            rest = boundary(with_modes(blade, others), contact, speed[at], ke_max, truncation=False)
            without[at] = rest.critical_ke
    shares: list[tuple[float, ...]] = [()] * len(tips)
    if contact.permanent:
        problems = RubbingBlade.at_speeds(blade, contact, speed)
        shares = [_participation(p, tip) for p, tip in zip(problems, tips, strict=True)]
    return tuple(
        LobeOwner(
            tip,
            int(mode),
            float(natural[i, mode - 1]),
            shares[i],
            None if np.isnan(without[i]) else float(without[i]),
        )
        for i, (tip, mode) in enumerate(zip(tips, owner, strict=True))
    )


def nearest_mode(frequency_hz: np.ndarray, chatter_hz: float) -> int:
    """Number of the mode, from 1, whose natural frequency is nearest in proportion."""
    return int(np.argmin(np.abs(np.log(frequency_hz / chatter_hz)))) + 1


def _participation(problem: RubbingBlade, tip: CriticalSpeed) -> tuple[float, ...]:
    w, factor = 2 * np.pi * tip.chatter_hz, problem.contact_factor
    omega, damping = problem.omega, problem.damping_ratio
    flexibility = 1.0 / (omega**2 - w**2 + 2j * damping * omega * w)
    values, vectors = np.linalg.eig(factor.T @ (flexibility[:, None] * factor))
    # The one that crosses here, of those that could: −1/(2 Re λ) is the tip's K_e.
    at = int(np.argmin(np.abs(values.real * 2 * tip.ke + 1)))
    y = vectors[:, at]
    terms = (factor @ y) ** 2 * flexibility / (y @ y)
    return tuple((terms.real / terms.sum().real).tolist())

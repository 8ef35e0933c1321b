"""Margins in K_e and in rotor speed against a liner, over a range and at operating points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sdm_core.assessment.unstable_speeds import SpeedInterval, unstable_at, unstable_speeds
from sdm_core.blade import Blade
from sdm_core.boundary import boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import CriticalSpeed, check_range, least_critical_ke
from sdm_core.rubbing_blade import check_blade_and_contact
from sdm_core.validation import KE_LIMIT, SPEED_LIMITS_HZ, number

_MOST_TIPS = 2000


@dataclass(frozen=True)
class OperatingPoint:
    """A rotor speed at which the machine runs, with its share of the running time.

    Attributes
    ----------
    name, speed_hz, share
        Free text; Hz; shares are relative to their sum.
    """

    name: str
    speed_hz: float
    share: float = 1.0

    def __post_init__(self) -> None:
        number(f"operating_points.{self.name}.speed_hz", self.speed_hz, *SPEED_LIMITS_HZ, "Hz", open_low=True)
        number(f"operating_points.{self.name}.share", self.share, 0.0, 1e9, "of the running time")


@dataclass(frozen=True)
class PointMargin:
    """One operating point against the liner.

    Attributes
    ----------
    point
        The operating point.
    critical_ke
        First crossing there, N/m; None where there is none below the largest K_e looked at.
    margin_ke
        critical K_e over the liner's, minus 1; a lower bound where `critical_ke` is None.
    stable
        With the liner's K_e; None where not proven.
    margin_hz
        Distance to the nearest edge of an unstable interval, Hz: above 0 outside of it, below 0 inside. None
        where there is no edge in the range.
    nearest
        That interval.
    """

    point: OperatingPoint
    critical_ke: float | None
    margin_ke: float
    stable: bool | None
    margin_hz: float | None
    nearest: SpeedInterval | None


@dataclass(frozen=True)
class Margins:
    """Margins of a blade against a liner.

    Attributes
    ----------
    speed_range_hz, ke_liner, ke_max
        Hz; N/m; largest K_e looked at, N/m.
    worst
        Deepest lobe over the range, None where there is none below `ke_max`.
    margin_ke
        Least K_e over the liner's, minus 1; a lower bound where `worst` is None.
    unstable
        Speeds at which the blade is unstable with the liner's K_e, rising.
    unstable_speed_share
        Their share of the range.
    low_end_hz, high_end_hz
        From each end of the range to the nearest unstable speed, Hz; 0 where the end is unstable, None where
        no speed is.
    points
        The operating points.
    unstable_time_share
        Share of the running time at unstable operating points, those not proven stable included; None without
        points.
    proven
        False where the exact core left something unproven.
    """

    speed_range_hz: tuple[float, float]
    ke_liner: float
    ke_max: float
    worst: CriticalSpeed | None
    margin_ke: float
    unstable: tuple[SpeedInterval, ...]
    unstable_speed_share: float
    low_end_hz: float | None
    high_end_hz: float | None
    points: tuple[PointMargin, ...]
    unstable_time_share: float | None
    proven: bool


def margins(
    blade: Blade,
    contact: ContactConfiguration,
    speed_range_hz: tuple[float, float],
    ke_liner: float,
    *,
    ke_max: float | None = None,
    points: Sequence[OperatingPoint] = (),
) -> Margins:
    """Margins in K_e and Ω over a range of speeds and at operating points.

    Unstable speeds are those of `unstable_speeds`.

    Parameters
    ----------
    speed_range_hz
        Hz.
    ke_liner
        N/m.
    ke_max
        Largest K_e looked at; None is twice the liner's.
    points
        Operating points, inside the range.

    Raises
    ------
    InvalidInput
        For an unusable range, stiffness or point.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> found = margins(
    ...     example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), (230.0, 300.0), 9500.0,
    ...     points=[OperatingPoint("cruise", 241.0)],
    ... )  # fmt: skip
    >>> found.points[0].stable
    False
    """
    check_blade_and_contact(blade, contact)
    check_range(*speed_range_hz)
    number("ke_liner", ke_liner, 0.0, KE_LIMIT, "N/m", open_low=True)
    ke_max = 2 * ke_liner if ke_max is None else number("ke_max", ke_max, ke_liner, KE_LIMIT, "N/m")
    for i, point in enumerate(points):
        if not speed_range_hz[0] <= point.speed_hz <= speed_range_hz[1]:
            raise InvalidInput(
                f"operating_points[{i}].speed_hz",
                point.speed_hz,
                f"stay in the range of speeds, {speed_range_hz[0]:g} to {speed_range_hz[1]:g} Hz",
            )
    tips = least_critical_ke(blade, contact, *speed_range_hz, ke_max, count=_MOST_TIPS)
    worst = tips[0] if tips else None
    deep = [tip.speed_hz for tip in tips if tip.ke <= ke_liner]
    intervals, proven = unstable_speeds(blade, contact, speed_range_hz, ke_liner, deep)
    judged = _points(blade, contact, points, intervals, ke_liner, ke_max)
    time = sum(p.point.share for p in judged)
    bad = sum(p.point.share for p in judged if p.stable is not True)
    low, high = speed_range_hz
    return Margins(
        speed_range_hz,
        float(ke_liner),
        float(ke_max),
        worst,
        (ke_max if worst is None else worst.ke) / ke_liner - 1.0,
        intervals,
        sum(i.high_hz - i.low_hz for i in intervals) / (high - low),
        intervals[0].low_hz - low if intervals else None,
        high - intervals[-1].high_hz if intervals else None,
        judged,
        bad / time if time > 0 else None,
        proven and all(tip.proven for tip in tips),
    )


def _points(
    blade: Blade,
    contact: ContactConfiguration,
    points: Sequence[OperatingPoint],
    intervals: tuple[SpeedInterval, ...],
    ke_liner: float,
    ke_max: float,
) -> tuple[PointMargin, ...]:
    if not points:
        return ()
    found = boundary(blade, contact, np.array([p.speed_hz for p in points]), ke_max, truncation=False)
    unstable = unstable_at(found, ke_liner)
    out = []
    for i, point in enumerate(points):
        first = float(found.critical_ke[i])
        critical = None if np.isnan(first) else first
        distance, nearest = _to_edge(point.speed_hz, intervals)
        out.append(
            PointMargin(
                point,
                critical,
                (ke_max if critical is None else critical) / ke_liner - 1.0,
                not bool(unstable[i]) if np.isfinite(found.error_estimate[i]) else None,
                distance,
                nearest,
            )
        )
    return tuple(out)


def _to_edge(
    speed_hz: float, intervals: tuple[SpeedInterval, ...]
) -> tuple[float | None, SpeedInterval | None]:
    """Distance to the nearest edge, below 0 inside an interval, and its interval."""
    for interval in intervals:
        if interval.low_hz <= speed_hz <= interval.high_hz:
            # An end of the range is no edge: how far the interval goes on is not known.
            depth = [
                abs(speed_hz - edge)
                for edge, is_open in (
                    (interval.low_hz, interval.open_low),
                    (interval.high_hz, interval.open_high),
                )
                if not is_open
            ]
            return (-min(depth) if depth else None), interval
    if not intervals:
        return None, None
    away = [max(i.low_hz - speed_hz, speed_hz - i.high_hz) for i in intervals]
    at = int(np.argmin(away))
    return away[at], intervals[at]

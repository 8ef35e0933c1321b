"""Rotor speeds as people write them: in Hz, in rpm, or as a ratio to the first frequency at rest."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sdm_core.errors import InvalidInput, OutOfSpeedRange
from sdm_core.validation import SPEED_LIMITS_HZ, number

if TYPE_CHECKING:
    from sdm_core.blade import Blade

UNITS = ("Hz", "rpm", "ratio")
# The operating range assumed when none is given: from ground idle to a little overspeed.
IDLE_SHARE, OVERSPEED_SHARE = 0.30, 1.05
# Without a design speed, the range of [SBL] section 4, from where its lobes can be told apart.
LOWEST_RATIO, HIGHEST_RATIO = 0.05, 0.45

_SPEED = re.compile(
    r"\s*(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf)\s*(?P<unit>[a-z]*)\s*", re.I
)
_HINT = "give a number with its unit, e.g. 150Hz, 9000rpm or 0.25ratio"


@dataclass(frozen=True)
class Speed:
    """One rotor speed in the unit it was written in.

    Attributes
    ----------
    value
        Above 0.
    unit
        ``Hz`` (revolutions per second), ``rpm``, or ``ratio`` (speed over the blade's first
        frequency at rest, the abscissa of [SBL] section 4).

    Examples
    --------
    >>> Speed(9000.0, "rpm").in_hz(first_frequency_hz=600.0)
    150.0
    >>> Speed.parse("0.25ratio").in_hz(first_frequency_hz=600.0)
    150.0
    """

    value: float
    unit: str

    @classmethod
    def parse(cls, text: str, field: str = "speed", *, unit: str | None = None) -> Speed:
        """From text such as ``150Hz``; `unit` stands in where the text names none.

        Raises
        ------
        InvalidInput
            Naming `field`, the text and the remedy.
        """
        match = _SPEED.fullmatch(text)
        if match is None:
            raise InvalidInput(field, text, _HINT)
        written = match["unit"] or unit
        if not written:
            raise InvalidInput(field, text, _HINT)
        known = {name.lower(): name for name in UNITS}
        if written.lower() not in known:
            raise InvalidInput(field, text, f"use one of the units {', '.join(UNITS)}")
        value = float(match["number"])
        if not np.isfinite(value) or value <= 0:
            raise InvalidInput(field, text, "give a finite speed above 0")
        return cls(value, known[written.lower()])

    def in_hz(self, first_frequency_hz: float) -> float:
        """Revolutions per second for a blade with this first frequency at rest."""
        return self.value * {"Hz": 1.0, "rpm": 1 / 60.0, "ratio": first_frequency_hz}[self.unit]

    def __str__(self) -> str:
        return f"{self.value:g}{self.unit}"


@dataclass(frozen=True)
class SpeedRange:
    """Rotor speeds from `low` to `high`, each in its own unit.

    Examples
    --------
    >>> SpeedRange.parse("3000rpm:18000rpm").low
    Speed(value=3000.0, unit='rpm')
    >>> str(SpeedRange.parse("0.05:0.33ratio"))
    '0.05ratio:0.33ratio'
    """

    low: Speed
    high: Speed
    field: str = "speed"

    @classmethod
    def parse(cls, text: str, field: str = "speed") -> SpeedRange:
        """From ``LOW:HIGH``; a unit written once holds for both ends.

        Raises
        ------
        InvalidInput
            Naming `field`, the text and the remedy.
        """
        ends = text.split(":")
        if len(ends) != 2:
            raise InvalidInput(
                field,
                text,
                "give a range LOW:HIGH with its unit, e.g. 50Hz:300Hz, 3000rpm:18000rpm, 0.05:0.33ratio",
            )
        units = [m["unit"] if (m := _SPEED.fullmatch(end)) else "" for end in ends]
        low = Speed.parse(ends[0], field, unit=units[1])
        high = Speed.parse(ends[1], field, unit=units[0])
        if low.unit == high.unit and low.value >= high.value:
            raise InvalidInput(field, text, "give the lower speed first")
        return cls(low, high, field)

    @classmethod
    def from_hz(cls, low_hz: float, high_hz: float, field: str = "speed_range_hz") -> SpeedRange:
        """From two speeds in Hz.

        Raises
        ------
        InvalidInput
            When they are not positive, finite and rising.
        """
        low = number(f"{field}[0]", low_hz, *SPEED_LIMITS_HZ, "Hz")
        high = number(f"{field}[1]", high_hz, *SPEED_LIMITS_HZ, "Hz")
        if low >= high:
            raise InvalidInput(field, [low, high], "give the lower speed first")
        return cls(Speed(low, "Hz"), Speed(high, "Hz"), field)

    def for_blade(self, blade: Blade) -> tuple[float, float]:
        """(low, high) in Hz for this blade.

        Raises
        ------
        OutOfSpeedRange
            When the blade's modal data do not reach the range.
        InvalidInput
            When the ends, in different units, come out in the wrong order.
        """
        low, high = (end.in_hz(blade.first_frequency_hz) for end in (self.low, self.high))
        if low >= high:
            raise InvalidInput(self.field, str(self), f"give the lower speed first: {low:g} to {high:g} Hz")
        for hz in (low, high):
            number(self.field, hz, *SPEED_LIMITS_HZ, "Hz")
        if blade.speed_range_hz is not None:
            first, last = blade.speed_range_hz
            slack = 1e-9 * last
            if low < first - slack or high > last + slack:
                raise OutOfSpeedRange(
                    self.field,
                    f"{self} ({low:g} to {high:g} Hz)",
                    f"blade {blade.name!r} has modal data from {first:g} to {last:g} Hz: "
                    "stay inside or add a state",
                )
        return low, high

    def __str__(self) -> str:
        return f"{self.low}:{self.high}"


def operating_range(blade: Blade) -> tuple[float, float]:
    """The range (low, high) in Hz screened when none is given.

    From 0.30 to 1.05 of the design speed where the blade names one, else 0.05 to 0.45 of its first
    frequency; never below a ratio of 0.05 nor outside the blade's modal data.

    Raises
    ------
    InvalidInput
        When nothing is left of it.
    """
    floor = LOWEST_RATIO * blade.first_frequency_hz
    if blade.design_speed_hz is not None:
        low, high = IDLE_SHARE * blade.design_speed_hz, OVERSPEED_SHARE * blade.design_speed_hz
    else:
        low, high = floor, HIGHEST_RATIO * blade.first_frequency_hz
    low = max(low, floor)
    if blade.speed_range_hz is not None:
        low, high = max(low, blade.speed_range_hz[0]), min(high, blade.speed_range_hz[1])
    if low >= high:
        raise InvalidInput(
            "speed",
            "left out",
            f"blade {blade.name!r} has no usual operating range; give one, e.g. 50Hz:300Hz",
        )
    return low, high


def evenly_spaced(low_hz: float, high_hz: float, count: int) -> np.ndarray:
    """`count` speeds in Hz, evenly spaced: the abscissa of a map."""
    return np.linspace(low_hz, high_hz, count)

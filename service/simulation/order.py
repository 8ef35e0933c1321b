"""What a simulation is asked: a blade, speeds, a liner, a casing, and how finely."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from sdm_core.blade import Blade, blade_from_dict, blade_to_dict
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.time_domain.liner.abradable_liner import Friction
from sdm_core.time_domain.liner.central_differences import LEAST_STEPS_PER_CELL, CentralDifferences
from sdm_core.time_domain.liner.liner_rub import LinerRub
from sdm_core.time_domain.liner.speed_sweep import SPECTRUM_REVOLUTIONS
from sdm_core.validation import number, speeds
from service.simulation.constants import CasingConstants, LinerConstants

USUAL_REVOLUTIONS, USUAL_CELLS = 50, 8000
SCHEMA = "rubscreen/simulation-request/1"
_ANGLES = 1000  # kept of each worn profile of many speeds
_SAMPLES = 500  # kept of a revolution, at least
_FEWEST_LINES, _MOST_LINES = 400, 4000


@dataclass(frozen=True)
class SimulationOrder:
    """A blade that rubs its liner at one rotor speed or at many.

    Attributes
    ----------
    blade
        Modal data.
    speed_hz
        Rising, Hz, shape (m,).
    nodes
        Tip nodes that can touch; the first one's spectra are taken.
    revolutions
        At each speed.
    liner, casing
        What they touch.
    friction
        None leaves it out.
    cells
        Of the circumference.
    steps_per_cell
        None chooses one, unless that is too long a step for the modes: a bar that is unloaded within its cell
        damps the blade (`CentralDifferences`), with one step a cell none is.

    Raises
    ------
    InvalidInput
        For whatever cannot be used.
    OutOfSpeedRange
        Where the modal data do not reach.
    """

    blade: Blade
    speed_hz: tuple[float, ...]
    nodes: tuple[str, ...]
    revolutions: int = USUAL_REVOLUTIONS
    liner: LinerConstants = field(default_factory=LinerConstants)
    casing: CasingConstants = field(default_factory=CasingConstants)
    friction: Friction | None = None
    cells: int = USUAL_CELLS
    steps_per_cell: int | None = None

    @cached_property
    def single(self) -> bool:
        """Whether it is one speed, of which the whole response is kept."""
        return len(self.speed_hz) == 1

    def __post_init__(self) -> None:
        checked = speeds("speed_hz", list(self.speed_hz))
        if (np.diff(checked) <= 0).any():
            i = int(np.argmax(np.diff(checked) <= 0)) + 1
            raise InvalidInput(f"speed_hz[{i}]", float(checked[i]), "give rising speeds, each of them once")
        object.__setattr__(self, "speed_hz", tuple(checked.tolist()))
        object.__setattr__(self, "nodes", tuple(self.nodes))
        if isinstance(self.revolutions, bool) or not isinstance(self.revolutions, int | np.integer):
            raise InvalidInput("revolutions", self.revolutions, "give a whole number")
        number("revolutions", int(self.revolutions), 1, 1e6, "")
        CentralDifferences(self.cells, self.steps_per_cell)
        self.blade.at_speeds(checked)
        _ = self.rub, self.method

    @cached_property
    def rub(self) -> LinerRub:
        """The problem."""
        return LinerRub(
            self.blade,
            self.nodes,
            _under("liner", self.liner.liner),
            _under("casing", lambda: self.casing.casing(self.blade)),
            self.friction,
        )

    @cached_property
    def method(self) -> CentralDifferences:
        """The steps, short enough at the lowest speed."""
        slowest, fastest = self.speed_hz[0], self.frequency_hz[-1]
        samples = max(_SAMPLES, int(np.ceil(2 * fastest / slowest)))
        asked = CentralDifferences(self.cells, self.steps_per_cell, samples)
        modes, bars = self.rub.modes(slowest), self.rub.bars(self.cells)
        asked.scheme(modes, bars, slowest)
        if self.steps_per_cell is not None or self.cells < 4 * LEAST_STEPS_PER_CELL:
            return asked
        # Where the least number of steps would do with a fraction of the cells, one step a cell will.
        coarse = CentralDifferences(self.cells // LEAST_STEPS_PER_CELL, None, samples)
        enough = coarse.steps_in_a_cell(modes, bars, slowest) == LEAST_STEPS_PER_CELL
        return replace(asked, steps_per_cell=1) if enough else asked

    @cached_property
    def frequency_hz(self) -> np.ndarray:
        """Of the spectra, from 0 to a tenth beyond the highest mode, Hz, shape (k,).

        Close enough that no line of the lowest speed's spectrum falls between two.
        """
        omega, _ = self.blade.at_speeds(np.array([self.speed_hz[-1]]))
        highest = 1.1 * float(omega.max()) / (2 * np.pi)
        line = self.speed_hz[0] / min(self.revolutions, SPECTRUM_REVOLUTIONS)
        many = int(np.clip(np.ceil(highest / line), _FEWEST_LINES, _MOST_LINES))
        return np.linspace(0.0, highest, many + 1)

    @property
    def ke(self) -> float:
        """K_e of the liner, N/m."""
        return float(self.rub.cutting_stiffness(self.cells)[0])

    @property
    def ke_without_recovery(self) -> float:
        """What the delay equation is to be given for the same verdict (`critical_ke_factor`), N/m."""
        return self.ke / self.rub.liner.critical_ke_factor

    @property
    def contact(self) -> ContactConfiguration:
        """Permanent contact of the same nodes, for the exact core."""
        return ContactConfiguration(dict.fromkeys(self.nodes, 1.0))

    @cached_property
    def angles(self) -> int:
        """Angles that worn profiles are kept at: all cells of one speed, about a thousand of many."""
        if self.single or self.cells <= _ANGLES:
            return self.cells
        return max(n for n in range(1, _ANGLES + 1) if self.cells % n == 0)

    @property
    def steps(self) -> int:
        """Steps in all."""
        modes_at = (self.rub.modes(speed) for speed in (self.speed_hz[0], self.speed_hz[-1]))
        bars, ends = self.rub.bars(self.cells), (self.speed_hz[0], self.speed_hz[-1])
        each = [
            self.method.steps_in_a_cell(modes, bars, hz) for modes, hz in zip(modes_at, ends, strict=True)
        ]
        return max(each) * self.cells * self.revolutions * len(self.speed_hz)

    @property
    def kept_values(self) -> int:
        """Numbers held at once while one speed is simulated."""
        many = 2 * self.blade.damping_ratio.size + len(self.nodes)
        return self.method.samples_per_revolution * self.revolutions * many

    def at(self, speed_hz: Sequence[float]) -> SimulationOrder:
        """The same at some of its speeds, which are kept as they would be among all of them."""
        part = replace(self, speed_hz=tuple(speed_hz))
        for name in ("frequency_hz", "method", "single", "angles"):
            part.__dict__[name] = getattr(self, name)
        return part

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        friction = self.friction
        return {
            "schema": SCHEMA,
            "blade": blade_to_dict(self.blade),
            "speed_hz": list(self.speed_hz),
            "nodes": list(self.nodes),
            "revolutions": self.revolutions,
            "liner": self.liner.to_dict(),
            "casing": self.casing.to_dict(),
            "friction": None
            if friction is None
            else {"coefficient": friction.coefficient, "rotation": friction.rotation},
            "cells": self.cells,
            "steps_per_cell": self.steps_per_cell,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """From the JSON of `to_dict`."""
        given = {f.name: data[f.name] for f in fields(cls)}
        given["blade"] = blade_from_dict(data["blade"])
        given["liner"] = LinerConstants.from_dict(data["liner"])
        given["casing"] = CasingConstants.from_dict(data["casing"])
        given["friction"] = None if data["friction"] is None else Friction(**data["friction"])
        return cls(**given)


def _under(name: str, make: Any) -> Any:
    try:
        return make()
    except InvalidInput as error:
        raise error.under(name) from None

"""All that makes a blade from its shape: sections, material, mesh, speeds, contact at the tip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sdm_core.blade.finite_elements.material import TITANIUM, Material
from sdm_core.blade.profile.parametric import ParametricBlade
from sdm_core.blade.profile.sections import SectionTable
from sdm_core.blade.solid_mesh import Subdivision
from sdm_core.blade.tip_contact import TipContact
from sdm_core.errors import InvalidInput
from sdm_core.validation import LARGEST_DAMPING, SPEED_LIMITS_HZ, number, vector

# States at these shares of the design speed, unless speeds are given: ω² is then a parabola in Ω²
# that covers the whole range and a little overspeed.
STATE_SHARES = (0.0, 0.7, 1.05)
MOST_MODES = 20
# m/s; compressors and fans stay below 600, and no disk holds more.
FASTEST_TIP = 1000.0
MOST_STATES = 9


@dataclass(frozen=True)
class BladeProfile:
    """A blade as its designer gives it.

    Parameters
    ----------
    name
        Free text.
    shape
        Parameters, or a table of sections.
    design_speed_hz
        Hz.
    material
        Isotropic; titanium where none is given.
    damping_ratio
        One for all modes, or one a mode.
    modes
        Modes kept in the blade file.
    speeds_hz
        Rotor speeds of the states, Hz, rising from 0; None: `STATE_SHARES` of the design speed.
    subdivision
        Of the mesh.
    tip
        Contact nodes and direction.
    edge_cut
        Share of the camber line cut off at each edge of a section table; parameters carry their own.

    Raises
    ------
    InvalidInput
        Naming the field, the value and the remedy.
    """

    name: str
    shape: ParametricBlade | SectionTable
    design_speed_hz: float
    material: Material = TITANIUM
    damping_ratio: float | tuple[float, ...] = 1e-3
    modes: int = 5
    speeds_hz: tuple[float, ...] | None = None
    subdivision: Subdivision = field(default_factory=Subdivision)
    tip: TipContact = field(default_factory=TipContact)
    edge_cut: float = 0.008

    def __post_init__(self) -> None:
        put = object.__setattr__
        if not isinstance(self.name, str) or not self.name:
            raise InvalidInput("name", self.name, "give the blade a name")
        design = number("design_speed_hz", self.design_speed_hz, *SPEED_LIMITS_HZ, "Hz")
        put(self, "design_speed_hz", design)
        if (
            isinstance(self.modes, bool)
            or not isinstance(self.modes, int)
            or not 1 <= self.modes <= MOST_MODES
        ):
            raise InvalidInput("modes", self.modes, f"give a whole number from 1 to {MOST_MODES}")
        put(self, "damping_ratio", _damping(self.damping_ratio, self.modes))
        put(self, "edge_cut", number("edge_cut", self.edge_cut, 0.0, 0.2, "of the chord"))
        if self.speeds_hz is not None:
            put(self, "speeds_hz", _speeds(self.speeds_hz))
        radius = max(float(side[..., 1].max()) for side in self.sections().sides)
        for field_name, speed in (("design_speed_hz", design), ("speeds_hz", max(self.state_speeds_hz))):
            tip_speed = 2 * np.pi * speed * radius
            if tip_speed > FASTEST_TIP:
                raise InvalidInput(
                    field_name,
                    speed,
                    f"the tip would move at {tip_speed:,.0f} m/s: give revolutions per second (Hz), not rpm",
                )

    @property
    def state_speeds_hz(self) -> tuple[float, ...]:
        """Rotor speeds of the states, Hz."""
        if self.speeds_hz is not None:
            return self.speeds_hz
        return tuple(share * self.design_speed_hz for share in STATE_SHARES)

    def sections(self) -> SectionTable:
        return self.shape.sections() if isinstance(self.shape, ParametricBlade) else self.shape

    @property
    def cut(self) -> float:
        """Share of the camber line cut off at each edge."""
        return self.shape.edge_cut if isinstance(self.shape, ParametricBlade) else self.edge_cut

    @property
    def casing_slope(self) -> float | None:
        """dr/dz of the casing where the shape knows it."""
        return self.shape.casing_slope if isinstance(self.shape, ParametricBlade) else None

    def with_shape(self, **parameters: float | Sequence[float]) -> BladeProfile:
        """The same blade with other parameters of its shape, for sensitivities and studies.

        Raises
        ------
        InvalidInput
            For a blade given by sections, or a parameter there is not.
        """
        if not isinstance(self.shape, ParametricBlade):
            raise InvalidInput("shape", "a section table", "only a parametric blade has parameters to change")
        for name in parameters:
            if not hasattr(self.shape, name):
                raise InvalidInput(name, parameters[name], "there is no such parameter")
        changed: dict[str, Any] = dict(parameters)
        return replace(self, shape=replace(self.shape, **changed))


def _damping(value: float | Sequence[float], modes: int) -> float | tuple[float, ...]:
    if isinstance(value, int | float | np.number):
        return number("damping_ratio", value, 0.0, LARGEST_DAMPING, "")
    values = vector("damping_ratio", value, 0.0, LARGEST_DAMPING, "")
    if len(values) != modes:
        raise InvalidInput("damping_ratio", f"{len(values)} numbers", f"give one, or one a mode: {modes}")
    return tuple(float(v) for v in values)


def _speeds(values: Sequence[float]) -> tuple[float, ...]:
    speeds = vector("speeds_hz", values, 0.0, SPEED_LIMITS_HZ[1], "Hz")
    if len(speeds) > MOST_STATES:
        raise InvalidInput("speeds_hz", f"{len(speeds)} speeds", f"give at most {MOST_STATES}")
    if (np.diff(speeds) <= 0).any():
        raise InvalidInput("speeds_hz", list(speeds), "give rising speeds, each once")
    return tuple(float(v) for v in speeds)

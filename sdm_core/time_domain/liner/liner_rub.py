"""The problem: a blade whose tip may touch an abradable liner, and how it moves at the start."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sdm_core.blade import Blade
from sdm_core.errors import InvalidInput
from sdm_core.time_domain.liner.abradable_liner import AbradableLiner, Bars, Friction
from sdm_core.time_domain.liner.casing import Casing
from sdm_core.time_domain.liner.tip_modes import TipModes
from sdm_core.validation import SPEED_LIMITS_HZ, number, vector


@dataclass(frozen=True)
class LinerRub:
    """A blade whose tip may touch an abradable liner.

        ẍ + 2ξΛẋ + Λ²x = −V_c F − V_t F_t,    u = V_cᵀx,

    with the forces F ≥ 0 of the liner's bars on the contact nodes, which push the tip inwards, and friction
    F_t = ±μF against the direction in which the tip slides.

    Parameters
    ----------
    blade
        Modal data; its direction of contact is the one that counts.
    nodes
        Names of the tip nodes that can touch.
    liner, casing
        What they touch.
    friction
        None leaves it out.

    Raises
    ------
    InvalidInput
        For a node the blade has not got, and for clearances or widths of another number than nodes.
    """

    blade: Blade
    nodes: tuple[str, ...]
    liner: AbradableLiner
    casing: Casing
    friction: Friction | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.blade, Blade):
            raise InvalidInput("blade", type(self.blade).__name__, "give a Blade, e.g. read_blade(path)")
        if not isinstance(self.nodes, list | tuple) or len(self.nodes) == 0:
            remedy = f"give a list of tip nodes that can touch, e.g. [{self.blade.tip_nodes[0]!r}]"
            raise InvalidInput("nodes", self.nodes, remedy)
        for name, kind in (("liner", AbradableLiner), ("casing", Casing)):
            given = getattr(self, name)
            if not isinstance(given, kind):
                raise InvalidInput(name, type(given).__name__, f"give {_a(kind.__name__)}")
        if not isinstance(self.friction, Friction | None):
            remedy = "give a Friction(coefficient, rotation), or None"
            raise InvalidInput("friction", self.friction, remedy)
        object.__setattr__(self, "nodes", tuple(self.nodes))
        for i, node in enumerate(self.nodes):
            if node not in self.blade.tip_nodes or node in self.nodes[:i]:
                known = ", ".join(self.blade.tip_nodes)
                raise InvalidInput(f"nodes[{i}]", node, f"name each tip node once, of {known}")
        self.casing.clearances(len(self.nodes))
        self.liner.widths(len(self.nodes))
        if self.friction is not None and any(s.mode_shape_tangential is None for s in self.blade.states):
            TipModes.of_blade(self.blade, self.nodes, self.blade.states[0].speed_hz, tangential=True)

    def modes(self, speed_hz: float, *, extrapolate: bool = False) -> TipModes:
        """The blade's modal data at a rotor speed."""
        number("speed_hz", speed_hz, *SPEED_LIMITS_HZ, "Hz")
        return TipModes.of_blade(
            self.blade,
            self.nodes,
            speed_hz,
            tangential=self.friction is not None,
            extrapolate=extrapolate,
        )

    def bars(self, cells: int) -> Bars:
        """The bars under the contact nodes."""
        return self.liner.bars(len(self.nodes), 2 * np.pi * self.casing.radius_m / cells)

    def cutting_stiffness(self, cells: int) -> np.ndarray:
        """K_e of each contact node, N/m, shape (r,)."""
        return self.liner.cutting_stiffness(self.bars(cells))


@dataclass(frozen=True)
class InitialMotion:
    """Modal displacement (kg^½ m) and velocity (kg^½ m/s) at t = 0, each of shape (n,)."""

    displacement: np.ndarray
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def checked(self, modes: int) -> tuple[np.ndarray, np.ndarray]:
        """Both, of `modes` numbers; an empty velocity is zero."""
        put = vector("initial.displacement", self.displacement, -1e6, 1e6, "kg^1/2 m")
        still = hasattr(self.velocity, "__len__") and len(self.velocity) == 0
        moving: Any = np.zeros(modes) if still else self.velocity
        pushed = vector("initial.velocity", moving, -1e9, 1e9, "kg^1/2 m/s")
        for name, values in (("displacement", put), ("velocity", pushed)):
            if len(values) != modes:
                raise InvalidInput(
                    f"initial.{name}", f"{len(values)} numbers", f"give one number a mode: {modes}"
                )
        return put, pushed


def _a(name: str) -> str:
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"

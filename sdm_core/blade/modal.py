"""A blade as its modal data at one or more rotor speeds, interpolated between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from sdm_core.blade.tracking import FURTHER_SHAPES, rising_modes, tracked
from sdm_core.errors import InvalidInput, OutOfSpeedRange
from sdm_core.validation import (
    AMPLITUDE_LIMIT,
    FREQUENCY_LIMITS_HZ,
    LARGEST_DAMPING,
    SPEED_LIMITS_HZ,
    matrix,
    number,
    vector,
)

DIRECTIONS = ("casing_normal", "radial", "given")


@dataclass(frozen=True)
class ModalState:
    """Modes of the blade at one rotor speed.

    Parameters
    ----------
    speed_hz
        Rotor speed, Hz; 0 is at rest.
    frequency_hz
        Natural frequencies, Hz, shape (n,), in any order.
    mode_shape
        Mass-normalised amplitudes at the tip nodes in the contact direction, kg^-1/2, shape (n, r).
    mode_shape_radial, mode_shape_tangential, mode_shape_axial
        The same along the cylindrical directions of the rotor, where known.
    tip_growth_m
        Static displacement of the tip nodes in the contact direction by rotation, positive towards
        the casing, m, shape (r,), where known.
    untwist_rad
        Turn of the tip's chord about the radial direction by rotation, rad, positive towards the
        axial direction (the blade opens), where known.
    """

    speed_hz: float
    frequency_hz: np.ndarray
    mode_shape: np.ndarray
    mode_shape_radial: np.ndarray | None = None
    mode_shape_tangential: np.ndarray | None = None
    mode_shape_axial: np.ndarray | None = None
    tip_growth_m: np.ndarray | None = None
    untwist_rad: float | None = None

    def __post_init__(self) -> None:
        speed = number("speed_hz", self.speed_hz, 0.0, SPEED_LIMITS_HZ[1], "Hz")
        frequency = vector("frequency_hz", self.frequency_hz, *FREQUENCY_LIMITS_HZ, "Hz")
        shape = _shape("mode_shape", self.mode_shape, len(frequency), None)
        object.__setattr__(self, "speed_hz", speed)
        object.__setattr__(self, "frequency_hz", frequency)
        object.__setattr__(self, "mode_shape", shape)
        for name in FURTHER_SHAPES:
            if getattr(self, name) is not None:
                checked = _shape(name, getattr(self, name), len(frequency), shape.shape[1])
                object.__setattr__(self, name, checked)
        if self.tip_growth_m is not None:
            growth = vector("tip_growth_m", self.tip_growth_m, -1.0, 1.0, "m")
            if len(growth) != shape.shape[1]:
                raise InvalidInput(
                    "tip_growth_m", f"{len(growth)} numbers", f"give one a tip node: {shape.shape[1]}"
                )
            object.__setattr__(self, "tip_growth_m", growth)
        if self.untwist_rad is not None:
            untwist = number("untwist_rad", self.untwist_rad, -np.pi, np.pi, "rad")
            object.__setattr__(self, "untwist_rad", untwist)

    def reordered(self, order: np.ndarray, sign: np.ndarray) -> ModalState:
        """The same state with its modes in another order and with other signs."""

        shapes = {"mode_shape": self.mode_shape}
        shapes |= {key: getattr(self, key) for key in FURTHER_SHAPES if getattr(self, key) is not None}
        turned = {key: shape[order] * sign[:, None] for key, shape in shapes.items()}
        return replace(self, frequency_hz=self.frequency_hz[order], **turned)


@dataclass(frozen=True)
class Blade:
    """A blade's modal data, tracked from state to state ([SBL] 3.1 and 4.3).

    Parameters
    ----------
    name
        Free text.
    tip_nodes
        Names of the r tip nodes, leading to trailing edge.
    damping_ratio
        ξ, one number or one a mode, 0 ≤ ξ < 1.
    states
        One or more modal states; one means no centrifugal effect. Modes are followed from state
        to state by shape and frequency and put in the order of the first state.
    direction
        Direction of the amplitudes: ``casing_normal``, ``radial`` or ``given`` (by whoever made it).
    design_speed_hz, mass_kg, tip_radius_m, tip_z_m, material, tip_theta_rad
        As in the blade file; optional.

    Raises
    ------
    InvalidInput
        For unusable data.
    ModesNotTracked
        When the modes of one state cannot be told among those of the next.

    Examples
    --------
    >>> blade = Blade("b", ("LE",), 1e-3, [ModalState(0.0, [100.0, 400.0], [[1.0], [0.8]])])
    >>> blade.at_speed(30.0).frequency_hz
    array([100., 400.])
    """

    name: str
    tip_nodes: tuple[str, ...]
    damping_ratio: np.ndarray
    states: tuple[ModalState, ...]
    direction: str = "casing_normal"
    design_speed_hz: float | None = None
    mass_kg: float | None = None
    tip_radius_m: tuple[float, ...] | None = None
    tip_z_m: tuple[float, ...] | None = None
    material: dict[str, Any] | None = field(default=None, hash=False)
    tip_theta_rad: tuple[float, ...] | None = None

    def __init__(
        self,
        name: str,
        tip_nodes: Sequence[str],
        damping_ratio: float | Sequence[float] | np.ndarray,
        states: Sequence[ModalState],
        direction: str = "casing_normal",
        design_speed_hz: float | None = None,
        mass_kg: float | None = None,
        tip_radius_m: Sequence[float] | None = None,
        tip_z_m: Sequence[float] | None = None,
        material: dict[str, Any] | None = None,
        tip_theta_rad: Sequence[float] | None = None,
    ) -> None:
        put = object.__setattr__
        if not isinstance(name, str) or not name:
            raise InvalidInput("name", name, "give the blade a name")
        put(self, "name", name)
        put(self, "tip_nodes", _node_names(tip_nodes))
        if direction not in DIRECTIONS:
            raise InvalidInput("direction", direction, f"give one of {', '.join(DIRECTIONS)}")
        put(self, "direction", direction)
        in_order = _ordered_states(states, len(self.tip_nodes))
        put(self, "states", tracked(in_order))
        damping = _damping(damping_ratio, self.mode_count)[rising_modes(in_order[0])]
        damping.setflags(write=False)
        put(self, "damping_ratio", damping)
        put(self, "design_speed_hz", design_speed_hz)
        if design_speed_hz is not None:
            number("design_speed_hz", design_speed_hz, *SPEED_LIMITS_HZ, "Hz")
        put(self, "mass_kg", mass_kg)
        if mass_kg is not None:
            number("mass_kg", mass_kg, 0.0, 1e6, "kg", open_low=True)
        places = (
            ("tip_radius_m", tip_radius_m, "m"),
            ("tip_z_m", tip_z_m, "m"),
            ("tip_theta_rad", tip_theta_rad, "rad"),
        )
        for key, values, unit in places:
            put(self, key, None if values is None else tuple(vector(key, values, -1e3, 1e3, unit)))
            if values is not None and len(values) != len(self.tip_nodes):
                raise InvalidInput(
                    key, f"{len(values)} numbers", f"give one a tip node: {len(self.tip_nodes)}"
                )
        if material is not None and not isinstance(material, dict):
            raise InvalidInput("material", material, 'give an object such as {"rho": 4400.0}')
        put(self, "material", material)

    @property
    def mode_count(self) -> int:
        """n."""
        return len(self.states[0].frequency_hz)

    @property
    def first_frequency_hz(self) -> float:
        """First frequency of the slowest state: the reference of `speed_ratio` ([SBL] 4)."""
        return float(self.states[0].frequency_hz.min())

    @property
    def speed_range_hz(self) -> tuple[float, float] | None:
        """Rotor speeds covered by the states, Hz; None (any) for a blade with one state."""
        if len(self.states) == 1:
            return None
        return self.states[0].speed_hz, self.states[-1].speed_hz

    @cached_property
    def _interpolant(self) -> tuple[CubicSpline, CubicSpline]:
        # Not-a-knot: linear through two states, a parabola in Ω² through three (DESIGN, fact 9).
        x = np.array([s.speed_hz**2 for s in self.states])
        squares = np.array([(2 * np.pi * s.frequency_hz) ** 2 for s in self.states])
        shapes = np.array([s.mode_shape for s in self.states])
        return CubicSpline(x, squares), CubicSpline(x, shapes)

    def at_speeds(self, speed_hz: np.ndarray, *, extrapolate: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Natural angular frequencies and mode shapes at rotor speeds.

        ω² and the mode shapes are interpolated in Ω².

        Parameters
        ----------
        speed_hz
            Hz, shape (m,).
        extrapolate
            Allow speeds outside the states' range.

        Returns
        -------
        Λ in rad/s, shape (m, n); V_b in kg^-1/2, shape (m, n, r).

        Raises
        ------
        OutOfSpeedRange
            When a speed lies outside the range of the states and `extrapolate` is not set, or the
            extrapolated ω² is not positive.
        """
        speed = np.atleast_1d(np.asarray(speed_hz, dtype=float))
        if len(self.states) == 1:
            state = self.states[0]
            shape = np.broadcast_to(state.mode_shape, (len(speed), *state.mode_shape.shape))
            omega = np.broadcast_to(2 * np.pi * state.frequency_hz, (len(speed), self.mode_count))
            return omega, shape
        low, high = self.states[0].speed_hz, self.states[-1].speed_hz
        slack = 1e-9 * high  # a speed converted from rpm must not fall off the end by rounding
        outside = (speed < low - slack) | (speed > high + slack)
        if outside.any() and not extrapolate:
            raise OutOfSpeedRange(
                f"speed_hz[{int(np.argmax(outside))}]",
                float(speed[outside][0]),
                f"blade {self.name!r} has modal data from {low:g} to {high:g} Hz: "
                "stay inside, or add a state (in Python, extrapolate=True)",
            )
        squares, shapes = self._interpolant
        omega2 = squares(speed**2)
        if (omega2 <= 0).any():
            i = int(np.argmax((omega2 <= 0).any(axis=1)))
            raise OutOfSpeedRange(
                f"speed_hz[{i}]", float(speed[i]), "the extrapolated ω² is not positive: add a state there"
            )
        return np.sqrt(omega2), shapes(speed**2)

    def at_speed(self, speed_hz: float, *, extrapolate: bool = False) -> ModalState:
        """The modal state at one rotor speed (see `at_speeds`)."""
        omega, shape = self.at_speeds(np.array([speed_hz]), extrapolate=extrapolate)
        return ModalState(float(speed_hz), omega[0] / (2 * np.pi), shape[0])

    def in_direction(self, direction: str) -> Blade:
        """The blade with its amplitudes in another direction, where every state gives them.

        ``radial`` reproduces [SBL], which keeps radial displacements only.
        """
        if direction == self.direction:
            return self
        radial = [s.mode_shape_radial for s in self.states]
        if direction != "radial" or any(shape is None for shape in radial):
            raise InvalidInput("direction", direction, "every state of the blade must give mode_shape_radial")
        states = [
            replace(s, mode_shape=shape, tip_growth_m=None)
            for s, shape in zip(self.states, radial, strict=True)
            if shape is not None
        ]
        return replace(self, states=tuple(states), direction=direction)


def _shape(name: str, values: Any, modes: int, nodes: int | None) -> np.ndarray:
    shape = matrix(name, values, nodes, -AMPLITUDE_LIMIT, AMPLITUDE_LIMIT, "kg^-1/2")
    if len(shape) != modes:
        raise InvalidInput(name, f"{len(shape)} rows", f"give one row a mode: {modes}")
    return shape


def _node_names(names: Any) -> tuple[str, ...]:
    if not isinstance(names, list | tuple) or len(names) == 0:
        raise InvalidInput("tip_nodes", names, "give a list of at least one node name")
    for i, node in enumerate(names):
        if not isinstance(node, str) or not node:
            raise InvalidInput(f"tip_nodes[{i}]", node, "give a node name")
        if node in names[:i]:
            raise InvalidInput(f"tip_nodes[{i}]", node, "give every node a name of its own")
    return tuple(names)


def _damping(values: Any, modes: int) -> np.ndarray:
    if isinstance(values, int | float | np.number):
        damping = np.full(modes, number("damping_ratio", values, 0.0, LARGEST_DAMPING, ""))
    else:
        damping = vector("damping_ratio", values, 0.0, LARGEST_DAMPING, "")
        if len(damping) != modes:
            raise InvalidInput(
                "damping_ratio", f"{len(damping)} numbers", f"give one number, or one a mode: {modes}"
            )
    return damping


def _ordered_states(states: Any, nodes: int) -> tuple[ModalState, ...]:
    if not isinstance(states, list | tuple) or len(states) == 0:
        raise InvalidInput("states", "[]", "give at least one modal state")
    modes = len(states[0].frequency_hz)
    for i, state in enumerate(states):
        if len(state.frequency_hz) != modes:
            raise InvalidInput(
                f"states[{i}].frequency_hz",
                f"{len(state.frequency_hz)} modes",
                f"give {modes}, as in states[0]",
            )
        if state.mode_shape.shape[1] != nodes:
            raise InvalidInput(
                f"states[{i}].mode_shape",
                f"{state.mode_shape.shape[1]} columns",
                f"give one a tip node: {nodes}",
            )
    in_order = sorted(states, key=lambda s: s.speed_hz)
    for before, after in pairwise(in_order):
        if after.speed_hz - before.speed_hz <= 1e-9 * after.speed_hz:
            raise InvalidInput("states", f"two at {after.speed_hz:g} Hz", "give one state a rotor speed")
    return tuple(in_order)

"""Derivatives of the critical K_e to the shape of a blade: lean, sweep, thickness, stagger, chord."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from sdm_core.blade import Blade, ModalState
from sdm_core.blade.tracking import rising_modes, tracked
from sdm_core.blade_sensitivity import critical_ke_sensitivities
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import CriticalSpeed, least_critical_ke
from sdm_core.rubbing_blade import LEAST_DAMPING, check_blade_and_contact
from sdm_core.sensitivity import Gradient
from sdm_core.validation import number

Build = Callable[[Mapping[str, float]], Blade]
Contact = ContactConfiguration | Callable[[Blade], ContactConfiguration]
Progress = Callable[[int, int], None]

# Lobes refined to find the deepest: a grid ranks them to a percent only.
_LOBES = 400
_BRACKETS = (1e-5, 1e-4, 1e-3, 5e-3)


@dataclass(frozen=True)
class ShapeSensitivity:
    """Derivative of the critical K_e to one parameter of the blade's shape.

    Attributes
    ----------
    parameter, value, step
        Name, nominal value, and the step of the differences, in the parameter's own unit.
    derivative
        dK_e/dp, N/m per unit of the parameter.
    error_estimate
        Of `derivative`, absolute: what halving the step changed.
    relative
        d ln K_e/d ln p; NaN where the parameter is 0.
    by_frequency, by_mode_shape, by_damping, by_weight
        Parts of `derivative` that come through natural frequencies, amplitudes, damping and contact weights.
    """

    parameter: str
    value: float
    step: float
    derivative: float
    error_estimate: float
    relative: float
    by_frequency: float
    by_mode_shape: float
    by_damping: float
    by_weight: float


@dataclass(frozen=True)
class ShapeSensitivities:
    """Derivatives of one critical K_e to every parameter.

    Attributes
    ----------
    ke, speed_hz, chatter_hz
        The crossing they belong to: N/m, Hz, Hz.
    tip
        The lobe's tip over the range of speeds; None where the speed was fixed.
    parameters
        One a parameter, in the order given.
    builds
        Blades built.
    """

    ke: float
    speed_hz: float
    chatter_hz: float
    tip: CriticalSpeed | None
    parameters: tuple[ShapeSensitivity, ...]
    builds: int


def shape_sensitivities(
    build: Build,
    parameters: Mapping[str, float],
    steps: Mapping[str, float],
    contact: Contact,
    speed_hz: float | tuple[float, float],
    ke_max: float,
    *,
    progress: Progress | None = None,
) -> ShapeSensitivities:
    """Derivatives of the critical K_e to the parameters from which a blade is built.

        dK_e/dp = Σ_j ∂K_e/∂ω_j dω_j/dp + Σ_jk ∂K_e/∂φ_jk dφ_jk/dp
                  + Σ_j ∂K_e/∂ξ_j dξ_j/dp + Σ_k ∂K_e/∂w_k dw_k/dp

    at constant speed: K_e's own derivatives are exact (`critical_ke_sensitivities`), those of the modal data
    are central differences of four builds a parameter, at the step and at half of it, extrapolated. The least
    K_e over a range of speeds has the same derivative, for at a lobe's tip K_e does not change with Ω to
    first order, and at an end of the range Ω stays: so the same lobe is followed, and none is searched again.

    Parameters
    ----------
    build
        Makes the blade from its parameters by name.
    parameters, steps
        Nominal values, and the largest step of each in its own unit (the difference reaches so far to both
        sides).
    contact
        The contact, or a function that makes it from a blade, e.g. `lambda b: chord_weights(b).contact()`:
        then weights move with the shape.
    speed_hz
        One rotor speed, or a range (low, high), Hz.
    ke_max
        Largest K_e looked at, N/m.
    progress
        Called with blades built and their number.

    Raises
    ------
    InvalidInput
        For a step that is missing or not above 0, no crossing below `ke_max`, or blades whose modes or tip
        nodes do not match.
    ModesNotTracked
        When a step changes modes so much that they cannot be paired: make it smaller.
    """
    for name in parameters:
        if name not in steps:
            raise InvalidInput(f"steps.{name}", "missing", "give a step for every parameter")
        number(f"parameters.{name}", parameters[name], -1e12, 1e12, "")
        number(f"steps.{name}", steps[name], 0.0, 1e12, "", open_low=True)
    total = 1 + 4 * len(parameters)
    blade = build(dict(parameters))
    if progress is not None:
        progress(1, total)
    there = contact if isinstance(contact, ContactConfiguration) else contact(blade)
    check_blade_and_contact(blade, there)
    speed, tip = _speed(blade, there, speed_hz, ke_max)
    found = critical_ke_sensitivities(blade, there, speed, ke_max)
    here = _Modal.of(blade, there, speed)
    rows: list[ShapeSensitivity] = []
    for name, value in parameters.items():
        moved = []
        for share in (1.0, -1.0, 0.5, -0.5):
            other = build({**parameters, name: value + share * steps[name]})
            weights = contact if isinstance(contact, ContactConfiguration) else contact(other)
            moved.append(here.matched(_Modal.of(other, weights, speed), name))
            if progress is not None:
                progress(1 + 4 * len(rows) + len(moved), total)
        whole, half = (
            here.parts(found.gradient, plus, minus, reach)
            for (plus, minus), reach in zip(
                (moved[:2], moved[2:]), (steps[name], 0.5 * steps[name]), strict=True
            )
        )
        # Differences are even in the step: a third of what halving changes is what is left.
        parts = half + (half - whole) / 3
        derivative = float(parts.sum())
        rows.append(
            ShapeSensitivity(
                name,
                float(value),
                float(steps[name]),
                derivative,
                float(abs((half - whole).sum()) / 3),
                float(value) * derivative / found.value if value else float("nan"),
                *parts.tolist(),
            )
        )
    return ShapeSensitivities(found.value, speed, found.chatter_hz, tip, tuple(rows), total)


def _speed(
    blade: Blade, contact: ContactConfiguration, speed_hz: float | tuple[float, float], ke_max: float
) -> tuple[float, CriticalSpeed | None]:
    if not isinstance(speed_hz, tuple | list):
        return float(speed_hz), None
    tips = least_critical_ke(blade, contact, *speed_hz, ke_max, count=_LOBES, tolerance=1e-7)
    if not tips:
        raise InvalidInput(
            "ke_max", ke_max, f"raise it: nothing destabilises the blade up to there from {speed_hz[0]:g} to "
            f"{speed_hz[1]:g} Hz"
        )  # fmt: skip
    return _at_tip(blade, contact, tips[0].speed_hz, speed_hz, ke_max), tips[0]


def _at_tip(
    blade: Blade,
    contact: ContactConfiguration,
    near_hz: float,
    speed_range_hz: tuple[float, float],
    ke_max: float,
) -> float:
    """The speed at which dK_e/dΩ = 0, where a search in K_e itself only comes to the root of its tolerance.

    A lobe that is deepest at an end of the range has no such speed there, and is left where it is.
    """

    def slope(speed: float) -> float:
        found = critical_ke_sensitivities(blade, contact, speed, 1.1 * ke_max)
        return next(row.derivative for row in found.influences if row.parameter == "rotor speed")

    low, high = speed_range_hz
    for reach in _BRACKETS:
        a, b = max(near_hz * (1 - reach), low), min(near_hz * (1 + reach), high)
        if slope(a) < 0 < slope(b):
            return float(brentq(slope, a, b, xtol=1e-13 * near_hz, rtol=1e-13))
    return near_hz


@dataclass(frozen=True)
class _Modal:
    """Modal data of one build at the speed of the crossing, in the order of the nominal blade."""

    state: ModalState
    damping: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, blade: Blade, contact: ContactConfiguration, speed_hz: float) -> _Modal:
        weight = contact.weight_vector(blade.tip_nodes)
        return cls(blade.at_speed(speed_hz), np.maximum(blade.damping_ratio, LEAST_DAMPING), weight)

    def matched(self, other: _Modal, parameter: str) -> _Modal:
        """The other build with its modes paired with these, signs aligned."""
        shapes = self.state.mode_shape.shape, other.state.mode_shape.shape
        if shapes[0] != shapes[1]:
            raise InvalidInput(
                f"steps.{parameter}",
                f"{shapes[1][0]} modes at {shapes[1][1]} nodes",
                f"every build must give {shapes[0][0]} modes at {shapes[0][1]} tip nodes",
            )
        # Both at one speed: set apart, for a blade's states are told apart by speed.
        apart = ModalState(2 * self.state.speed_hz, other.state.frequency_hz, other.state.mode_shape)
        theirs = tracked((self.state, apart))[1]
        # From rising frequencies back to the order of the nominal blade.
        back = np.argsort(rising_modes(self.state))
        ordered = theirs.reordered(back, np.ones(len(back)))
        place = [int(np.argmin(np.abs(other.state.frequency_hz - f))) for f in ordered.frequency_hz]
        return _Modal(ordered, other.damping[place], other.weight)

    def parts(self, gradient: Gradient, plus: _Modal, minus: _Modal, reach: float) -> np.ndarray:
        """dK_e/dp by frequencies, mode shapes, damping and weights, from builds at ± `reach`."""
        omega, shape, damping, weight = (
            (a - b) / (2 * reach)
            for a, b in (
                (2 * np.pi * plus.state.frequency_hz, 2 * np.pi * minus.state.frequency_hz),
                (plus.state.mode_shape, minus.state.mode_shape),
                (plus.damping, minus.damping),
                (plus.weight, minus.weight),
            )
        )
        by_shape = gradient.mode_shape(self.state.mode_shape, self.weight)
        by_weight = gradient.weights(self.state.mode_shape)
        return np.array(
            [
                gradient.omega @ omega,
                (by_shape * shape).sum(),
                gradient.damping_ratio @ damping,
                by_weight @ weight,
            ]
        )

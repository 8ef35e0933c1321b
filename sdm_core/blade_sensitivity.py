"""What moves growth and critical K_e of a blade most: their derivatives, parameter by parameter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from sdm_core.crossings import Crossings
from sdm_core.errors import InvalidInput
from sdm_core.floquet.arc_boundary import arc_crossings, boundaries_with_arcs
from sdm_core.interruption import checkpoint
from sdm_core.permanent_contact.permanent_boundary import permanent_crossings
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.sensitivity import Gradient, critical_ke_sensitivity, multiplier_sensitivity
from sdm_core.stability import stability
from sdm_core.validation import KE_LIMIT, number


@dataclass(frozen=True)
class Influence:
    """How one parameter of a blade moves growth or critical K_e.

    Attributes
    ----------
    parameter, unit
        In words, e.g. ``frequency of mode 1`` and ``Hz``.
    value
        Of the parameter.
    derivative
        Of the quantity, per unit.
    relative
        d ln K_e/d ln p of a critical K_e, d ln|μ|/d ln p of growth; for the edge of an arc per revolution.
    """

    parameter: str
    unit: str
    value: float
    derivative: float
    relative: float


@dataclass(frozen=True)
class BladeSensitivity:
    """Growth per revolution or critical K_e of a blade, and its derivatives.

    Attributes
    ----------
    value, error_estimate
        ln|μ|, or K_e in N/m; relative error of |μ| or K_e, infinite where not proven.
    multiplier, chatter_hz
        μ, and the chatter frequency, Hz.
    gradient
        Derivatives with respect to the modal data at this rotor speed, in SI units.
    influences
        Parameter by parameter in the user's units, mode shapes and weights included. The speed comes
        twice: the modal data moving with it as the blade's states say, and frozen.
    condition, simple
        As in `MultiplierSensitivity`.
    """

    value: float
    error_estimate: float
    multiplier: complex
    chatter_hz: float
    gradient: Gradient
    influences: tuple[Influence, ...]
    condition: float
    simple: bool


def growth_sensitivities(
    blade: Blade, contact: ContactConfiguration, speed_hz: float, ke: float, *, extrapolate: bool = False
) -> BladeSensitivity:
    """Growth per revolution ln|μ| of the dominant multiplier, and its derivatives.

    Raises
    ------
    InvalidInput
        For unusable input, or where contact is so strong that no multiplier was found.
    """
    problem = RubbingBlade.from_blade(blade, contact, speed_hz, ke, extrapolate=extrapolate)
    solution = stability(problem)
    found = multiplier_sensitivity(problem, solution.multiplier)
    growth = found.growth
    rows = influences_of(problem, blade, contact, growth, 1.0)
    moved = float(growth.ke)
    rows.append(Influence("cutting stiffness", "N/m", problem.ke, moved, problem.ke * moved))
    return BladeSensitivity(
        solution.growth_per_revolution,
        solution.error_estimate,
        found.multiplier,
        solution.chatter_hz,
        growth,
        tuple(rows),
        found.condition,
        found.simple,
    )


def critical_ke_sensitivities(
    blade: Blade, contact: ContactConfiguration, speed_hz: float, ke_max: float, *, extrapolate: bool = False
) -> BladeSensitivity:
    """First critical K_e at one rotor speed, and its derivatives.

    Raises
    ------
    InvalidInput
        For unusable input, or when there is no crossing up to `ke_max`.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> found = critical_ke_sensitivities(
    ...     example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), 250.0, 1e5
    ... )
    >>> max(found.influences, key=lambda influence: abs(influence.relative)).parameter
    'frequency of mode 4'
    """
    number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    problem = RubbingBlade.from_blade(blade, contact, speed_hz, 0.0, extrapolate=extrapolate)
    crossing = (
        permanent_crossings([problem], ke_max)[0] if problem.permanent else arc_crossings(problem, ke_max)
    )
    if len(crossing.ke) == 0:
        raise InvalidInput("ke_max", ke_max, f"raise it: no crossing up to there at {speed_hz:g} Hz")
    return _at_first(crossing, problem, blade, contact)


def boundary_sensitivities(
    blade: Blade,
    contact: ContactConfiguration,
    speed_hz: np.ndarray,
    ke_max: float,
    *,
    extrapolate: bool = False,
) -> list[BladeSensitivity]:
    """First critical K_e at each of many rotor speeds, and its derivatives.

    No crossing up to `ke_max` is a value of NaN with an error of 0, or infinite where that is not proven.
    Derivatives are NaN there, and where they cannot be had: at a double multiplier, or in too strong a
    contact. `simple` says so.

    Parameters
    ----------
    speed_hz
        Hz, shape (m,).
    ke_max
        N/m.

    Raises
    ------
    InvalidInput
        For unusable input, smooth engagement included.
    """
    check_differentiable(contact)
    number("ke_max", ke_max, 0.0, KE_LIMIT, "N/m", open_low=True)
    problems = RubbingBlade.at_speeds(blade, contact, speed_hz, extrapolate=extrapolate)
    crossings = (
        permanent_crossings(problems, ke_max) if contact.permanent else boundaries_with_arcs(problems, ke_max)
    )
    out = []
    for problem, crossing in zip(problems, crossings, strict=True):
        checkpoint()
        try:
            found = _at_first(crossing, problem, blade, contact) if len(crossing.ke) else None
        except InvalidInput:  # not about what was given, which has been checked
            found = None
        out.append(found or _without_derivatives(crossing, problem, blade, contact))
    return out


def check_differentiable(contact: ContactConfiguration) -> None:
    """Raise `InvalidInput` where engagement is smooth, for which there are no derivatives."""
    if contact.smooth:
        raise InvalidInput(
            "contact.engagement", "smooth", "give arcs, or neither: derivatives need constant γ"
        )


def _at_first(
    crossing: Crossings, problem: RubbingBlade, blade: Blade, contact: ContactConfiguration
) -> BladeSensitivity:
    problem, chatter_hz = problem.with_ke(float(crossing.ke[0])), float(crossing.frequency_hz[0])
    found = critical_ke_sensitivity(problem, np.exp(2j * np.pi * chatter_hz / problem.speed_hz))
    return BladeSensitivity(
        found.ke,
        _error_of(crossing),
        found.multiplier,
        chatter_hz,
        found.critical_ke,
        tuple(influences_of(problem, blade, contact, found.critical_ke, found.ke)),
        found.condition,
        found.simple,
    )


def _without_derivatives(
    crossing: Crossings, problem: RubbingBlade, blade: Blade, contact: ContactConfiguration
) -> BladeSensitivity:
    there = len(crossing.ke) > 0
    ke, chatter_hz = (crossing.ke[0], crossing.frequency_hz[0]) if there else (np.nan, np.nan)
    nothing = Gradient.unknown(problem)
    rows = tuple(influences_of(problem, blade, contact, nothing, np.nan))
    multiplier = complex(np.exp(2j * np.pi * chatter_hz / problem.speed_hz))
    error = _error_of(crossing)
    return BladeSensitivity(float(ke), error, multiplier, float(chatter_hz), nothing, rows, np.inf, False)


def _error_of(crossing: Crossings) -> float:
    if not crossing.proven:
        return np.inf
    return float(crossing.error_estimate[0]) if len(crossing.ke) else 0.0


def influences_of(
    problem: RubbingBlade, blade: Blade, contact: ContactConfiguration, gradient: Gradient, scale: float
) -> list[Influence]:
    """A gradient parameter by parameter in the user's units.

    Parameters
    ----------
    problem
        The blade in contact at a rotor speed; its K_e is not used.
    gradient
        Of growth or of critical K_e, with respect to `problem`.
    scale
        What relative changes are relative to: K_e, or 1.
    """
    speed, omega, frozen = problem.speed_hz, problem.omega, float(gradient.speed_hz)
    shape = blade.at_speeds(np.array([speed]), extrapolate=True)[1][0]
    weight = contact.weight_vector(blade.tip_nodes)
    by_shape, by_weight = gradient.mode_shape(shape, weight), gradient.weights(shape)
    omega_rate, shape_rate = _modal_rates(blade, speed)
    total = frozen + gradient.omega @ omega_rate + (by_shape * shape_rate).sum()
    rows: list[Influence] = []

    def add(parameter: str, unit: str, value: float, derivative: float, reference: float) -> None:
        relative = float(reference * derivative / scale)
        rows.append(Influence(parameter, unit, float(value), float(derivative), relative))

    for j in range(len(omega)):
        hertz = omega[j] / (2 * np.pi)
        add(f"frequency of mode {j + 1}", "Hz", hertz, 2 * np.pi * gradient.omega[j], hertz)
        xi = problem.damping_ratio[j]
        add(f"damping of mode {j + 1}", "", xi, gradient.damping_ratio[j], xi)
        for k, node in enumerate(blade.tip_nodes):
            a = shape[j, k]
            add(f"amplitude of mode {j + 1} at {node}", "kg^-1/2", a, by_shape[j, k], a)
    for k, node in enumerate(blade.tip_nodes):
        add(f"weight of {node}", "", weight[k], by_weight[k], weight[k])
    add("rotor speed", "Hz", speed, total, speed)
    add("rotor speed, modal data frozen", "Hz", speed, frozen, speed)
    for i, (arc, by_arc) in enumerate(zip(problem.arcs or (), gradient.arcs, strict=True)):
        for edge, at, by in zip(("start", "end"), arc, by_arc, strict=True):
            add(f"{edge} of arc {i + 1}", "revolutions", at, by, 1.0)
    return rows


def _modal_rates(blade: Blade, speed_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """dΛ/dΩ, rad/s per Hz, shape (n,), and dV_b/dΩ, kg^-1/2 per Hz, shape (n, r).

    The interpolants are cubic in Ω², for which four points are exact between the states.
    """
    if len(blade.states) == 1:
        return np.zeros(blade.mode_count), np.zeros((blade.mode_count, len(blade.tip_nodes)))
    h = 1e-4 * speed_hz**2
    omega, shape = blade.at_speeds(np.sqrt(speed_hz**2 + h * np.array([-2, -1, 1, 2])), extrapolate=True)
    stencil = 2 * speed_hz * np.array([1.0, -8.0, 8.0, -1.0]) / (12 * h)
    here = blade.at_speeds(np.array([speed_hz]), extrapolate=True)[0][0]
    return stencil @ omega**2 / (2 * here), np.tensordot(stencil, shape, axes=1)

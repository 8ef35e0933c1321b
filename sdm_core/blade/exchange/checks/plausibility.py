"""Figures no blade has, with their likely cause: mixed or undeclared units."""

from __future__ import annotations

import math

import numpy as np

from sdm_core.blade.exchange.checks.findings import Finding, warning
from sdm_core.blade.matrix_model import MatrixModel

# From fan blades of large engines to compressor blades of a few centimetres, with room.
FREQUENCIES_HZ = (15.0, 20_000.0)
TYPICAL_HZ = 600.0
MASSES_KG = (1e-3, 200.0)
RADII_M = (5e-3, 5.0)
LARGEST_TIP_SPEED = 900.0
# K in N/mm with M in kg, or K in N/m with M in t: frequencies are off by the root of a thousand.
MIXED = math.sqrt(1000.0)


def suspicious_frequency(first_hz: float, mass_kg: float) -> list[Finding]:
    """A first frequency outside what blades have."""
    low, high = FREQUENCIES_HZ
    if low <= first_hz <= high:
        return []
    causes = {
        MIXED: "stiffness in N/mm with mass in kg",
        1 / MIXED: "stiffness in N/m with mass in t",
        MIXED**2: "stiffness off by 1e6, as with a modulus in MPa in a model in metres",
        MIXED**-2: "stiffness off by 1e6, as with a modulus in Pa in a model in millimetres",
    }
    nearest = min(causes, key=lambda factor: abs(math.log(first_hz * factor / TYPICAL_HZ)))
    if low <= first_hz * nearest <= high:
        remedy = f"K and M look like different unit systems ({causes[nearest]}): export both in one"
    else:
        remedy = "check units, material and clamping"
    return [
        warning("states[0].frequency_hz", f"first frequency {first_hz:.4g} Hz, mass {mass_kg:.3g} kg", remedy)
    ]


def suspicious_mass(mass_kg: float, units: str) -> list[Finding]:
    """A mass outside what blades have."""
    low, high = MASSES_KG
    if mass_kg <= 0 or low <= mass_kg <= high:
        return []
    if mass_kg < low and units == "SI":
        remedy = (
            f'a blade of {mass_kg * 1e3:.3g} kg in tonnes? then give units="mm-t-s"; '
            "else check the density, or most of the mass is in modal coordinates"
        )
    elif mass_kg > high and units != "SI":
        remedy = 'the file looks like SI already: give units="SI"'
    else:
        remedy = "check units and density"
    return [warning("mass", f"{mass_kg:.3g} kg", remedy)]


def suspicious_places(model: MatrixModel, units: str) -> list[Finding]:
    """Nodes too far from the axis, and tip speeds no rotor stands."""
    if not model.node_position_m:
        return []
    axis = np.array(model.rotation_axis)
    place = np.array(list(model.node_position_m.values()))
    radius = float(np.linalg.norm(place - np.outer(place @ axis, axis), axis=1).max())
    found = []
    low, high = RADII_M
    if radius > high:
        found.append(
            warning(
                "node_position_m",
                f"the outermost node is {radius:.4g} m from the axis",
                'lengths in millimetres? then give units="mm-t-s"'
                if units == "SI"
                else "check places and axis",
            )
        )
    elif radius < low:
        found.append(
            warning(
                "node_position_m",
                f"the outermost node is {radius:.4g} m from the axis",
                'lengths in metres? then give units="SI"' if units != "SI" else "check places and axis",
            )
        )
    fastest = model.states[-1].speed_hz
    tip_speed = 2 * math.pi * fastest * radius
    if low <= radius <= high and tip_speed > LARGEST_TIP_SPEED:
        found.append(
            warning(
                f"states[{len(model.states) - 1}].speed_hz",
                f"{fastest:g} Hz gives {tip_speed:.0f} m/s at the tip",
                "speeds are in revolutions per second: divide rpm by 60",
            )
        )
    return found

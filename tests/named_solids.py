"""Solids with known vibration, for the tests of the finite elements."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from sdm_core.blade.finite_elements import Material
from sdm_core.blade.profile import BladeProfile, ParametricBlade
from sdm_core.blade.solid_mesh import Shape, Subdivision

# NASA TP 1659 / AGARD-AR-355; beside the repository where it is to be had, not part of it.
ROTOR_37 = Path(__file__).parents[2] / "shared" / "data" / "nasa_rotor_37_sections.csv"
ROTOR_37_DESIGN_HZ = 17_188.7 / 60.0

needs_sections = pytest.mark.skipif(not ROTOR_37.exists(), reason="the sections of rotor 37 are not here")
# Under continuous integration what is missing is a failure.
needs_calculix = pytest.mark.skipif(
    shutil.which("ccx") is None and not os.environ.get("CI"), reason="CalculiX (ccx) is not installed"
)


def block(length: float, width: float, height: float) -> Shape:
    """A block clamped at x = 0: span along x, chord along y, thickness along z."""

    def shape(s: np.ndarray, h: np.ndarray, t: np.ndarray) -> np.ndarray:
        y, x, z = np.meshgrid((s - 0.5) * width, h * length, 0.5 * height * t, indexing="ij")
        return np.stack((x, y, z), axis=-1)

    return shape


STEEL_WITHOUT_POISSON = Material(2e11, 0.0, 7800.0)


def coarse_blade(name: str = "coarse", **changes) -> BladeProfile:
    """A transonic blade of the parametric family on a mesh of 775 nodes."""
    shape = {
        "span_m": 0.08,
        "hub_radius_m": 0.2,
        "chord_m": 0.04,
        "thickness_ratio": (0.1, 0.05),
        "stagger_deg": (20.0, 50.0),
        "camber_deg": 30.0,
        "casing_slope": -0.1,
    }
    return BladeProfile(name, ParametricBlade(**(shape | changes)), 250.0, subdivision=Subdivision(8, 12, 1))

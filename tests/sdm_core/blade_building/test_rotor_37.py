"""NASA rotor 37 from its sections, against an independent finite-element model and against CalculiX."""

from __future__ import annotations

import re
import subprocess

import numpy as np
import pytest
from named_solids import ROTOR_37, ROTOR_37_DESIGN_HZ, coarse_blade, needs_calculix, needs_sections

from sdm_core.blade.build import build_blade
from sdm_core.blade.finite_elements import TITANIUM, SolidModel, equilibrium
from sdm_core.blade.finite_elements.calculix_deck import calculix_deck
from sdm_core.blade.matrix_model import lowest_modes
from sdm_core.blade.profile import BladeProfile, read_sections
from sdm_core.blade.solid_mesh import SolidMesh, Subdivision

# DESIGN, known answers of issue 4: titanium, root clamped, at rest and at 17,189 rpm.
AT_REST_HZ = (906.0, 2563.0, 3270.0, 4941.0, 6051.0)
AT_SPEED_HZ = (1134.6, 2608.0, 3519.0, 5006.0, 6153.0)


@pytest.fixture(scope="module")
def rotor_37() -> SolidModel:
    solid = read_sections(ROTOR_37).solid(0.008)
    return SolidModel(SolidMesh.of(solid.positions, Subdivision(16, 22, 2)), TITANIUM)


@needs_sections
@pytest.mark.parametrize(("speed_hz", "known"), [(0.0, AT_REST_HZ), (17_189 / 60, AT_SPEED_HZ)])
def test_rotor_37_has_its_known_frequencies(rotor_37, speed_hz, known):
    at_speed = equilibrium(rotor_37, speed_hz)
    omega2, _ = lowest_modes(at_speed.stiffness, rotor_37.mass, 5)
    assert np.sqrt(omega2) / (2 * np.pi) == pytest.approx(known, rel=1e-2)


@needs_sections
def test_rotor_37_weighs_what_its_blade_file_says(rotor_37):
    assert rotor_37.total_mass_kg == pytest.approx(0.0346309, rel=1e-4)


@needs_sections
def test_rotor_37_opens_and_grows_towards_the_casing_at_speed():
    sections = read_sections(ROTOR_37)
    build = build_blade(
        BladeProfile("rotor 37", sections, ROTOR_37_DESIGN_HZ, subdivision=Subdivision(8, 12, 1)),
        verify=False,
    )
    rest, _, fast = build.blade.states
    assert rest.untwist_rad == 0.0
    assert 0.5 < np.degrees(fast.untwist_rad) < 1.2
    assert fast.tip_growth_m.mean() > 20e-6


@needs_calculix
@pytest.mark.parametrize("speed_hz", [0.0, 250.0])
def test_calculix_finds_the_same_frequencies_on_the_same_mesh(tmp_path, speed_hz):
    profile = coarse_blade()
    mesh = SolidMesh.of(profile.sections().solid(profile.cut).positions, profile.subdivision)
    _agrees_with_calculix(SolidModel(mesh, profile.material), speed_hz, tmp_path)


@needs_calculix
@needs_sections
@pytest.mark.parametrize("speed_hz", [0.0, 17_189 / 60])
def test_calculix_finds_the_same_frequencies_of_rotor_37(rotor_37, tmp_path, speed_hz):
    _agrees_with_calculix(rotor_37, speed_hz, tmp_path)


def _agrees_with_calculix(model: SolidModel, speed_hz: float, folder) -> None:
    (folder / "blade.inp").write_text(calculix_deck(model, speed_hz))
    subprocess.run(["ccx", "blade"], cwd=folder, check=True, capture_output=True, timeout=300)
    rows = re.findall(r"^ +\d+((?: +-?\d\.\d+E[+-]\d+){4})$", (folder / "blade.dat").read_text(), re.M)
    theirs = [float(row.split()[2]) for row in rows[:5]]
    omega2, _ = lowest_modes(equilibrium(model, speed_hz).stiffness, model.mass, 5)
    assert np.sqrt(omega2) / (2 * np.pi) == pytest.approx(theirs, rel=5e-4)

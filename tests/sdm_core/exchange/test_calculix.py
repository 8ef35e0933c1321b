"""Matrices that CalculiX itself wrote; these tests run where it is installed."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from sdm_core.blade.exchange import read_matrix_model

pytestmark = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")

SPEED_HZ = 200.0
STORED = ", SOLVER=MATRIXSTORAGE"


def beam_deck(*, speed_hz: float, stored: bool, metres: float = 1.0) -> str:
    """Four quadratic bricks along x, clamped at the inner end, turning about z."""
    number: dict[tuple[int, int, int], int] = {}

    def node(*place: int) -> int:
        return number.setdefault(place, len(number) + 1)

    elements = []
    for e in range(4):
        b = 2 * e
        corners = [(b, 0), (b + 2, 0), (b + 2, 2), (b, 2)]
        middles = [(b + 1, 0), (b + 2, 1), (b + 1, 2), (b, 1)]
        elements.append(
            [node(i, j, 0) for i, j in corners]
            + [node(i, j, 2) for i, j in corners]
            + [node(i, j, 0) for i, j in middles]
            + [node(i, j, 2) for i, j in middles]
            + [node(i, j, 1) for i, j in corners]
        )
    at = {n: (0.1 + 0.02 * i / 2, 0.01 * j / 2, 0.003 * k / 2) for (i, j, k), n in number.items()}
    root = [n for (i, _, _), n in number.items() if i == 0]
    newton_per_area, density = (108e9, 4400.0) if metres == 1.0 else (108e3, 4.4e-9)
    lines = ["*NODE, NSET=NALL"]
    lines += [f"{n}, {x / metres!r}, {y / metres!r}, {z / metres!r}" for n, (x, y, z) in at.items()]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=EALL")
    for e, nodes in enumerate(elements, 1):
        lines += [
            ", ".join(map(str, [e, *nodes[:10]])) + ",",
            ", ".join(map(str, nodes[10:])),
        ]
    lines += ["*NSET, NSET=ROOT", *(f"{n}," for n in root)]
    lines += ["*MATERIAL, NAME=TI", "*ELASTIC", f"{newton_per_area}, 0.34", "*DENSITY", f"{density}"]
    lines += ["*SOLID SECTION, ELSET=EALL, MATERIAL=TI", "*BOUNDARY", "ROOT, 1, 3"]
    if speed_hz:
        omega2 = (2 * np.pi * speed_hz) ** 2
        lines += ["*STEP, NLGEOM", "*STATIC", "*DLOAD"]
        lines += [f"EALL, CENTRIF, {omega2!r}, 0., 0., 0., 0., 0., 1.", "*END STEP"]
    step = "*STEP, PERTURBATION" if speed_hz else "*STEP"
    return "\n".join([*lines, step, "*FREQUENCY" + (STORED if stored else ""), "5", "*END STEP", ""])


def job(folder: Path, name: str, **settings) -> Path:
    """Run a job; its stiffness, or its printed frequencies."""
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.inp").write_text(beam_deck(**settings), encoding="ascii")
    subprocess.run(["ccx", name], cwd=folder, check=True, capture_output=True, timeout=120)
    return folder / f"{name}.{'sti' if settings['stored'] else 'dat'}"


def printed_frequencies(dat: Path) -> np.ndarray:
    """The last table of eigenvalues, Hz."""
    rows = re.findall(r"^\s+\d+\s+\S+\s+\S+\s+(\S+)\s+\S+\s*$", dat.read_text(), re.MULTILINE)
    return np.array([float(x) for x in rows[-5:]])


@pytest.mark.parametrize("speed_hz", [0.0, SPEED_HZ])
def test_modes_of_the_stored_matrices_are_those_calculix_prints(speed_hz, tmp_path):
    stiffness = job(tmp_path, "stored", speed_hz=speed_hz, stored=True)
    printed = printed_frequencies(job(tmp_path, "printed", speed_hz=speed_hz, stored=False))
    found = read_matrix_model(stiffness, stiffness={speed_hz: "stored.sti"}, rotation_axis=(0, 0, 1))
    model = found.model
    omega2, _ = model.modes(model.states[0], 5)
    assert np.sqrt(omega2) / (2 * np.pi) == pytest.approx(printed, rel=1e-6)
    # One file brought the others of the job, with the places of all nodes.
    assert "stored.dof" in found.findings.items[0].what
    assert len(model.node_position_m) == 56


def test_rest_and_speed_make_one_blade_that_stiffens(tmp_path):
    rest = job(tmp_path, "rest", speed_hz=0.0, stored=True)
    run = job(tmp_path, "run", speed_hz=SPEED_HZ, stored=True)
    files = [rest, rest.with_suffix(".mas"), rest.with_suffix(".dof"), rest.with_suffix(".inp"), run]
    found = read_matrix_model(
        files, stiffness={SPEED_HZ: "run.sti", 0.0: "rest.sti"}, rotation_axis=(0, 0, 1), tip_nodes=[53]
    )
    assert not found.findings.warnings
    model = found.model
    rest_omega2, run_omega2 = (model.modes(state, 2)[0] for state in model.states)
    flap, edge = (run_omega2 - rest_omega2) / (2 * np.pi * SPEED_HZ) ** 2
    # Southwell and Gough: a uniform beam flapping, hub radius over length 1.25; in the plane of rotation
    # spin softening takes away 1.
    assert flap == pytest.approx(1.193 + 1.574 * 1.25, rel=0.03)
    assert flap - edge == pytest.approx(1.0, abs=0.03)


def test_a_model_in_millimetres_and_tonnes_is_the_same_blade(tmp_path):
    metres = job(tmp_path / "m", "beam", speed_hz=SPEED_HZ, stored=True)
    millimetres = job(tmp_path / "mm", "beam", speed_hz=SPEED_HZ, stored=True, metres=1e-3)
    axis = {"rotation_axis": (0, 0, 1)}
    si = read_matrix_model(metres, **axis).model
    converted = read_matrix_model(millimetres, units="mm-t-s", **axis)
    scale = abs(si.states[0].stiffness).max()
    assert abs(converted.model.states[0].stiffness - si.states[0].stiffness).max() < 1e-9 * scale
    assert abs(converted.model.mass - si.mass).max() < 1e-12 * abs(si.mass).max() + 1e-20
    assert converted.findings.figures["mass_moved_kg"][0] == pytest.approx(0.01, rel=0.2)
    untold = read_matrix_model(millimetres, **axis).findings.warnings
    assert any('units="mm-t-s"' in warning.remedy for warning in untold)

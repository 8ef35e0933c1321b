"""Rows without mass are condensed exactly where they are internal, and refused where mass must be."""

from __future__ import annotations

import os
import shutil
import subprocess

import numpy as np
import pytest
from scipy import linalg

from sdm_core.blade.exchange import read_matrix_model, write_model
from sdm_core.blade.exchange.condensation import condensed, rows_without_mass
from sdm_core.blade.matrix_model import DofMap, MatrixModel, SpeedState
from sdm_core.errors import InvalidInput

# A block of incompatible-mode elements: CalculiX keeps their internal modes as rows, which leaves directions
# without mass.
_NODES = [(x, y, z) for z in range(5) for y in range(2) for x in range(2)]
_DECK = """*NODE, NSET=NALL
{nodes}
*ELEMENT, TYPE=C3D8I, ELSET=EALL
{elements}
*BOUNDARY
1, 1, 3
2, 1, 3
3, 1, 3
4, 1, 3
*MATERIAL, NAME=M
*ELASTIC
108E9, 0.34
*DENSITY
4400.
*SOLID SECTION, ELSET=EALL, MATERIAL=M
*STEP
*FREQUENCY{storage}
5
*END STEP
"""


def test_condensation_leaves_the_frequencies_as_they_are():
    rng = np.random.default_rng(1)
    root = rng.standard_normal((12, 12))
    k, m = root @ root.T + 12 * np.eye(12), np.diag(np.r_[np.ones(8), np.zeros(4)])
    out = rows_without_mass(m)
    assert out.tolist() == [False] * 8 + [True] * 4
    omega2 = linalg.eigvalsh(condensed(k, out), np.eye(8))
    # The same pencil without condensation, its infinite eigenvalues left out.
    both = 1.0 / linalg.eigvalsh(m, k)[4:][::-1]
    assert omega2 == pytest.approx(both, rel=1e-9)


@pytest.mark.skipif(
    shutil.which("ccx") is None and not os.environ.get("CI"), reason="CalculiX (ccx) is not installed"
)
def test_incompatible_modes_of_calculix_give_its_own_frequencies(tmp_path):
    nodes = "\n".join(
        f"{i}, {0.02 * x + 0.1}, {0.01 * y}, {0.03 * z}" for i, (x, y, z) in enumerate(_NODES, 1)
    )
    elements = "\n".join(
        f"{e + 1}, " + ", ".join(str(4 * e + n) for n in (1, 2, 4, 3, 5, 6, 8, 7)) for e in range(4)
    )
    for name, storage in (("plain", ""), ("job", ", SOLVER=MATRIXSTORAGE")):
        deck = _DECK.format(nodes=nodes, elements=elements, storage=storage)
        (tmp_path / f"{name}.inp").write_text(deck)
        subprocess.run(["ccx", name], cwd=tmp_path, capture_output=True, timeout=60)
    lines = (tmp_path / "plain.dat").read_text().splitlines()
    theirs = [
        float(line.split()[3]) for line in lines if len(line.split()) == 5 and line.split()[0].isdigit()
    ]
    read = read_matrix_model(tmp_path / "job.sti")
    omega2, _ = read.model.modes(read.model.states[0], 5)
    assert np.sqrt(omega2) / (2 * np.pi) == pytest.approx(theirs[:5], rel=1e-5)


def _with_rotations(massless: int) -> MatrixModel:
    """Two nodes with displacements; neither the two rotations of the second nor the row named have mass."""
    root = np.random.default_rng(2).standard_normal((8, 8))
    stiffness = 1e6 * (root @ root.T + 8 * np.eye(8))
    mass = np.diag([0.01] * 6 + [0.0, 0.0])
    mass[massless, massless] = 0.0
    dofs = DofMap(np.array([1, 1, 1, 2, 2, 2, 2, 2]), np.array([1, 2, 3, 1, 2, 3, 4, 5]))
    places = {1: (0.2, 0.0, 0.0), 2: (0.2, 0.0, 0.03)}
    return MatrixModel("two nodes", dofs, mass, (SpeedState(0.0, stiffness),), places)


def test_rotations_without_mass_are_condensed_on_import_and_said(tmp_path):
    model = _with_rotations(massless=6)
    read = read_matrix_model(write_model(model, tmp_path / "m.npz").paths)
    assert len(read.model.dofs) == 6
    assert any("2 rows without mass condensed" in str(item) for item in read.findings.items)
    found, _ = read.model.modes(read.model.states[0], 6)
    exact = 1.0 / linalg.eigvalsh(model.mass, model.states[0].stiffness)[2:][::-1]
    assert found == pytest.approx(exact, rel=1e-9)


def test_a_displacement_without_mass_is_no_internal_row(tmp_path):
    paths = write_model(_with_rotations(massless=3), tmp_path / "m.npz").paths
    with pytest.raises(InvalidInput, match="every row needs mass"):
        read_matrix_model(paths)

"""Files with bytes flipped at random are refused, or still make a model that passed every check."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import issparse

from sdm_core.blade.exchange import export_blade, read_matrix_model, read_modal, write_model
from sdm_core.blade.exchange.content import arrays_of_model
from sdm_core.errors import InvalidInput

TRIALS = 60
MODELS = {
    "op4": ".op4",
    "op4-ascii": ".op4",
    "dmig": ".bdf",
    "mat": ".mat",
    "mat-v6": ".mat",
    "mat7.3": ".mat",
    "mtx": ".mtx",
    "calculix": ".sti",
    "csv": ".csv",
    "npz": ".npz",
}
BLADES = {"json": ".json", "npz": ".npz", "mat": ".mat", "mat7.3": ".mat", "csv": ".csv", "uff": ".unv"}


def damaged(data: bytes, how: int, random: np.random.Generator) -> bytes:
    """Cut off, single bits turned, bytes replaced anywhere or near the start, a stretch lost or doubled."""
    out = bytearray(data)
    count = int(random.integers(1, 6))
    if how == 0:
        return bytes(out[: random.integers(len(out))])
    if how == 1:
        for at in random.integers(len(out), size=count):
            out[at] ^= 1 << int(random.integers(8))
    elif how in (2, 3):
        for at in random.integers(len(out) if how == 2 else min(len(out), 600), size=count):
            out[at] = random.integers(256)
    else:
        start = int(random.integers(len(out)))
        stop = min(len(out), start + int(random.integers(1, 200)))
        out[start:stop] = b"" if how == 4 else out[start:stop] * 2
    return bytes(out)


def survives(paths: tuple[Path, ...], read: Callable, check: Callable, seed: str, capfd) -> None:
    random = np.random.default_rng(zlib.crc32(seed.encode()))
    whole = {path: path.read_bytes() for path in paths}
    refused = 0
    for trial in range(TRIALS):
        path = paths[int(random.integers(len(paths)))]
        path.write_bytes(damaged(whole[path], trial % 6, random))
        try:
            check(read())
        except InvalidInput as error:
            refused += 1
            assert error.remedy
        path.write_bytes(whole[path])
    assert capfd.readouterr() == ("", "")
    assert refused > TRIALS / 4
    check(read())


def passed(found) -> None:
    """What came out is a whole model, and its findings can be said."""
    model = found.model
    for matrix in (model.mass, *(state.stiffness for state in model.states)):
        dense = matrix.toarray() if issparse(matrix) else matrix
        assert dense.shape == (len(model.dofs),) * 2
        assert np.isfinite(dense).all()
        assert np.array_equal(dense, dense.T)
    assert np.linalg.norm(model.rotation_axis) == pytest.approx(1.0)
    assert found.findings.lines()


@pytest.mark.parametrize("name", MODELS)
def test_models_of_matrices(name, full_model, reduced_model, tmp_path, capfd):
    model = full_model if name == "calculix" else reduced_model
    path = tmp_path / f"model{MODELS[name]}"
    if name == "mat-v6":
        savemat(path, arrays_of_model(model))
        paths: tuple[Path, ...] = (path,)
    else:
        paths = write_model(model, path, format=name).paths
    survives(paths, lambda: read_matrix_model(paths, rotation_axis=(0, 0, 1)), passed, f"model {name}", capfd)


@pytest.mark.parametrize("name", BLADES)
def test_modal_data(name, blade, tmp_path, capfd):
    paths = export_blade(blade, tmp_path / f"blade{BLADES[name]}", format=name).paths

    def check(found) -> None:
        assert found.findings.lines()
        assert all(np.isfinite(state.mode_shape).all() for state in found.blade.states)

    survives(paths, lambda: read_modal(paths[0]), check, f"blade {name}", capfd)

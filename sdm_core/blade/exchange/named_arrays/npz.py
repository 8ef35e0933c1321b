"""NumPy archives (.npz) without pickles: a model or a blade whole, to the last bit."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csc_array, issparse

from sdm_core.blade.exchange.content import FileContent
from sdm_core.blade.exchange.named_arrays.mat5 import checked_sparse
from sdm_core.blade.exchange.named_arrays.modal import arrays_of_blade, blade_of_arrays
from sdm_core.blade.exchange.parsing.file_bytes import LARGEST_FILE_BYTES, file_bytes
from sdm_core.blade.matrix_model import DofMap, Matrix, MatrixModel
from sdm_core.blade.modal import Blade
from sdm_core.errors import DamagedFile

MODEL_SCHEMA = "rubscreen/matrix-model/1"
BLADE_SCHEMA = "rubscreen/blade-arrays/1"
_SPARSE_PARTS = ("data", "indices", "indptr", "shape")
_MOST_ARRAYS = 10_000


def write_npz_model(model: MatrixModel, path: Path) -> None:
    """Write a model: every array as it is."""
    arrays: dict[str, Any] = {
        "schema": np.array(MODEL_SCHEMA),
        "name": np.array(model.name),
        "node": model.dofs.node,
        "component": model.dofs.component,
        "speed_hz": np.array([state.speed_hz for state in model.states], dtype=float),
        "rotation_axis": np.array(model.rotation_axis, dtype=float),
        "position_node": np.array(list(model.node_position_m), dtype=np.int64),
        "position_m": np.array(list(model.node_position_m.values()), dtype=float).reshape(-1, 3),
        **_parts("mass", model.mass),
    }
    for i, state in enumerate(model.states):
        arrays |= _parts(f"stiffness_{i}", state.stiffness)
        if state.static_displacement is not None:
            arrays[f"displacement_{i}"] = np.asarray(state.static_displacement, dtype=float)
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def write_npz_blade(blade: Blade, path: Path) -> None:
    """Write a blade: every array as it is."""
    arrays = {"schema": BLADE_SCHEMA, **arrays_of_blade(blade)}
    with path.open("wb") as file:
        np.savez_compressed(
            file, allow_pickle=False, **{key: np.array(value) for key, value in arrays.items()}
        )


def _parts(name: str, matrix: Matrix) -> dict[str, np.ndarray]:
    if not issparse(matrix):
        return {name: np.asarray(matrix, dtype=float)}
    columns = csc_array(matrix)
    return {
        f"{name}.data": columns.data.astype(float),
        f"{name}.indices": columns.indices.astype(np.int64),
        f"{name}.indptr": columns.indptr.astype(np.int64),
        f"{name}.shape": np.array(columns.shape, dtype=np.int64),
    }


def npz_arrays(path: Path) -> dict[str, np.ndarray]:
    """All arrays of an archive; their declared sizes are checked against their bytes before.

    Raises
    ------
    DamagedFile
        For a file that is no archive, damaged, or holds Python objects.
    """
    data = file_bytes(path)
    if data[:4] != b"PK\x03\x04":
        raise DamagedFile(path.name, f"a start {data[:4]!r}", "this is no .npz file: export it again")
    out: dict[str, np.ndarray] = {}
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = archive.infolist()
        total = sum(member.file_size for member in members)
        if len(members) > _MOST_ARRAYS or total > LARGEST_FILE_BYTES:
            raise DamagedFile(
                path.name, f"{len(members)} arrays, {total} bytes", "it is damaged or too large"
            )
        for member in members:
            if not member.filename.endswith(".npy"):
                raise DamagedFile(
                    f"{path.name}: {member.filename}", "no array", "this is no .npz of rubscreen"
                )
            # Reading a member whole also checks its checksum.
            out[member.filename.removesuffix(".npy")] = npy_array(
                f"{path.name}: {member.filename}", archive.read(member)
            )
    return out


def npy_array(where: str, data: bytes) -> np.ndarray:
    """The array in the content of a .npy file: numbers or text, never Python objects.

    Its declared size is checked against the bytes there are before room is made for it.

    Parameters
    ----------
    where
        What an error is to name.

    Raises
    ------
    DamagedFile
        For another format, objects, or sizes that do not fit.
    ValueError, SyntaxError, OSError
        As numpy, for a header that is none.
    """
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    if version == (1, 0):
        shape, _, kind = np.lib.format.read_array_header_1_0(stream)
    elif version == (2, 0):
        shape, _, kind = np.lib.format.read_array_header_2_0(stream)
    else:
        raise DamagedFile(where, f"array format {version}", "save it with numpy.savez")
    if kind.hasobject:
        raise DamagedFile(where, "Python objects", "save plain arrays: objects are never unpickled")
    if kind.kind not in "iufU":
        raise DamagedFile(where, f"data of type {kind}", "save real numbers or text")
    if math.prod(shape) * kind.itemsize != len(data) - stream.tell():
        raise DamagedFile(
            where, f"{shape} declared, {len(data) - stream.tell()} bytes there", "it is damaged"
        )
    stream.seek(0)
    return np.lib.format.read_array(stream, allow_pickle=False)


def read_npz_model(path: Path) -> FileContent:
    """A model that `write_npz_model` wrote, or an archive of plain arrays K and M.

    Raises
    ------
    DamagedFile
        For arrays missing or that do not fit each other.
    """
    arrays = npz_arrays(path)
    if str(arrays.get("schema", "")) != MODEL_SCHEMA:
        if "schema" in arrays:
            raise DamagedFile(
                f"{path.name}: schema", str(arrays["schema"]), f"a model of matrices has {MODEL_SCHEMA!r}"
            )
        from sdm_core.blade.exchange.content import content_of_arrays

        plain = {key: value for key, value in arrays.items() if value.dtype.kind in "iuf"}
        return content_of_arrays(path, plain)
    for key in ("name", "node", "component", "speed_hz", "rotation_axis", "position_node", "position_m"):
        if key not in arrays:
            raise DamagedFile(f"{path.name}: {key}", "missing", "the file is damaged: export it again")
    speed = arrays["speed_hz"]
    nodes, places = arrays["position_node"], arrays["position_m"]
    if places.shape != (len(nodes), 3) or arrays["rotation_axis"].shape != (3,) or speed.ndim != 1:
        raise DamagedFile(path.name, f"places of size {places.shape}", "the file is damaged: export it again")
    matrices = {"M": _matrix(path, arrays, "mass")}
    displacements = {}
    for i in range(len(speed)):
        matrices[f"K{i + 1}"] = _matrix(path, arrays, f"stiffness_{i}")
        if f"displacement_{i}" in arrays:
            displacements[f"K{i + 1}"] = arrays[f"displacement_{i}"]
    x, y, z = (float(value) for value in arrays["rotation_axis"])
    return FileContent(
        path,
        matrices,
        dofs=DofMap(arrays["node"], arrays["component"]),
        positions={
            int(n): (float(a), float(b), float(c)) for n, (a, b, c) in zip(nodes, places, strict=True)
        },
        speed_hz={f"K{i + 1}": float(value) for i, value in enumerate(speed)},
        displacements=displacements,
        rotation_axis=(x, y, z),
        name=str(arrays["name"]),
        in_si=True,
    )


def _matrix(path: Path, arrays: Mapping[str, np.ndarray], name: str) -> Matrix:
    where = f"{path.name}: {name}"
    if name in arrays:
        return arrays[name]
    parts = [arrays.get(f"{name}.{part}") for part in _SPARSE_PARTS]
    if any(part is None for part in parts):
        raise DamagedFile(where, "missing", "the file is damaged: export it again")
    data, indices, indptr, shape = (np.asarray(part) for part in parts)
    if shape.shape != (2,) or shape.dtype.kind not in "iu":
        raise DamagedFile(where, f"shape {shape}", "the file is damaged: export it again")
    return checked_sparse(where, tuple(int(x) for x in shape), data, indices, indptr)


def read_npz_blade(path: Path) -> Blade:
    """A blade that `write_npz_blade` wrote."""
    arrays = npz_arrays(path)
    if str(arrays.get("schema", "")) != BLADE_SCHEMA:
        raise DamagedFile(
            f"{path.name}: schema", str(arrays.get("schema", "missing")), f"a blade has {BLADE_SCHEMA!r}"
        )
    plain: dict[str, Any] = {}
    for key, value in arrays.items():
        if value.dtype.kind == "U":
            plain[key] = str(value) if value.ndim == 0 else [str(item) for item in value.ravel()]
        else:
            plain[key] = value
    return blade_of_arrays(path, plain)

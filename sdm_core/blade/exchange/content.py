"""What a file of matrices holds, before anything is made of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.sparse import issparse

from sdm_core.blade.exchange.checks.findings import Finding
from sdm_core.blade.matrix_model import DofMap, Matrix, MatrixModel
from sdm_core.errors import DamagedFile

Positions = dict[int, tuple[float, float, float]]

# Beyond these a matrix is no blade's, and a damaged size must not be allocated.
LARGEST_DENSE_ORDER = 12_000
LARGEST_SPARSE_ORDER = 3_000_000
# Names under which a model's other arrays stand beside its matrices, in files that name their arrays.
SPEEDS, DOFS, NODES, AXIS = "SPEEDHZ", "DOFS", "NODES", "AXIS"
STIFFNESS, MASS, DISPLACEMENT = "K", "M", "U"


@dataclass(frozen=True)
class FileContent:
    """Arrays of one file by name, and what the file says about them.

    Parameters
    ----------
    path
        The file.
    matrices
        Dense or sparse, in the file's units, by the file's names.
    dofs
        What each row is, where the file says it.
    positions
        x, y, z of nodes in the file's lengths.
    speed_hz
        Rotor speed of a stiffness by its name.
    displacements
        Static displacement by the name of the stiffness it belongs to.
    rotation_axis
        Where the file says it.
    name
        Of the model, where the file says it.
    in_si
        True when the format is in SI by its own definition.
    findings
        What was noticed on reading.
    """

    path: Path
    matrices: Mapping[str, Matrix] = field(default_factory=dict)
    dofs: DofMap | None = None
    positions: Positions | None = None
    speed_hz: Mapping[str, float] = field(default_factory=dict)
    displacements: Mapping[str, np.ndarray] = field(default_factory=dict)
    rotation_axis: tuple[float, float, float] | None = None
    name: str | None = None
    in_si: bool = False
    findings: tuple[Finding, ...] = ()


def bounded_shape(path: Path, name: str, rows: int, columns: int, *, sparse: bool = False) -> tuple[int, int]:
    """The shape, when a blade's matrix could have it: a damaged size is not allocated.

    Raises
    ------
    DamagedFile
        For sizes that are not positive, or too large.
    """
    limit = LARGEST_SPARSE_ORDER if sparse else LARGEST_DENSE_ORDER
    entries = LARGEST_SPARSE_ORDER**2 if sparse else LARGEST_DENSE_ORDER**2
    if min(rows, columns) < 1 or max(rows, columns) > LARGEST_SPARSE_ORDER or rows * columns > entries:
        raise DamagedFile(
            f"{path.name}: {name}",
            f"{rows} × {columns}",
            f"the file is damaged, or the matrix is beyond the {limit} rows that are read: "
            + ("reduce the model" if sparse else "write it sparse, or reduce the model"),
        )
    return rows, columns


def content_of_arrays(path: Path, arrays: Mapping[str, Matrix], **more: object) -> FileContent:
    """Content of a file that names its arrays (OP4, .mat): matrices, and the arrays beside them.

    ``DOFS`` has a row (node, component) for each row of the matrices, ``NODES`` rows (node, x, y, z),
    ``SPEEDHZ`` the speeds of ``K1``, ``K2``, ... (or of ``K``), ``AXIS`` the rotation axis, and ``U1`` the
    static displacement that goes with ``K1``.
    """
    by_key = {name.upper().replace("_", ""): name for name in arrays}
    rest = dict(arrays)

    def taken(key: str) -> np.ndarray | None:
        if key not in by_key:
            return None
        array = rest.pop(by_key[key], None)
        if array is None:
            return None
        dense = array.toarray() if issparse(array) else np.asarray(array)
        if dense.dtype.kind not in "iuf":
            raise DamagedFile(f"{path.name}: {by_key[key]}", str(dense.dtype), "give numbers there")
        if not np.isfinite(dense).all():
            raise DamagedFile(f"{path.name}: {by_key[key]}", "NaN or infinity", "export the file again")
        return np.atleast_2d(dense).astype(float)

    content = FileContent(path)
    table = taken(DOFS)
    if table is not None:
        content = replace(content, dofs=dof_map(path, by_key[DOFS], table))
    places = taken(NODES)
    if places is not None:
        content = replace(content, positions=positions_of(path, by_key[NODES], places))
    axis = taken(AXIS)
    if axis is not None:
        if axis.size != 3:
            raise DamagedFile(f"{path.name}: {by_key[AXIS]}", f"{axis.size} numbers", "give x, y, z")
        content = replace(content, rotation_axis=tuple(axis.ravel().tolist()))
    speeds = taken(SPEEDS)
    named = _speeds_of(path, by_key, rest, None if speeds is None else speeds.ravel())
    moved = {}
    for i, name in enumerate(named, 1):
        vector = taken(f"{DISPLACEMENT}{i}")
        if vector is not None:
            moved[name] = vector.ravel()
    return replace(content, matrices=rest, speed_hz=named, displacements=moved, **more)  # type: ignore[arg-type]


def _speeds_of(
    path: Path, by_key: Mapping[str, str], arrays: Mapping[str, Matrix], speeds: np.ndarray | None
) -> dict[str, float]:
    if speeds is None:
        return {}
    keys = [f"{STIFFNESS}{i}" for i in range(1, len(speeds) + 1)]
    if len(speeds) == 1 and STIFFNESS in by_key:
        keys = [STIFFNESS]
    missing = [key for key in keys if by_key.get(key) not in arrays]
    if missing:
        raise DamagedFile(
            f"{path.name}: {by_key[SPEEDS]}",
            f"{len(speeds)} speeds, no matrix {missing[0]}",
            f"give a stiffness for each speed: {STIFFNESS}1, {STIFFNESS}2, ...",
        )
    return {by_key[key]: float(speed) for key, speed in zip(keys, speeds, strict=True)}


def dof_map(path: Path, name: str, table: np.ndarray) -> DofMap:
    """Rows (node, component) as a map; (0, 0) is a modal coordinate."""
    whole = _whole(path, name, table, 2)
    return DofMap(whole[:, 0], whole[:, 1])


def positions_of(path: Path, name: str, table: np.ndarray) -> Positions:
    """Rows (node, x, y, z) as places by node."""
    if table.ndim != 2 or table.shape[1] != 4:
        raise DamagedFile(
            f"{path.name}: {name}", f"{table.shape[-1]} columns", "give node, x, y, z in each row"
        )
    nodes = _whole(path, name, table[:, :1], 1)[:, 0]
    if len(set(nodes.tolist())) != len(nodes):
        values, count = np.unique(nodes, return_counts=True)
        raise DamagedFile(
            f"{path.name}: {name}",
            f"node {values[np.argmax(count)]} {count.max()} times",
            "give every node one place",
        )
    return {
        int(node): (float(x), float(y), float(z)) for node, (x, y, z) in zip(nodes, table[:, 1:], strict=True)
    }


def _whole(path: Path, name: str, table: np.ndarray, columns: int) -> np.ndarray:
    where = f"{path.name}: {name}"
    if table.ndim != 2 or table.shape[1] != columns:
        raise DamagedFile(
            where, f"{table.shape[-1]} columns", f"give {columns}: node and component in each row"
        )
    bad = ~np.isfinite(table) | (table != np.floor(table)) | (np.abs(table) > 2**53)
    if bad.any():
        i, j = np.argwhere(bad)[0]
        raise DamagedFile(f"{where}[{i}]", float(table[i, j]), "give whole numbers")
    whole = table.astype(np.int64)
    if (whole < 0).any():
        i = int(np.argmax((whole < 0).any(axis=1)))
        raise DamagedFile(f"{where}[{i}]", whole[i].tolist(), "give node numbers from 1 (0 for a modal row)")
    return whole


def arrays_of_model(model: MatrixModel) -> dict[str, Matrix]:
    """A model as arrays by name, for files that name their arrays (see `content_of_arrays`)."""
    out: dict[str, Matrix] = {MASS: model.mass}
    for i, state in enumerate(model.states, 1):
        out[f"{STIFFNESS}{i}"] = state.stiffness
        if state.static_displacement is not None:
            out[f"{DISPLACEMENT}{i}"] = np.asarray(state.static_displacement, dtype=float)[:, None]
    out[SPEEDS] = np.array([[state.speed_hz for state in model.states]])
    out[AXIS] = np.array([model.rotation_axis], dtype=float)
    out[DOFS] = np.stack((model.dofs.node, model.dofs.component), axis=1).astype(float)
    if model.node_position_m:
        places = sorted(model.node_position_m.items())
        out[NODES] = np.array([[node, *place] for node, place in places], dtype=float)
    return out

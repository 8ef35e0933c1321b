"""From the contents of files to one model in SI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import issparse

from sdm_core.blade.exchange.checks.definiteness import symmetrised
from sdm_core.blade.exchange.checks.findings import Finding, Findings, note, warning
from sdm_core.blade.exchange.checks.matrices import check_model
from sdm_core.blade.exchange.checks.modal import mass_normalisation
from sdm_core.blade.exchange.condensation import condensed, condensed_mass, rows_without_mass
from sdm_core.blade.exchange.content import FileContent, Positions
from sdm_core.blade.exchange.roles import Held, roles
from sdm_core.blade.exchange.units import SI, Units
from sdm_core.blade.matrix_model import TRANSLATIONS, DofMap, Matrix, MatrixModel, SpeedState
from sdm_core.errors import InvalidInput

# Names under which exports carry mode shapes beside K and M.
_SHAPES = ("PHI", "PHIA", "PHIG", "PHIX", "MODES")


@dataclass(frozen=True)
class Wanted:
    """What the caller says about the files (see `reading.read_matrix_model`)."""

    stiffness: str | Mapping[float, str] | None
    mass: str | None
    units: Units
    rotation_axis: Sequence[float] | None
    name: str | None
    tip_nodes: Sequence[int]


def assembled(contents: Sequence[FileContent], wanted: Wanted) -> tuple[MatrixModel, Findings]:
    """One model of all files, checked.

    Raises
    ------
    InvalidInput
        Where the contents do not make a blade.
    """
    found = [finding for content in contents for finding in content.findings]
    for content in contents:
        if content.in_si and wanted.units is not SI:
            raise InvalidInput("units", wanted.units.name, f"{content.path.name} is in SI by definition")
    part = roles(contents, wanted.stiffness, wanted.mass)
    found += part.findings
    size = part.mass.matrix.shape[0]
    for _, held in part.stiffness:
        if held.matrix.shape[0] != size:
            raise InvalidInput(
                held.where,
                f"{held.matrix.shape[0]} rows, {size} in the mass {part.mass.where}",
                "stiffness and mass are of one model: name the pair that belongs together",
            )
    dofs = _dofs(contents, part.mass, size)
    taken = [part.mass, *(held for _, held in part.stiffness)]
    in_order = [_on_map(held, dofs, found) for held in taken]
    ready = []
    for held, matrix in zip(taken, in_order, strict=True):
        symmetric, defect = symmetrised(held.where, matrix)
        if defect > 0:
            found.append(
                note(held.where, f"unsymmetric by {defect:.1g} of its largest entry: made symmetric")
            )
        ready.append(wanted.units.matrix(symmetric, dofs))
    mass, *stiffness = ready
    moved = [_displacement(held, dofs, wanted.units) for _, held in part.stiffness]
    # A displacement of a node with a place has mass: where it has none, the file is cut off.
    places = _positions(contents, wanted.units)
    placed = np.isin(dofs.node, list(places)) & np.isin(dofs.component, TRANSLATIONS)
    massless = rows_without_mass(mass)
    if massless.any() and places and not (massless & placed).any():
        stiffness = [condensed(k, massless) for k in stiffness]
        mass, dofs = condensed_mass(mass, massless), DofMap(dofs.node[~massless], dofs.component[~massless])
        moved = [None if u is None else u[~massless] for u in moved]
        found.append(note("mass", f"{massless.sum()} rows without mass condensed statically, which is exact"))
    states = [
        SpeedState(speed, k, u) for (speed, _), k, u in zip(part.stiffness, stiffness, moved, strict=True)
    ]
    model = MatrixModel(
        wanted.name or next((c.name for c in contents if c.name), part.mass.content.path.stem),
        dofs,
        mass,
        tuple(sorted(states, key=lambda state: state.speed_hz)),
        places,
        _axis(contents, wanted.rotation_axis, found),
    )
    report = Findings(tuple(found)) + _given_shapes(contents, part.mass)
    return model, report + check_model(model, units=wanted.units.name, tip_nodes=wanted.tip_nodes)


def _dofs(contents: Sequence[FileContent], mass: Held, size: int) -> DofMap:
    own = mass.content.dofs
    maps = [(content.path.name, content.dofs) for content in contents if content.dofs is not None]
    if own is not None:
        dofs, where = own, mass.content.path.name
    elif maps:
        where, dofs = maps[0]
        for other, candidate in maps[1:]:
            if not _same(dofs, candidate):
                raise InvalidInput(
                    "dofs", f"{where} and {other} differ", "give one map of degrees of freedom"
                )
    else:
        raise InvalidInput(
            "dofs",
            "missing",
            "the format does not say what each row is: add a CSV table with the header node,component, a row "
            "each (modal for a modal coordinate)",
        )
    if len(dofs) != size:
        raise InvalidInput(
            "dofs",
            f"{len(dofs)} rows in {where}, {size} in the matrices",
            "give one row of the map for each row of the matrices",
        )
    if not (dofs.component > 0).any():
        raise InvalidInput("dofs", "modal rows only", "keep the displacements of the tip nodes in the model")
    return dofs


def _same(a: DofMap, b: DofMap) -> bool:
    return np.array_equal(a.node, b.node) and np.array_equal(a.component, b.component)


def _on_map(held: Held, dofs: DofMap, found: list[Finding]) -> Matrix:
    """The matrix with its rows in the order of the model's map."""
    own = held.content.dofs
    if own is None or _same(own, dofs):
        return held.matrix
    index = {key: i for i, key in enumerate(_keys(own))}
    keys = _keys(dofs)
    if set(keys) != set(index):
        raise InvalidInput(
            held.where,
            f"{len(set(keys) ^ set(index))} degrees of freedom differ from those of the mass",
            "give matrices of one model",
        )
    order = np.array([index[key] for key in keys])
    found.append(note(held.where, "rows reordered to those of the mass"))
    matrix = held.matrix
    return matrix[order][:, order] if not issparse(matrix) else matrix.tocsr()[order][:, order].tocsc()


def _keys(dofs: DofMap) -> list[tuple[int, int]]:
    # Modal coordinates have no number: they are told apart by their order.
    keys, modal = [], 0
    for node, component in zip(dofs.node.tolist(), dofs.component.tolist(), strict=True):
        if component == 0:
            modal += 1
            node = -modal
        keys.append((node, component))
    return keys


def _displacement(held: Held, dofs: DofMap, units: Units) -> np.ndarray | None:
    vector = held.content.displacements.get(held.name)
    if vector is None:
        return None
    if vector.shape != (len(dofs),) or not np.isfinite(vector).all():
        raise InvalidInput(
            f"{held.where}: static displacement", f"size {vector.shape}", f"give {len(dofs)} finite numbers"
        )
    return units.displacement(vector.astype(float), dofs)


def _positions(contents: Sequence[FileContent], units: Units) -> Positions:
    out: Positions = {}
    for content in contents:
        for node, place in (content.positions or {}).items():
            x, y, z = (float(value) * units.metres for value in place)
            if not np.isfinite([x, y, z]).all():
                raise InvalidInput(f"{content.path.name}: node {node}", place, "give finite places")
            if out.setdefault(node, (x, y, z)) != (x, y, z):
                raise InvalidInput(
                    f"{content.path.name}: node {node}",
                    place,
                    f"another file places it at {out[node]}: give one",
                )
    return out


def _axis(
    contents: Sequence[FileContent], given: Sequence[float] | None, found: list[Finding]
) -> tuple[float, float, float]:
    said = given if given is not None else next((c.rotation_axis for c in contents if c.rotation_axis), None)
    if said is None:
        found.append(
            warning(
                "rotation_axis",
                "not said: taken along z through the origin",
                "give the rotation axis (x, y, z) where the rotor turns about another",
            )
        )
        return 0.0, 0.0, 1.0
    axis = np.array(said, dtype=float)
    if axis.shape != (3,) or not np.isfinite(axis).all() or not np.linalg.norm(axis) > 0:
        raise InvalidInput("rotation_axis", list(said), "give x, y, z of a direction")
    length = float(np.linalg.norm(axis))
    if abs(length - 1) > 1e-12:
        if abs(length - 1) > 1e-6:
            found.append(note("rotation_axis", f"scaled from length {length:.6g} to 1"))
        axis = axis / length
    return float(axis[0]), float(axis[1]), float(axis[2])


def _given_shapes(contents: Sequence[FileContent], mass: Held) -> Findings:
    out = Findings()
    for content in contents:
        for name, matrix in content.matrices.items():
            if name.upper() in _SHAPES and matrix.ndim == 2 and matrix.shape[0] == mass.matrix.shape[0]:
                shapes = matrix.toarray() if issparse(matrix) else matrix
                if np.isfinite(shapes).all() and shapes.shape[1] < shapes.shape[0]:
                    out = out + mass_normalisation(name, shapes, mass.matrix)
    return out

"""Nastran direct matrix input (DMIG) in bulk data or punch files: reading and writing.

A header entry names form and type of a matrix; each column entry gives node and component of the column and,
four fields each, node, component, real and imaginary part of its terms. A symmetric matrix (form 6) has one
triangle only. External superelements are punched like this (KAAX, MAAX). Layout: Nastran Quick Reference
Guide, DMIG. Written here: see `op4`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, csc_array, triu

from sdm_core.blade.exchange.checks.findings import Finding, note
from sdm_core.blade.exchange.content import FileContent, bounded_shape
from sdm_core.blade.exchange.nastran.bulk_data import Entry, entries, field_text
from sdm_core.blade.exchange.nastran.coordinate_systems import KINDS, coordinate_systems, to_basic
from sdm_core.blade.exchange.nastran.grid_places import grid_places
from sdm_core.blade.exchange.parsing.file_bytes import file_text, whole_lines
from sdm_core.blade.exchange.parsing.fortran_fields import integer, real
from sdm_core.blade.matrix_model import MODAL, DofMap, Matrix, MatrixModel
from sdm_core.errors import DamagedFile

SQUARE, SYMMETRIC = 1, 6
# What DMIG has no place for stands in comments, as Nastran's own punch files do it.
_SPEED = re.compile(r"^\$ SPEED_HZ (\w+) (\S+)\s*$", re.MULTILINE)
_REMAINDER = re.compile(r"^\$ REMAINDER (\w+) (\w+)\s*$", re.MULTILINE)
_AXIS = re.compile(r"^\$ ROTATION_AXIS (\S+) (\S+) (\S+)\s*$", re.MULTILINE)
Row = tuple[int, int]


@dataclass
class _Terms:
    form: int
    rows: list[Row] = field(default_factory=list)
    columns: list[Row] = field(default_factory=list)
    values: list[float] = field(default_factory=list)


def read_dmig(path: Path) -> FileContent:
    """All square DMIG matrices of a file on one common map of degrees of freedom, and its GRID places.

    Rows of nodes with a displacement system of their own are turned to the basic x, y, z.

    Raises
    ------
    DamagedFile
        For a file cut off, damaged, complex or without DMIG.
    """
    text = file_text(path, "Nastran bulk data")
    whole_lines(path, text)
    found: dict[str, _Terms] = {}
    left_out: list[Finding] = []
    grids, systems = [], []
    for entry in entries(path, text):
        if entry.kind == "GRID":
            grids.append(entry)
        elif entry.kind in KINDS:
            systems.append(entry)
        elif entry.kind == "DMIG":
            _take(path, entry, found, left_out)
    if not found:
        raise DamagedFile(path.name, "no DMIG matrix", "give a bulk data or punch file with DMIG entries")
    for name, terms in found.items():
        if not terms.values:
            raise DamagedFile(f"{path.name}: {name}", "no column", "the file is cut off: export it again")
    # Scalar points carry modal coordinates: they follow the nodes, in the order of their numbers.
    keys = sorted(
        {row for terms in found.values() for row in (*terms.rows, *terms.columns)},
        key=lambda row: (row[1] == MODAL, row),
    )
    bounded_shape(path, "DMIG", len(keys), len(keys), sparse=True)
    index = {key: i for i, key in enumerate(keys)}
    matrices = {name: _assembled(path, name, terms, index) for name, terms in found.items()}
    for rest, whole in _REMAINDER.findall(text):
        if rest in matrices and whole in matrices:
            matrices[whole] = matrices[whole] + matrices.pop(rest)
    node = np.array([0 if component == MODAL else grid for grid, component in keys])
    dofs = DofMap(node, np.array([component for _, component in keys]))
    places, directions = grid_places(path, grids, coordinate_systems(path, systems), set(node.tolist()))
    if directions:
        matrices = to_basic(path.name, matrices, dofs, directions)
        left_out.append(note("dofs", f"{len(directions)} nodes turned from systems of their own to x, y, z"))
    return FileContent(
        path,
        matrices,
        dofs=dofs,
        positions=places or None,
        speed_hz={name: real(path.name, speed) for name, speed in _SPEED.findall(text) if name in matrices},
        rotation_axis=_axis(path, text),
        findings=tuple(left_out),
    )


def _axis(path: Path, text: str) -> tuple[float, float, float] | None:
    match = _AXIS.search(text)
    if match is None:
        return None
    x, y, z = (real(path.name, part) for part in match.groups())
    return x, y, z


def _take(path: Path, entry: Entry, found: dict[str, _Terms], left_out: list[Finding]) -> None:
    where = f"{path.name}: line {entry.line}"
    name = entry.field(0).upper()
    if not name:
        raise DamagedFile(where, "DMIG", "the matrix has no name: the file is damaged")
    if entry.field(1) == "0":
        form, kind = integer(where, entry.field(2)), integer(where, entry.field(3))
        if name in found:
            raise DamagedFile(where, f"matrix {name} twice", "write every matrix once")
        if kind in (3, 4):
            raise DamagedFile(where, f"{name} is complex", "give real matrices: without structural damping")
        if kind not in (1, 2) or form not in (SQUARE, SYMMETRIC, 2, 9):
            raise DamagedFile(where, f"{name}: form {form}, type {kind}", "the file is damaged")
        if form in (SQUARE, SYMMETRIC):
            found[name] = _Terms(form)
        else:
            left_out.append(note(name, f"DMIG of form {form}, not square: left out"))
        return
    if name not in found:
        if any(finding.field == name for finding in left_out):
            return
        raise DamagedFile(where, f"column of {name}", "its header entry is missing: the file is damaged")
    terms = found[name]
    column = _row(where, entry.field(1), entry.field(2))
    rest = entry.fields[4:]
    blocks = [rest[i : i + 4] for i in range(0, len(rest), 4)]
    blocks = [block for block in blocks if any(block)]
    if not blocks:
        raise DamagedFile(
            where, f"{name}, column {column[0]} {column[1]}", "a continuation is missing: export it again"
        )
    for block in blocks:
        grid, component, value, *imaginary = block
        if imaginary and imaginary[0] and real(where, imaginary[0]) != 0.0:
            raise DamagedFile(where, f"{name} has an imaginary part", "give real matrices")
        terms.rows.append(_row(where, grid, component))
        terms.columns.append(column)
        terms.values.append(real(where, value))


def _row(where: str, grid: str, component: str) -> Row:
    row = integer(where, grid), integer(where, component or "0")
    if row[0] < 1 or not 0 <= row[1] <= 6:
        raise DamagedFile(where, f"node {row[0]}, component {row[1]}", "the file is damaged: export it again")
    return row


def _assembled(path: Path, name: str, terms: _Terms, index: dict[Row, int]) -> Matrix:
    size = len(index)
    i = np.array([index[row] for row in terms.rows])
    j = np.array([index[row] for row in terms.columns])
    v = np.array(terms.values)
    if terms.form == SYMMETRIC:
        # Either triangle may be given, or both parts mixed; a term given on both sides is an error.
        i, j = np.maximum(i, j), np.minimum(i, j)
    if terms.form == SYMMETRIC:
        off = i != j
        v = np.concatenate((v, v[off]))
        i, j = np.concatenate((i, j[off])), np.concatenate((j, i[off]))
    # The conversion adds up what is given twice.
    matrix = csc_array(coo_array((v, (i, j)), shape=(size, size)))
    if matrix.nnz != len(v):
        raise DamagedFile(
            f"{path.name}: {name}", "a term given twice", "the file is damaged: export it again"
        )
    # Reduced matrices are full: a sparse form would only cost.
    return matrix.toarray() if size <= 2000 and matrix.nnz > 0.3 * size * size else matrix


def write_dmig(model: MatrixModel, path: Path) -> None:
    """Write a model as DMIG entries with 16 characters a number, GRID entries beside them, in SI.

    Sixteen characters hold 11 to 14 digits, too few for the lowest modes of a stiff model (2e-10 in frequency
    for a beam of 144 degrees of freedom). What they cut off stands in a second matrix each, KAAXR beside
    KAAX: `read_dmig` adds the two, and so does ``K2GG = KAAX, KAAXR`` in Nastran.

    One speed gives KAAX and MAAX, more give KAAX1, KAAX2, ... Modal coordinates become scalar points with
    numbers above those of the nodes. Static displacements have no place in the format.
    """
    with path.open("w", encoding="ascii", newline="\n") as file:
        for line in _lines(model):
            file.write(line + "\n")


def _lines(model: MatrixModel) -> Iterator[str]:
    names = ["KAAX"] if len(model.states) == 1 else [f"KAAX{i + 1}" for i in range(len(model.states))]
    yield "$ Units: m, kg, s, N"
    for name, state in zip(names, model.states, strict=True):
        yield f"$ SPEED_HZ {name} {state.speed_hz!r}"
    yield "$ ROTATION_AXIS " + " ".join(repr(float(x)) for x in model.rotation_axis)
    yield "BEGIN BULK"
    for node, place in sorted(model.node_position_m.items()):
        x, y, z = (field_text(float(value)) for value in place)
        yield f"{'GRID*':8}{node:16}{0:16}{x:>16}{y:>16}"
        yield f"{'*':8}{z:>16}{0:16}"
    rows = _numbered_rows(model.dofs)
    points = [grid for grid, component in rows if component == MODAL]
    for point in points:
        yield f"{'SPOINT':8}{point:8}"
    for name, matrix in [*zip(names, (s.stiffness for s in model.states), strict=True), ("MAAX", model.mass)]:
        half = csc_array(triu(csc_array(matrix)).T)
        texts = [field_text(value) for value in half.data.tolist()]
        cut = [x - real(name, text) for x, text in zip(half.data.tolist(), texts, strict=True)]
        yield from _matrix_lines(name, half, texts, rows)
        if any(cut):
            yield f"$ REMAINDER {name}R {name}"
            yield from _matrix_lines(f"{name}R", half, [field_text(x) for x in cut], rows)
    yield "ENDDATA"


def _matrix_lines(name: str, half: csc_array, texts: list[str], rows: list[Row]) -> Iterator[str]:
    yield f"{'DMIG':8}{name:8}{0:8}{SYMMETRIC:8}{2:8}{0:8}{'':8}{'':8}{len(rows):8}"
    for j in range(half.shape[1]):
        part = range(half.indptr[j], half.indptr[j + 1])
        if part:
            yield f"{'DMIG*':8}{name:16}{rows[j][0]:16}{rows[j][1]:16}"
        for k in part:
            i = half.indices[k]
            yield f"{'*':8}{rows[i][0]:16}{rows[i][1]:16}{texts[k]:>16}"


def _numbered_rows(dofs: DofMap) -> list[Row]:
    scalar = int(dofs.node.max(initial=0))
    out = []
    for node, component in zip(dofs.node.tolist(), dofs.component.tolist(), strict=True):
        if component == MODAL:
            scalar += 1
            node = scalar
        out.append((node, component))
    return out

"""CalculiX matrices: ``*FREQUENCY, SOLVER=MATRIXSTORAGE``.

A job writes ``job.sti`` and ``job.mas`` (lines of row, column, value; the upper triangle, 14 digits) and
``job.dof`` (one line a row, ``node.component``). A perturbation step after ``*STATIC`` with centrifugal
load and NLGEOM gives the stiffness at speed, stress stiffening and spin softening included: the CalculiX
user's manual, "*FREQUENCY". Nodes are in the job's ``.inp``.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.sparse import csc_array, triu

from sdm_core.blade.exchange.checks.findings import Finding, note
from sdm_core.blade.exchange.content import FileContent, Positions
from sdm_core.blade.exchange.parsing.file_bytes import file_text, whole_lines
from sdm_core.blade.exchange.parsing.fortran_fields import integer, real
from sdm_core.blade.exchange.triplets.matrix import matrix_of_triplets
from sdm_core.blade.matrix_model import TRANSLATIONS, DofMap, Matrix, MatrixModel
from sdm_core.errors import DamagedFile, InvalidInput

_ROLES = {".sti": "K", ".mas": "M"}
_DOF = re.compile(r"(\d{1,12})\.([1-6])")
SUFFIXES = (".sti", ".mas", ".dof")


def companions(path: Path) -> list[Path]:
    """The other files of a job, where they lie beside this one."""
    return [
        other
        for suffix in (*SUFFIXES, ".inp")
        if (other := path.with_suffix(suffix)) != path and other.is_file()
    ]


def read_calculix(path: Path) -> FileContent:
    """One file of a job: a matrix (``.sti``, ``.mas``), the map (``.dof``) or the nodes (``.inp``).

    Raises
    ------
    DamagedFile
        For a file cut off, damaged or of another kind.
    """
    suffix = path.suffix.lower()
    text = file_text(path, "text written by CalculiX")
    if suffix == ".inp":
        places, found = input_nodes(path, text)
        return FileContent(path, positions=places, findings=found)
    whole_lines(path, text)
    if suffix == ".dof":
        return FileContent(path, dofs=_dofs(path, text))
    return FileContent(path, {_ROLES[suffix]: _triplets(path, text)})


def _triplets(path: Path, text: str) -> csc_array:
    try:
        table = np.loadtxt(io.StringIO(text), comments=None, ndmin=2)
    except ValueError:
        table = np.empty((0, 0))
    if table.shape[1] != 3:
        for number, line in enumerate(text.splitlines(), 1):
            where, words = f"{path.name}: line {number}", line.split()
            if len(words) != 3:
                raise DamagedFile(where, line[:60], "there should be a row, a column and a value")
            for word in words:
                real(where, word)
        raise DamagedFile(path.name, "text among its numbers", "export the file again") from None
    return matrix_of_triplets(path, table)


def _dofs(path: Path, text: str) -> DofMap:
    pairs = []
    for number, line in enumerate(text.splitlines(), 1):
        match = _DOF.fullmatch(line.strip())
        if match is None:
            raise DamagedFile(
                f"{path.name}: line {number}",
                line.strip()[:60],
                "there should be node.component, such as 12.3",
            )
        pairs.append((int(match[1]), int(match[2])))
    table = np.array(pairs)
    return DofMap(table[:, 0], table[:, 1])


def input_nodes(path: Path, text: str) -> tuple[Positions | None, tuple[Finding, ...]]:
    """Places of the nodes of an input deck; what makes them doubtful is said.

    Raises
    ------
    DamagedFile
        For a ``*NODE`` line that is none, or a node placed twice in different places.
    """
    places: Positions = {}
    found: list[Finding] = []
    inside = False
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        if line.startswith("*"):
            keyword = line.partition(",")[0].upper()
            inside = keyword == "*NODE"
            if keyword in ("*INCLUDE", "*TRANSFORM"):
                found.append(
                    note(
                        f"{path.name}: line {number}",
                        "nodes in included files are not read"
                        if keyword == "*INCLUDE"
                        else "matrices are taken to be in the global axes, as CalculiX writes them",
                    )
                )
            continue
        if inside:
            where = f"{path.name}: line {number}"
            parts = [part.strip() for part in line.rstrip(",").split(",")]
            if not 2 <= len(parts) <= 4:
                raise DamagedFile(where, line[:60], "there should be node, x, y, z")
            node = integer(where, parts[0])
            x, y, z = (real(where, part or "0") for part in [*parts[1:], "0", "0"][:3])
            if places.setdefault(node, (x, y, z)) != (x, y, z):
                raise DamagedFile(where, f"node {node}", "it is placed twice: give every node one place")
    return places or None, tuple(found)


def write_calculix(model: MatrixModel, path: Path) -> tuple[Path, ...]:
    """Write a model as CalculiX does, one job a speed, with 17 digits; nodes in ``.inp``.

    Raises
    ------
    InvalidInput
        For rows that are no displacements.

    Returns
    -------
    The files: ``job.mas``, ``job.dof``, ``job.inp`` and a ``.sti`` a speed.
    """
    if not np.isin(model.dofs.component, TRANSLATIONS).all():
        raise InvalidInput(
            "format", "calculix", "it holds displacements only: write modal or turning rows as npz"
        )
    names = (
        [path.with_suffix(".sti")]
        if len(model.states) == 1
        else [path.with_name(f"{path.stem}_{i + 1}.sti") for i in range(len(model.states))]
    )
    jobs: Mapping[Path, Matrix] = dict(zip(names, (s.stiffness for s in model.states), strict=True))
    for target, matrix in {**jobs, path.with_suffix(".mas"): model.mass}.items():
        upper = csc_array(triu(csc_array(matrix)))
        columns = np.repeat(np.arange(upper.shape[1]), np.diff(upper.indptr))
        rows = zip(upper.indices.tolist(), columns.tolist(), upper.data.tolist(), strict=True)
        target.write_text(
            "".join(f"{i + 1} {j + 1} {v:23.16e}\n" for i, j, v in rows), encoding="ascii", newline="\n"
        )
    pairs = zip(model.dofs.node.tolist(), model.dofs.component.tolist(), strict=True)
    path.with_suffix(".dof").write_text("".join(f"{n}.{c}\n" for n, c in pairs), encoding="ascii")
    nodes = "".join(f"{n}, {x!r}, {y!r}, {z!r}\n" for n, (x, y, z) in sorted(model.node_position_m.items()))
    path.with_suffix(".inp").write_text("*NODE, NSET=NALL\n" + nodes, encoding="ascii")
    return (*jobs, *(path.with_suffix(suffix) for suffix in (".mas", ".dof", ".inp")))

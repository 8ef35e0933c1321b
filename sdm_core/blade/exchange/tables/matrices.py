"""Matrices and their companions as CSV tables, told apart by their header.

===========================  ====================================================================
no header                    a dense matrix; its name is the last part of the file's (``K``)
``row,column,value``         a sparse one, indices from 1; one triangle is mirrored
``node,component``           what each row of the matrices is; ``modal`` for a modal coordinate
``node,x_m,y_m,z_m``         places of nodes (or ``x_mm,y_mm,z_mm``)
``speed_hz,stiffness``       which stiffness belongs to which rotor speed
===========================  ====================================================================
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import csc_array, issparse, triu

from sdm_core.blade.exchange.content import FileContent, bounded_shape, positions_of
from sdm_core.blade.exchange.tables.table import Table, read_table, write_table
from sdm_core.blade.exchange.triplets.matrix import matrix_of_triplets
from sdm_core.blade.exchange.triplets.matrix_market import name_in_file_name
from sdm_core.blade.matrix_model import MODAL, DofMap, Matrix
from sdm_core.errors import DamagedFile

TRIPLETS = ("row", "column", "value")
DOFS = ("node", "component")
NODES_M, NODES_MM = ("node", "x_m", "y_m", "z_m"), ("node", "x_mm", "y_mm", "z_mm")
SPEEDS = ("speed_hz", "stiffness")


def read_csv_matrices(path: Path, *, metres: float = 1.0) -> FileContent:
    """A table with a matrix, or a companion of one.

    Parameters
    ----------
    path
        The file.
    metres
        Metres in a length of the other files: places whose header names their unit are turned into such
        lengths.

    Raises
    ------
    DamagedFile
        For a table that is none of these, ragged, or with text for numbers.
    """
    table = read_table(path)
    name = name_in_file_name(path)
    if not table.header:
        values = table.numbers()
        if values.shape[0] != values.shape[1]:
            raise DamagedFile(
                path.name,
                f"{values.shape[0]} rows, {values.shape[1]} columns",
                "a matrix is square: the file is cut off, or a table without its header",
            )
        bounded_shape(path, name, *values.shape)
        return FileContent(path, {name: values})
    if table.header == TRIPLETS:
        return FileContent(path, {name: matrix_of_triplets(path, table.numbers())})
    if table.header == DOFS:
        return FileContent(path, dofs=_dofs(table))
    if table.header in (NODES_M, NODES_MM):
        unit = 1.0 if table.header == NODES_M else 1e-3
        values = table.numbers()
        values[:, 1:] *= unit / metres
        return FileContent(path, positions=positions_of(path, "nodes", values))
    if table.header == SPEEDS:
        speeds = table.column("speed_hz")
        names = [row[1] for row in table.rows]
        if len(set(names)) != len(names):
            raise DamagedFile(f"{path.name}: stiffness", ", ".join(names), "give every matrix one speed")
        return FileContent(path, speed_hz=dict(zip(names, speeds.tolist(), strict=True)))
    raise DamagedFile(
        f"{path.name}: header",
        ", ".join(table.header),
        "give one of: no header (a dense matrix); row,column,value; node,component; node,x_m,y_m,z_m; "
        "speed_hz,stiffness",
    )


def _dofs(table: Table) -> DofMap:
    node, component = [], []
    for i, row in enumerate(table.rows):
        if row[0].lower() == "modal":
            node.append(0)
            component.append(MODAL)
            continue
        pair = [table.number(i, j) for j in (0, 1)]
        if pair != [float(int(x)) for x in pair] or not 0 <= pair[1] <= 6 or pair[0] < 0:
            raise DamagedFile(
                table.where(i, 1), ", ".join(row), "give a node number and 1 to 6, or modal for a modal row"
            )
        if (pair[0] == 0) != (pair[1] == MODAL):
            raise DamagedFile(table.where(i, 0), ", ".join(row), "node and component are both 0, or neither")
        node.append(int(pair[0]))
        component.append(int(pair[1]))
    return DofMap(np.array(node), np.array(component))


def write_csv_matrix(matrix: Matrix, path: Path) -> None:
    """Write a matrix with all digits: dense without header, sparse as its lower triangle."""
    if not issparse(matrix):
        write_table(path, (), np.asarray(matrix, dtype=float).tolist())
        return
    columns = csc_array(matrix)
    whole = abs(columns - columns.T).max() != 0
    kept = (columns if whole else csc_array(triu(columns.T).T)).tocoo()
    rows = zip((kept.row + 1).tolist(), (kept.col + 1).tolist(), kept.data.tolist(), strict=True)
    write_table(path, TRIPLETS, list(rows))


def write_dofs(dofs: DofMap, path: Path) -> None:
    """Write the map of degrees of freedom."""
    pairs = zip(dofs.node.tolist(), dofs.component.tolist(), strict=True)
    write_table(path, DOFS, [("modal", 0) if c == MODAL else (n, c) for n, c in pairs])

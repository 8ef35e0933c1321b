"""Matrix Market files (.mtx), one matrix each: scipy reads and writes them, sizes are checked before.

The name of the matrix is the last part of the file's name: ``K`` of ``K.mtx``, ``K1`` of ``blade.K1.mtx``.
Format: Boisvert, Pozo, Remington, NISTIR 5935 (1996).
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from scipy.sparse import csc_array, issparse

from sdm_core.blade.exchange.content import FileContent, bounded_shape
from sdm_core.blade.exchange.parsing.file_bytes import file_text, whole_lines
from sdm_core.blade.exchange.parsing.fortran_fields import integer
from sdm_core.blade.matrix_model import Matrix
from sdm_core.errors import DamagedFile

_FIELDS = ("real", "double", "integer")
_SYMMETRIES = ("general", "symmetric")


def name_in_file_name(path: Path) -> str:
    """Name of the matrix of a file that holds one."""
    return path.stem.rpartition(".")[2] or path.stem


def read_matrix_market(path: Path) -> FileContent:
    """The matrix of a Matrix Market file.

    Raises
    ------
    DamagedFile
        For a file cut off, damaged, complex, a bare pattern or of another kind.
    """
    from scipy.io import mmread

    text = file_text(path, "a Matrix Market file")
    whole_lines(path, text)
    lines = text.splitlines()
    banner = lines[0].lower().split() if lines else []
    if len(banner) != 5 or banner[:2] != ["%%matrixmarket", "matrix"]:
        raise DamagedFile(
            path.name,
            (lines or [""])[0][:60],
            "this is no Matrix Market file: its first line starts with %%MatrixMarket matrix",
        )
    layout, kind, symmetry = banner[2:]
    if layout not in ("array", "coordinate") or kind not in _FIELDS or symmetry not in _SYMMETRIES:
        raise DamagedFile(
            f"{path.name}: line 1",
            " ".join(banner[2:]),
            "give a real matrix, general or symmetric, as coordinate or array",
        )
    at = next((i for i, line in enumerate(lines) if i and line.strip() and line[0] != "%"), len(lines))
    where = f"{path.name}: line {at + 1}"
    sizes = [integer(where, word) for word in lines[at].split()] if at < len(lines) else []
    sparse = layout == "coordinate"
    if len(sizes) != (3 if sparse else 2):
        raise DamagedFile(where, f"{len(sizes)} sizes", "the file is cut off: export it again")
    rows, columns = bounded_shape(path, "matrix", sizes[0], sizes[1], sparse=sparse)
    half = rows * (rows + 1) // 2 if symmetry == "symmetric" else rows * columns
    declared = sizes[2] if sparse else half
    given = sum(1 for line in lines[at + 1 :] if line.strip() and line[0] != "%")
    # A value a line, as every known writer has it.
    if given != declared:
        raise DamagedFile(
            where, f"{declared} entries declared, {given} lines", "the file is cut off or damaged"
        )
    matrix = mmread(io.BytesIO(text.encode("utf-8")), spmatrix=False)
    if sparse:
        ordered = csc_array(matrix)
        if symmetry == "general" and ordered.nnz != declared:
            raise DamagedFile(path.name, "an entry given twice", "give every entry once")
        ordered.eliminate_zeros()
        return FileContent(path, {name_in_file_name(path): ordered})
    return FileContent(path, {name_in_file_name(path): np.asarray(matrix, dtype=float)})


def write_matrix_market(matrix: Matrix, path: Path, comment: str) -> None:
    """Write one matrix with 17 digits: every bit of a double."""
    from scipy.io import mmwrite

    with path.open("wb") as file:
        mmwrite(
            file,
            csc_array(matrix) if issparse(matrix) else np.asarray(matrix, dtype=float),
            comment=comment,
            field="real",
            precision=17,
            symmetry="symmetric" if abs(matrix - matrix.T).max() == 0 else "general",
        )

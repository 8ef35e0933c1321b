"""MATLAB files, whichever version: matrices or modal data by their usual names."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import issparse

from sdm_core.blade.exchange.checks.findings import Finding, note
from sdm_core.blade.exchange.content import FileContent, content_of_arrays
from sdm_core.blade.exchange.named_arrays.mat5 import Unread, read_mat5
from sdm_core.blade.exchange.named_arrays.mat73 import read_mat73, write_mat73
from sdm_core.blade.exchange.named_arrays.modal import blade_of_arrays
from sdm_core.blade.exchange.parsing.file_bytes import file_bytes
from sdm_core.blade.matrix_model import Matrix
from sdm_core.blade.modal import Blade
from sdm_core.errors import DamagedFile

_HDF5 = b"\x89HDF\r\n\x1a\n"
# Rotor speeds by other names than SPEEDHZ, and what turns them into Hz.
_IN_RAD_S, _IN_RPM = ("rad/s", 1 / (2 * math.pi)), ("rpm", 1 / 60)
_SPEEDS = {"OMEGA": _IN_RAD_S, "OMEGARADS": _IN_RAD_S, "RPM": _IN_RPM, "SPEEDRPM": _IN_RPM}


def mat_tree(path: Path) -> dict[str, Any]:
    """All variables of a .mat file, version 5 or 7.3.

    Raises
    ------
    DamagedFile
        For another version, a file cut off or damaged.
    """
    data = file_bytes(path)
    if data[:8] == _HDF5 or data[512:520] == _HDF5:
        return read_mat73(path)
    if len(data) < 128 or data[124:128] not in (b"\x00\x01IM", b"\x01\x00MI"):
        raise DamagedFile(
            path.name,
            f"a start {data[:19].decode('ascii', 'replace')!r}",
            "this is no MATLAB file of version 5 or 7.3, or it is cut off: save it with -v7 or -v7.3",
        )
    return read_mat5(path, data)


def read_mat_matrices(path: Path) -> FileContent:
    """Matrices of a .mat file, at the top or in a structure.

    ``K`` and ``M``, or ``K1``, ``K2``, ...; ``K`` may also be a cell array, or N × N × s, one page a speed.
    ``speed_hz`` (or ``Omega`` in rad/s, or ``rpm``) gives the speeds, ``dofs`` rows (node, component),
    ``nodes`` rows (node, x, y, z), ``axis`` the rotation axis.
    """
    found: list[Finding] = []
    arrays = _numeric(path, mat_tree(path), found)
    if not any(array.ndim == 2 and min(array.shape) > 0 for array in arrays.values()):
        kinds = ", ".join(str(item) for item in found) or "nothing"
        raise DamagedFile(path.name, f"no matrix ({kinds[:80]})", "save numeric matrices K and M in it")
    return content_of_arrays(path, arrays, findings=tuple(found))


def _numeric(path: Path, tree: Mapping[str, Any], found: list[Finding]) -> dict[str, Matrix]:
    flat: dict[str, Any] = {}
    for name, value in tree.items():
        for key, part in value.items() if isinstance(value, dict) else ((name, value),):
            if key in flat:
                raise DamagedFile(f"{path.name}: {key}", "more than once", "keep one of them in the file")
            flat[key] = part
    out: dict[str, Matrix] = {}
    for name, value in flat.items():
        plain = name.upper().replace("_", "")
        if isinstance(value, list) and value and all(_is_matrix(part) for part in value):
            out |= {f"{name}{i}": part for i, part in enumerate(value, 1)}
        elif _is_matrix(value) and value.ndim == 3:
            out |= {f"{name}{i + 1}": value[:, :, i] for i in range(value.shape[2])}
        elif not _is_matrix(value):
            kind = value.kind if isinstance(value, Unread) else "text or cells"
            found.append(note(name, f"{kind}: left out"))
        elif plain in _SPEEDS:
            unit, factor = _SPEEDS[plain]
            out["SPEEDHZ"] = np.asarray(value, dtype=float) * factor
            found.append(note(name, f"rotor speeds in {unit}, converted to Hz"))
        else:
            out[name] = value if issparse(value) else np.asarray(value, dtype=float)
    return out


def _is_matrix(value: Any) -> bool:
    return issparse(value) or (isinstance(value, np.ndarray) and value.dtype.kind in "iufb")


def read_mat_modal(path: Path) -> Blade:
    """Modal data of a .mat file, at the top or in the structure ``blade`` (see `modal`)."""
    tree = mat_tree(path)
    part = tree.get("blade", tree)
    if not isinstance(part, dict):
        raise DamagedFile(f"{path.name}: blade", type(part).__name__, "make it a structure, 1 by 1")
    return blade_of_arrays(path, part)


def write_mat(tree: Mapping[str, Any], path: Path, *, version: str) -> None:
    """Write arrays, text and lists of text; `version` is ``5`` or ``7.3``."""
    if version == "7.3":
        write_mat73(tree, path)
        return
    from scipy.io import savemat

    def cells(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {key: cells(part) for key, part in value.items()}
        if isinstance(value, list):
            out = np.empty((len(value), 1), dtype=object)
            out[:, 0] = value
            return out
        return value

    savemat(path, cells(tree), do_compression=True, oned_as="column", long_field_names=True)

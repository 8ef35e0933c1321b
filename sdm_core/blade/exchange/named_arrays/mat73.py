"""MATLAB files of version 7.3, which are HDF5: reading and writing through h5py."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csc_array, issparse

from sdm_core.blade.exchange.content import bounded_shape
from sdm_core.blade.exchange.named_arrays.mat5 import Unread, checked_sparse
from sdm_core.blade.exchange.parsing.file_bytes import LARGEST_FILE_BYTES
from sdm_core.errors import DamagedFile

# Deflate gains at most about a factor of a thousand; more is a damaged size.
_LARGEST_GAIN = 1100
_DEEPEST = 20
_USER_BLOCK = 512


def read_mat73(path: Path) -> dict[str, Any]:
    """Variables by name, as `mat5.read_mat5` gives them.

    Raises
    ------
    DamagedFile
        For a dataset whose declared size its stored bytes cannot fill, or one kept in another file.
    """
    import h5py

    with h5py.File(path, "r") as file:
        return {name: _value(path, file, name, 0) for name in file if not name.startswith("#")}


def _value(path: Path, group: Any, name: str, depth: int) -> Any:
    import h5py

    where = f"{path.name}: {name}"
    if depth > _DEEPEST:
        raise DamagedFile(where, f"groups nested {depth} deep", "the file is damaged: save it again")
    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        raise DamagedFile(where, "a link to elsewhere", "save the data in the file itself")
    item = group[name]
    if isinstance(item, h5py.Dataset):
        return _dataset(path, where, item, depth)
    if not isinstance(item, h5py.Group):
        return Unread("an HDF5 type")
    if "MATLAB_sparse" in item.attrs:
        parts = {key: _value(path, item, key, depth + 1) for key in item}
        rows, starts = int(item.attrs["MATLAB_sparse"]), np.asarray(parts.get("jc", []))
        bounded_shape(path, name, rows, starts.size - 1, sparse=True)
        empty = np.empty(0, dtype=np.int64)
        return checked_sparse(
            where, (rows, starts.size - 1), parts.get("data", empty), parts.get("ir", empty), starts
        )
    return {key: _value(path, item, key, depth + 1) for key in item}


def _dataset(path: Path, where: str, item: Any, depth: int) -> Any:
    import h5py

    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
    if item.external or item.is_virtual:
        raise DamagedFile(where, "data kept in another file", "save the data in the file itself")
    if item.shape is None:
        return Unread("an empty dataspace")
    if "MATLAB_empty" in item.attrs:
        return [""] if kind == "char" else np.empty((0, 0))
    stored = item.id.get_storage_size()
    declared = item.size * item.dtype.itemsize
    if declared > LARGEST_FILE_BYTES or declared > _LARGEST_GAIN * stored + 4096:
        raise DamagedFile(
            where, f"{declared} bytes declared, {stored} stored", "the file is damaged: save it again"
        )
    if item.dtype == h5py.ref_dtype:
        refs = np.asarray(item[()]).ravel()
        if len(refs) > 10_000:
            return Unread(f"{len(refs)} cells")
        return [_referred(path, where, item.file, ref, depth) for ref in refs]
    if item.dtype.kind not in "iufb":
        return Unread(f"data of type {item.dtype}")
    # MATLAB's columns are HDF5's rows.
    values = np.asarray(item[()]).T
    if kind == "char":
        rows = values if values.ndim == 2 else values.reshape(1, -1)
        return ["".join(chr(c) for c in row) for row in rows.astype(np.uint16).tolist()]
    return values if values.ndim >= 2 else values.reshape(-1, 1)


def _referred(path: Path, where: str, file: Any, ref: Any, depth: int) -> Any:
    if not ref:
        return np.empty((0, 0))
    target = file[ref]
    return _value(path, target.parent, target.name.rpartition("/")[2], depth + 1)


def write_mat73(tree: Mapping[str, Any], path: Path) -> None:
    """Write arrays, sparse arrays, text, lists of text (cells) and dicts (structures) as MATLAB does."""
    import h5py

    with h5py.File(path, "w", userblock_size=_USER_BLOCK, libver="earliest") as file:
        _write_group(file, file, tree)
    head = f"MATLAB 7.3 MAT-file, Platform: rubscreen, Created on: {time.strftime('%a %b %d %H:%M:%S %Y')}"
    head += " HDF5 schema 1.00 ."
    with path.open("r+b") as raw:
        raw.write(head.ljust(116).encode("ascii") + bytes(8) + b"\x00\x02IM")


def _write_group(file: Any, group: Any, tree: Mapping[str, Any]) -> None:
    for name, value in tree.items():
        if isinstance(value, Mapping):
            part = group.create_group(name)
            part.attrs["MATLAB_class"] = np.bytes_("struct")
            _write_group(file, part, value)
        elif issparse(value):
            part = group.create_group(name)
            matrix = csc_array(value)
            part.attrs["MATLAB_class"] = np.bytes_("double")
            part.attrs["MATLAB_sparse"] = np.uint64(matrix.shape[0])
            part["data"] = matrix.data.astype(float)
            part["ir"] = matrix.indices.astype(np.uint64)
            part["jc"] = matrix.indptr.astype(np.uint64)
        elif isinstance(value, list):
            refs = []
            for text in value:
                cells = file.require_group("#refs#")
                cell = _write_text(cells, f"c{len(cells)}", text)
                refs.append(cell.ref)
            part = group.create_dataset(name, data=np.array(refs, dtype=h5_reference()).reshape(-1, 1))
            part.attrs["MATLAB_class"] = np.bytes_("cell")
        elif isinstance(value, str):
            _write_text(group, name, value)
        else:
            part = group.create_dataset(name, data=np.atleast_2d(np.asarray(value, dtype=float)).T)
            part.attrs["MATLAB_class"] = np.bytes_("double")


def h5_reference() -> Any:
    """Type of a reference to an object of the same file."""
    import h5py

    return h5py.ref_dtype


def _write_text(group: Any, name: str, text: str) -> Any:
    letters = np.frombuffer(text.encode("utf-16-le"), "<u2").reshape(-1, 1)
    part = group.create_dataset(name, data=letters)
    part.attrs["MATLAB_class"] = np.bytes_("char")
    part.attrs["MATLAB_int_decode"] = np.int32(2)
    return part

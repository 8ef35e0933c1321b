"""Damaged and foreign files give one error that names file and remedy: never a wrong blade."""

from __future__ import annotations

import io
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import issparse

from sdm_core.blade.exchange import export_blade, read_matrix_model, read_modal, write_model
from sdm_core.blade.matrix_model import MatrixModel

JPEG = bytes.fromhex("ffd8ffe000104a46494600010101004800480000ffdb0043") + bytes(range(256)) * 8
NUMBERS = re.compile(r"(\s*-?\d\.\d{12}E[+-]\d\d)+")
AXIS = {"rotation_axis": (0.0, 0.0, 1.0)}


def dense(matrix) -> np.ndarray:
    return matrix.toarray() if issparse(matrix) else np.array(matrix)


def read(files):
    return read_matrix_model(files, **AXIS)


# Every file format, cut at many places and replaced by other things.


@pytest.fixture
def written(full_model, reduced_model, blade, tmp_path) -> dict[str, Path]:
    """A valid file of each format."""
    paths = {
        "op4": write_model(full_model, tmp_path / "binary.op4").paths[0],
        "op4-ascii": write_model(reduced_model, tmp_path / "text.op4", format="op4-ascii").paths[0],
        "dmig": write_model(reduced_model, tmp_path / "punch.pch").paths[0],
        "mat": write_model(full_model, tmp_path / "v5.mat").paths[0],
        "mat7.3": write_model(full_model, tmp_path / "v73.mat", format="mat7.3").paths[0],
        "npz": write_model(full_model, tmp_path / "model.npz").paths[0],
        "uff": export_blade(blade, tmp_path / "modes.unv").paths[0],
        "csv": export_blade(blade, tmp_path / "modes.csv").paths[0],
        "npz-modal": export_blade(blade, tmp_path / "blade.npz").paths[0],
        "mat-modal": export_blade(blade, tmp_path / "blade.mat").paths[0],
        "json": export_blade(blade, tmp_path / "blade.json").paths[0],
    }
    return paths


FORMATS = ("op4", "op4-ascii", "dmig", "mat", "mat7.3", "npz", "uff", "csv", "npz-modal", "mat-modal", "json")
MODAL = ("uff", "csv", "npz-modal", "mat-modal", "json")


def reader(name: str) -> Callable:
    return read_modal if name in MODAL else read


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("share", [0.001, 0.05, 0.3, 0.5, 0.7, 0.9, 0.99, 0.9999])
def test_a_file_cut_off_anywhere_is_refused(name, share, written, refused):
    path = written[name]
    data = path.read_bytes()
    # The end of the archive formats is padding or a line end, so the last cut takes two bytes at least.
    path.write_bytes(data[: min(int(share * len(data)), len(data) - 2)])
    refused(reader(name), path, path.name)


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize(
    "other",
    [
        b"",
        b"\n",
        JPEG,
        b"PK\x03\x04" + bytes(60),
        b"\x00" * 400,
        b"%PDF-1.7\n1 0 obj\n",
        b"\x18\x00\x00\x00" * 9,
    ],
    ids=["empty", "line", "jpeg", "zip", "zeros", "pdf", "records"],
)
def test_another_kind_of_file_under_the_name_is_refused(name, other, written, refused):
    written[name].write_bytes(other)
    refused(reader(name), written[name], written[name].name)


@pytest.mark.parametrize("name", ["op4-ascii", "dmig", "uff", "csv", "json"])
def test_utf_16_text_is_refused(name, written, refused):
    path = written[name]
    path.write_bytes(path.read_text(encoding="utf-8").encode("utf-16"))
    refused(reader(name), path, path.name)


@pytest.mark.parametrize("name", ["op4-ascii", "dmig", "uff", "csv"])
@pytest.mark.parametrize("other", ["NaN", "Inf", "abc", "1,5", "0x1F", "1_0", "--1"])
def test_no_number_where_a_number_belongs_is_refused(name, other, written, refused):
    path = written[name]
    lines = path.read_text(encoding="utf-8").splitlines()
    numeric = NUMBERS if name == "uff" else re.compile(".*")
    middle = range(len(lines) // 2, len(lines))
    at = next(i for i in middle if "." in lines[i] and numeric.fullmatch(lines[i]))
    line = lines[at]
    dot = line.rindex(".")
    first = max(line.rfind(mark, 0, dot) for mark in " ,") + 1
    if name == "csv":
        end = line.find(",", dot) if "," in line[dot:] else len(line)
        lines[at] = line[:first] + other.replace(",", ";") + line[end:]
    else:
        lines[at] = line[: dot - 1] + other.ljust(5) + line[dot + 4 :]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    refused(reader(name), path, path.name)


# What a matrix may not be, whatever file it comes from.


def stored(model: MatrixModel, folder: Path, k=None, m=None, dofs=None) -> list[Path]:
    """K and M as dense CSV tables with their map."""
    k = dense(model.states[0].stiffness if k is None else k)
    m = dense(model.mass if m is None else m)
    np.savetxt(folder / "K.csv", k, delimiter=",", fmt="%.17g")
    np.savetxt(folder / "M.csv", m, delimiter=",", fmt="%.17g")
    rows = map_rows(model) if dofs is None else dofs
    (folder / "map.csv").write_text("node,component\n" + "".join(f"{n},{c}\n" for n, c in rows))
    return [folder / "K.csv", folder / "M.csv", folder / "map.csv"]


def map_rows(model: MatrixModel) -> list:
    pairs = zip(model.dofs.node.tolist(), model.dofs.component.tolist(), strict=True)
    return [(n, c) if c else ("modal", "") for n, c in pairs]


def with_entry(matrix, i: int, j: int, value: float) -> np.ndarray:
    changed = dense(matrix)
    changed[i, j] = value
    return changed


def unsymmetric(model):
    return {"k": with_entry(model.states[0].stiffness, 2, 7, 1e6)}


def indefinite_mass(model):
    # Off the diagonal, so that every row still has its mass.
    return {"m": with_entry(with_entry(model.mass, 0, 3, 1.0), 3, 0, 1.0)}


def exchanged(model):
    return {"k": model.mass, "m": -dense(model.states[0].stiffness)}


def nan_entry(model):
    return {"k": with_entry(model.states[0].stiffness, 3, 3, np.nan)}


def infinite_entry(model):
    return {"m": with_entry(model.mass, 3, 3, np.inf)}


def other_size(model):
    return {"m": dense(model.mass)[:-1, :-1]}


def negative_stiffness(model):
    return {"k": -dense(model.states[0].stiffness)}


def massless_row(model):
    m = dense(model.mass)
    m[4, :] = m[:, 4] = 0.0
    return {"m": m}


def zero_stiffness(model):
    return {"k": 0 * dense(model.mass)}


def row_of_map_twice(model):
    rows = map_rows(model)
    return {"dofs": [rows[1], *rows[1:]]}


def short_map(model):
    rows = map_rows(model)
    return {"dofs": rows[:-1]}


def component_seven(model):
    rows = map_rows(model)
    return {"dofs": [(rows[0][0], 7), *rows[1:]]}


def modal_rows_only(model):
    return {"dofs": [("modal", "")] * len(model.dofs)}


def overflowing(model):
    return {"k": with_entry(model.states[0].stiffness, 0, 0, 1e300)}


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (unsymmetric, ("K.csv", "unsymmetric", "symmetric")),
        (indefinite_mass, ("mass", "negative eigenvalue")),
        (exchanged, ("diagonal",)),
        (nan_entry, ("K.csv", "nan")),
        (infinite_entry, ("M.csv", "inf")),
        (other_size, ("20 in the mass",)),
        (negative_stiffness, ("negative ω²",)),
        (massless_row, ("row 5", "node", "condense")),
        (zero_stiffness, ("K.csv", "zero")),
        (row_of_map_twice, ("twice",)),
        (short_map, ("20 rows in map.csv",)),
        (component_seven, ("map.csv", "1 to 6")),
        (modal_rows_only, ("modal",)),
        (overflowing, ("K.csv",)),
    ],
)
def test_matrices_that_make_no_blade_are_refused(damage, words, reduced_model, tmp_path, refused):
    damaged = damage(reduced_model)
    refused(read, stored(reduced_model, tmp_path, **damaged), *words)


def test_without_mass_stiffness_or_map_the_missing_one_is_named(full_model, tmp_path, refused):
    k, m, dofs = stored(full_model, tmp_path)
    refused(read, [k, dofs], "mass", "missing")
    refused(read, [m, dofs], "stiffness", "missing")
    refused(read, [k, m], "dofs", "node,component")
    refused(read, [dofs], "mass", "missing")
    refused(lambda f: read_matrix_model(f, mass="MX", **AXIS), [k, m, dofs], "MX", "K.csv")
    refused(lambda f: read_matrix_model(f, units="inch", **AXIS), [k, m, dofs], "units", "mm-t-s")
    refused(lambda f: read_matrix_model(f, rotation_axis=(0, 0, 0)), [k, m, dofs], "rotation_axis")
    refused(read, [k, m, dofs, tmp_path / "none.csv"], "none.csv", "readable")
    refused(read, [k, m, dofs, tmp_path], "not a file")
    (tmp_path / "a.xyz").write_text("1\n")
    refused(read, tmp_path / "a.xyz", "a.xyz", "format")


# Sizes that a few bytes declare must not be allocated.


def big_output4(text: bool) -> bytes:
    if text:
        return (
            f"{2_000_000:8}{2_000_000:8}{2:8}{2:8}{'K':8}1P,3E23.16\n" + f"{1:8}{1:8}{2_000_000:8}\n 1.0\n"
        ).encode()
    head = struct.pack("<4i8s", 2_000_000, -2_000_000, 6, 2, b"K       ")
    return struct.pack("<i", 24) + head + struct.pack("<i", 24) + struct.pack("<i", 2**30)


def big_mat5() -> bytes:
    body = struct.pack("<IIII", 6, 8, 6, 0) + struct.pack("<IIii", 5, 8, 40_000, 40_000)
    body += struct.pack("<HH4s", 1, 1, b"K\0\0\0") + struct.pack("<II", 9, 2**31)
    start = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return start + struct.pack("<II", 14, len(body)) + body


def bomb_mat5() -> bytes:
    packed = zlib.compress(struct.pack("<II", 14, 2**31 - 1) + bytes(50_000_000))
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + struct.pack("<II", 15, len(packed)) + packed


def big_npz() -> bytes:
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (3000000, 3000000), }"
    array = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header) + 1) + header + b"\n" + bytes(64)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("K.npy", array)
    return out.getvalue()


def big_hdf5(folder: Path) -> bytes:
    import h5py

    with h5py.File(folder / "big.h5", "w", userblock_size=512) as file:
        file.create_dataset("K", shape=(1_000_000, 1_000_000), dtype="f8", chunks=(10, 10))
        file.create_dataset("M", data=np.eye(2))
    return (folder / "big.h5").read_bytes()


@pytest.mark.parametrize(
    ("name", "make"),
    [
        ("a.op4", lambda _: big_output4(True)),
        ("a.op4", lambda _: big_output4(False)),
        ("a.mat", lambda _: big_mat5()),
        ("a.mat", lambda _: bomb_mat5()),
        ("a.mat", big_hdf5),
        ("a.npz", lambda _: big_npz()),
        ("K.mtx", lambda _: b"%%MatrixMarket matrix array real general\n900000 900000\n1.0\n"),
        ("K.mtx", lambda _: b"%%MatrixMarket matrix coordinate real general\n9 9 99999999999\n1 1 1.0\n"),
        ("a.sti", lambda _: b"1 1 1.0\n2000000000 2000000000 1.0\n"),
        ("K.csv", lambda _: b"row,column,value\n1,1,1.0\n2500000,2500000,1.0\n"),
        (
            "a.unv",
            lambda _: b"    -1\n    58b     1     2          11  9999999999     0     0\n" + b"x\n" * 30,
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_declared_size_beyond_the_file_is_not_allocated(name, make, tmp_path, refused):
    import resource

    path = tmp_path / name
    path.write_bytes(make(tmp_path))
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 2**30, before[1]))
    try:
        error = refused(read_modal if name.endswith("unv") else read, path, name)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
    assert "more memory" not in str(error)

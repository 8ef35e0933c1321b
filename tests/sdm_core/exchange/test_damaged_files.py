"""Damaged and foreign files give one error that names file and remedy: never a wrong blade."""

from __future__ import annotations

import io
import json
import pickle
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_array, issparse

from sdm_core.blade.exchange import export_blade, read_matrix_model, read_modal, write_model
from sdm_core.blade.matrix_model import MatrixModel
from sdm_core.errors import DamagedFile, InvalidInput

JPEG = bytes.fromhex("ffd8ffe000104a46494600010101004800480000ffdb0043") + bytes(range(256)) * 8
NUMBERS = re.compile(r"(\s*-?\d\.\d{12}E[+-]\d\d)+")
AXIS = {"rotation_axis": (0.0, 0.0, 1.0)}


def dense(matrix) -> np.ndarray:
    return matrix.toarray() if issparse(matrix) else np.array(matrix)


def refused(read: Callable, files, capfd, *words: str) -> InvalidInput:
    """The one error of a file, which says all the words and prints nothing."""
    with pytest.raises(InvalidInput) as caught:
        read(files)
    text = str(caught.value)
    for word in words:
        assert word in text, text
    assert caught.value.remedy
    assert len(text) < 600
    assert capfd.readouterr() == ("", "")
    return caught.value


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
def test_a_file_cut_off_anywhere_is_refused(name, share, written, capfd):
    path = written[name]
    data = path.read_bytes()
    # The end of the archive formats is padding or a line end, so the last cut takes two bytes at least.
    path.write_bytes(data[: min(int(share * len(data)), len(data) - 2)])
    refused(reader(name), path, capfd, path.name)


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
def test_another_kind_of_file_under_the_name_is_refused(name, other, written, capfd):
    written[name].write_bytes(other)
    refused(reader(name), written[name], capfd, written[name].name)


@pytest.mark.parametrize("name", ["op4-ascii", "dmig", "uff", "csv", "json"])
def test_utf_16_text_is_refused(name, written, capfd):
    path = written[name]
    path.write_bytes(path.read_text(encoding="utf-8").encode("utf-16"))
    refused(reader(name), path, capfd, path.name)


@pytest.mark.parametrize("name", ["op4-ascii", "dmig", "uff", "csv"])
@pytest.mark.parametrize("other", ["NaN", "Inf", "abc", "1,5", "0x1F", "1_0", "--1"])
def test_no_number_where_a_number_belongs_is_refused(name, other, written, capfd):
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
    refused(reader(name), path, capfd, path.name)


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
        (indefinite_mass, ("mass", "positive definite")),
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
def test_matrices_that_make_no_blade_are_refused(damage, words, reduced_model, tmp_path, capfd):
    damaged = damage(reduced_model)
    refused(read, stored(reduced_model, tmp_path, **damaged), capfd, *words)


def test_without_mass_stiffness_or_map_the_missing_one_is_named(full_model, tmp_path, capfd):
    k, m, dofs = stored(full_model, tmp_path)
    refused(read, [k, dofs], capfd, "mass", "missing")
    refused(read, [m, dofs], capfd, "stiffness", "missing")
    refused(read, [k, m], capfd, "dofs", "node,component")
    refused(read, [dofs], capfd, "mass", "missing")
    refused(lambda f: read_matrix_model(f, mass="MX", **AXIS), [k, m, dofs], capfd, "MX", "K.csv")
    refused(lambda f: read_matrix_model(f, units="inch", **AXIS), [k, m, dofs], capfd, "units", "mm-t-s")
    refused(lambda f: read_matrix_model(f, rotation_axis=(0, 0, 0)), [k, m, dofs], capfd, "rotation_axis")
    refused(read, [k, m, dofs, tmp_path / "none.csv"], capfd, "none.csv", "readable")
    refused(read, [k, m, dofs, tmp_path], capfd, "not a file")
    (tmp_path / "a.xyz").write_text("1\n")
    refused(read, tmp_path / "a.xyz", capfd, "a.xyz", "format")


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
def test_a_declared_size_beyond_the_file_is_not_allocated(name, make, tmp_path, capfd):
    import resource

    path = tmp_path / name
    path.write_bytes(make(tmp_path))
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 2**30, before[1]))
    try:
        error = refused(read_modal if name.endswith("unv") else read, path, capfd, name)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
    assert "more memory" not in str(error)


# Traps of one format each.


def test_matlab_text_cells_and_objects_are_no_matrices(tmp_path, capfd):
    cells = np.empty((1, 2), dtype=object)
    cells[0, :] = ["a", "b"]
    savemat(tmp_path / "a.mat", {"K": cells, "M": "text"})
    refused(read, tmp_path / "a.mat", capfd, "a.mat", "no matrix", "numeric")
    savemat(tmp_path / "a.mat", {"K": np.eye(2) * 1j, "M": np.eye(2), "dofs": [[1, 1], [1, 2]]})
    refused(read, tmp_path / "a.mat", capfd, "stiffness", "missing")


def test_a_matlab_object_is_left_alone_and_named(full_model, tmp_path, capfd):
    # An opaque object (class 17) after the numbers, as tables and strings are stored.
    path = write_model(full_model, tmp_path / "a.mat").paths[0]
    body = struct.pack("<IIII", 6, 8, 17, 0) + struct.pack("<II", 1, 8) + b"mytable\0"
    path.write_bytes(path.read_bytes() + struct.pack("<II", 14, len(body)) + body)
    found = read(path).findings
    assert any("mytable" in str(item) and "object" in str(item) for item in found.items)
    assert capfd.readouterr() == ("", "")


def test_a_version_7_3_file_with_other_data_types_links_or_outside_storage_is_refused(tmp_path, capfd):
    import h5py

    path = tmp_path / "a.mat"

    def file() -> h5py.File:
        return h5py.File(path, "w", userblock_size=512)

    with file() as f:
        f["K"] = np.array([b"text", b"more"])
    refused(read, path, capfd, "a.mat", "no matrix")
    with file() as f:
        f["K"] = h5py.ExternalLink("/etc/hostname", "K")
    refused(read, path, capfd, "a.mat: K", "elsewhere")
    with file() as f:
        f.create_dataset("K", (2, 2), "f8", external=[(str(tmp_path / "outside.bin"), 0, 32)])
    (tmp_path / "outside.bin").write_bytes(bytes(32))
    refused(read, path, capfd, "a.mat: K", "another file")
    with file() as f:
        f["K"] = h5py.SoftLink("/K")
    refused(read, path, capfd, "a.mat: K")
    with file() as f:
        group = f.create_group("loop")
        group["loop"] = group
    refused(read, path, capfd, "a.mat", "deep")


def test_a_sparse_matrix_whose_columns_do_not_fit_is_refused(full_model, tmp_path, capfd):
    import h5py

    path = write_model(full_model, tmp_path / "a.mat", format="mat7.3").paths[0]
    with h5py.File(path, "r+") as file:
        file["K1/ir"][3] = 10**9
    refused(read, path, capfd, "a.mat: K1", "do not fit")


class Trap:
    """Runs when it is unpickled."""

    def __reduce__(self):
        return (print, ("unpickled",))


def test_pickled_objects_in_an_archive_are_never_unpickled(tmp_path, capfd):
    np.savez(tmp_path / "a.npz", K=np.array([Trap()], dtype=object), M=np.eye(2))
    refused(read, tmp_path / "a.npz", capfd, "a.npz: K.npy", "objects")
    (tmp_path / "b.npz").write_bytes(pickle.dumps(Trap()))
    refused(read, tmp_path / "b.npz", capfd, "b.npz", "no .npz")
    with zipfile.ZipFile(tmp_path / "c.npz", "w") as archive:
        archive.writestr("K.npy", b"\x93NUMPY\x01\x00" + b"\xff" * 30)
    refused(read, tmp_path / "c.npz", capfd, "c.npz")
    with zipfile.ZipFile(tmp_path / "d.npz", "w") as archive:
        archive.writestr("../../K.txt", b"1")
    refused(read, tmp_path / "d.npz", capfd, "d.npz")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("GRID,1,,0.,0.,0.\n", ("no DMIG",)),
        ("DMIG,K,0,6,2,0,,,2\nDMIG,K,1,1,,1,1,2.0\nDMIG,K,2,1\n", ("continuation",)),
        ("DMIG,K,0,6,2,0,,,2\nDMIG,K,1,1,,1\n", ("line 2", "number")),
        ("DMIG,K,0,6,4,0,,,2\nDMIG,K,1,1,,1,1,2.0\n", ("complex",)),
        ("DMIG,K,1,1,,1,1,2.0\n", ("header",)),
        ("DMIG,K,0,6,2,0,,,2\n", ("no column",)),
        ("DMIG,K,0,6,2,0,,,2\nDMIG,K,1,1,,1,1,2.0,,\n,1,1,3.0\n", ("twice",)),
        ("DMIG,K,0,6,2,0,,,2\nDMIG,K,1,9,,1,1,2.0\n", ("component 9",)),
        ("        1.0     2.0\n", ("continues no entry",)),
        (
            "DMIG,K,0,6,2,0,,,2\nDMIG,K,1,1,,1,1,2.0\nDMIG,M,0,6,2,0,,,2\nDMIG,M,1,1,,1,1,2.0\nGRID,1,5,0.,0.,0.\n",
            ("system 5", "basic"),
        ),
    ],
)
def test_bulk_data_with_missing_or_wrong_parts_is_refused(text, words, tmp_path, capfd):
    (tmp_path / "a.bdf").write_text(text)
    refused(read, tmp_path / "a.bdf", capfd, "a.bdf", *words)


def uff(*datasets: str) -> str:
    return "".join(f"    -1\n{text}    -1\n" for text in datasets)


MODE = (
    "    55\nNONE\nNONE\nNONE\nNONE\nNONE\n         1         2         2         8         2         3\n"
    "         2         4         1         1\n  1.00000E+02  1.00000E+00  1.00000E-03  0.00000E+00\n"
    "         1\n  1.00000E+00  0.00000E+00  0.00000E+00\n"
)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (uff("  2420\n 1\n", "   999\nabc\n"), ("no normal modes", "999")),
        (uff("   151\nname\n"), ("no normal modes",)),
        (uff(MODE.replace("         1         2         2", "         1         3         2")), ("complex",)),
        (uff(MODE.replace("  1.00000E+00  1.00000E-03", "  0.00000E+00  1.00000E-03")), ("modal mass",)),
        (uff(MODE, MODE), ("node 1",)),
        (uff(MODE.replace("1.00000E+02", "-1.0000E+02")), ("frequency_hz",)),
        (uff(MODE.replace("  1.00000E+00  0.00000E+00  0.00000E+00\n", "  1.00000E+00\n")), ("55",)),
        (uff("   164\n         9\n" + f"{'1.0D+03':>25}" * 3 + "\n", MODE), ("millimetres",)),
        (uff(MODE.replace("         8         2", "        12         2")), ("displacements",)),
    ],
)
def test_universal_files_with_other_content_are_refused(text, words, tmp_path, capfd):
    from sdm_core.blade.tip_line import TipLine

    tip = TipLine(("A",), (1,), np.array([[1.0, 0, 0]]))
    (tmp_path / "a.unv").write_text(text)
    refused(lambda f: read_modal(f, tip=tip), tmp_path / "a.unv", capfd, *words)


GOOD_TABLE = (
    "mode,frequency_hz,damping_ratio,node,amplitude\n"
    "1,100,1e-3,LE,2.5\n1,100,1e-3,TE,2\n2,300,1e-3,LE,1\n2,300,1e-3,TE,-3\n"
)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GOOD_TABLE.replace("2,300,1e-3,TE,-3\n", ""), ("3 rows",)),
        (GOOD_TABLE.replace("2,300,1e-3,TE,-3", "2,300,1e-3,TE"), ("4 cells",)),
        (GOOD_TABLE.replace("2,300,1e-3,TE,-3", "2,301,1e-3,TE,-3"), ("frequency_hz", "different")),
        (GOOD_TABLE.replace(",", ";").replace("2.5", "2,5"), ("decimal point",)),
        (GOOD_TABLE.replace("2.5", "2,5"), ("6 cells",)),
        (GOOD_TABLE.replace("amplitude", "ampl"), ("amplitude",)),
        (GOOD_TABLE.replace("300", "-300"), ("frequency_hz",)),
        (GOOD_TABLE.replace("1e-3", "1.5"), ("damping_ratio",)),
        (GOOD_TABLE.replace("damping_ratio,", "").replace("1e-3,", ""), ("damping_ratio", "missing")),
        (GOOD_TABLE.replace("2,300", "2.5,300"), ("whole number",)),
        (GOOD_TABLE[:-1], ("cut off",)),
        (GOOD_TABLE.replace("-3", '"-3'), ("a.csv",)),
        ("mode,frequency_hz,node,amplitude\n", ("header only",)),
    ],
)
def test_tables_of_modal_data_with_mistakes_are_refused(text, words, tmp_path, capfd):
    (tmp_path / "a.csv").write_text(text)
    refused(read_modal, tmp_path / "a.csv", capfd, *words)


def test_the_table_without_mistakes_is_read(tmp_path):
    (tmp_path / "a.csv").write_text("\ufeff" + GOOD_TABLE.replace(",", ";"), encoding="utf-8")
    blade = read_modal(tmp_path / "a.csv").blade
    assert blade.tip_nodes == ("LE", "TE")
    assert blade.states[0].mode_shape.tolist() == [[2.5, 2.0], [1.0, -3.0]]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("K.csv", "1,2\n2\n", ("line 2", "1 cells")),
        ("K.csv", "1,2\n2,x\n", ("line 2", "number")),
        ("K.csv", "1,2,3\n2,1,3\n", ("square",)),
        ("K.csv", "row,column,value\n1,1,2\n1,1,3\n", ("twice",)),
        ("K.csv", "row,column,value\n0,1,2\n", ("from 1",)),
        ("K.csv", "a,b\n1,2\n", ("header", "row,column,value")),
        ("K.mtx", "%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 0\n", ("complex",)),
        ("K.mtx", "%%MatrixMarket matrix coordinate pattern general\n1 1 1\n1 1\n", ("pattern",)),
        ("K.mtx", "%%MatrixMarket matrix coordinate real general\n2 2 3\n1 1 1\n2 2 1\n", ("3 entries",)),
        ("K.mtx", "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n3 2 1\n", ("K.mtx",)),
        ("K.mtx", "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n2 2 nan\n", ("K.mtx",)),
        ("K.mtx", "%%MatrixMarket\n", ("no Matrix Market",)),
        ("a.sti", "1 1 1.0\n1 2\n", ("line 2",)),
        ("a.sti", "1 1 1.0\n1 2 x\n", ("line 2", "number")),
        ("a.dof", "1.1\n1.7\n", ("line 2", "node.component")),
        ("a.inp", "*NODE\n1, 0., 0., 0.\n1, 1., 0., 0.\n", ("twice",)),
    ],
)
def test_matrix_tables_with_mistakes_are_refused(name, text, words, tmp_path, capfd):
    (tmp_path / name).write_text(text)
    (tmp_path / "M.csv").write_text("1,0\n0,1\n")
    (tmp_path / "map.csv").write_text("node,component\n1,1\n1,2\n")
    if words == ("K.mtx",) and "nan" in text:
        words = ("K.mtx", "NaN")
    refused(read, [tmp_path / name, tmp_path / "M.csv", tmp_path / "map.csv"], capfd, *words)


def test_errors_of_damage_are_told_from_errors_of_content(full_model, tmp_path):
    path = write_model(full_model, tmp_path / "a.op4").paths[0]
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(DamagedFile, match="cut off"):
        read(path)


def test_a_blade_file_with_another_schema_is_refused(tmp_path, capfd):
    (tmp_path / "a.json").write_text(json.dumps({"schema": "other/1"}))
    refused(read_modal, tmp_path / "a.json", capfd, "a.json", "schema")


def test_a_sparse_matrix_is_read_dense_where_it_is_full(full_model, tmp_path):
    # Not damage: what is written must not depend on how it is kept.
    path = write_model(full_model, tmp_path / "a.bdf").paths[0]
    assert isinstance(read(path).model.mass, csc_array)

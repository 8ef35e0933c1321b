"""Traps of one format each: what a file of the right kind may hold that is no blade."""

from __future__ import annotations

import json
import pickle
import struct
import zipfile

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_array

from sdm_core.blade.exchange import read_matrix_model, read_modal, write_model
from sdm_core.blade.exchange.content import arrays_of_model
from sdm_core.blade.tip_line import TipLine
from sdm_core.errors import DamagedFile


def read(files):
    return read_matrix_model(files, rotation_axis=(0.0, 0.0, 1.0))


def test_an_uncompressed_matlab_file_cut_off_says_what_is_missing(full_model, tmp_path, refused):
    path = tmp_path / "a.mat"
    savemat(path, arrays_of_model(full_model))
    path.write_bytes(path.read_bytes()[:-20_000])
    refused(read, path, "a.mat", "bytes declared")


def test_matlab_text_cells_and_objects_are_no_matrices(tmp_path, refused):
    cells = np.empty((1, 2), dtype=object)
    cells[0, :] = ["a", "b"]
    savemat(tmp_path / "a.mat", {"K": cells, "M": "text"})
    refused(read, tmp_path / "a.mat", "a.mat", "no matrix", "numeric")
    savemat(tmp_path / "a.mat", {"K": np.eye(2) * 1j, "M": np.eye(2), "dofs": [[1, 1], [1, 2]]})
    refused(read, tmp_path / "a.mat", "stiffness", "missing")


def test_a_matlab_object_is_left_alone_and_named(full_model, tmp_path, capfd):
    # An opaque object (class 17) after the numbers, as tables and strings are stored.
    path = write_model(full_model, tmp_path / "a.mat").paths[0]
    body = struct.pack("<IIII", 6, 8, 17, 0) + struct.pack("<II", 1, 8) + b"mytable\0"
    path.write_bytes(path.read_bytes() + struct.pack("<II", 14, len(body)) + body)
    found = read(path).findings
    assert any("mytable" in str(item) and "object" in str(item) for item in found.items)
    assert capfd.readouterr() == ("", "")


def test_a_version_7_3_file_with_other_data_types_links_or_outside_storage_is_refused(tmp_path, refused):
    import h5py

    path = tmp_path / "a.mat"

    def file() -> h5py.File:
        return h5py.File(path, "w", userblock_size=512)

    with file() as f:
        f["K"] = np.array([b"text", b"more"])
    refused(read, path, "a.mat", "no matrix")
    with file() as f:
        f["K"] = h5py.ExternalLink("/etc/hostname", "K")
    refused(read, path, "a.mat: K", "elsewhere")
    with file() as f:
        f.create_dataset("K", (2, 2), "f8", external=[(str(tmp_path / "outside.bin"), 0, 32)])
    (tmp_path / "outside.bin").write_bytes(bytes(32))
    refused(read, path, "a.mat: K", "another file")
    with file() as f:
        f["K"] = h5py.SoftLink("/K")
    refused(read, path, "a.mat: K")
    with file() as f:
        group = f.create_group("loop")
        group["loop"] = group
    refused(read, path, "a.mat", "deep")


def test_a_sparse_matrix_whose_columns_do_not_fit_is_refused(full_model, tmp_path, refused):
    import h5py

    path = write_model(full_model, tmp_path / "a.mat", format="mat7.3").paths[0]
    with h5py.File(path, "r+") as file:
        file["K1/ir"][3] = 10**9
    refused(read, path, "a.mat: K1", "do not fit")


class Trap:
    """Runs when it is unpickled."""

    def __reduce__(self):
        return (print, ("unpickled",))


def test_pickled_objects_in_an_archive_are_never_unpickled(tmp_path, refused):
    np.savez(tmp_path / "a.npz", K=np.array([Trap()], dtype=object), M=np.eye(2))
    refused(read, tmp_path / "a.npz", "a.npz: K.npy", "objects")
    (tmp_path / "b.npz").write_bytes(pickle.dumps(Trap()))
    refused(read, tmp_path / "b.npz", "b.npz", "no .npz")
    with zipfile.ZipFile(tmp_path / "c.npz", "w") as archive:
        archive.writestr("K.npy", b"\x93NUMPY\x01\x00" + b"\xff" * 30)
    refused(read, tmp_path / "c.npz", "c.npz")
    with zipfile.ZipFile(tmp_path / "d.npz", "w") as archive:
        archive.writestr("../../K.txt", b"1")
    refused(read, tmp_path / "d.npz", "d.npz")


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
def test_bulk_data_with_missing_or_wrong_parts_is_refused(text, words, tmp_path, refused):
    (tmp_path / "a.bdf").write_text(text)
    refused(read, tmp_path / "a.bdf", "a.bdf", *words)


def test_a_stiffness_whose_rotor_speed_was_lost_is_not_left_out_silently(reduced_model, tmp_path, refused):
    path = write_model(reduced_model, tmp_path / "a.pch").paths[0]
    path.write_text(path.read_text().replace("$ SPEED_HZ KAAX2", "$ SPEED?HZ KAAX2"))
    refused(read, path, "a.pch: KAAX2", "without rotor speed")
    found = read_matrix_model(path, stiffness={0.0: "KAAX1"})
    assert len(found.model.states) == 1


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
def test_universal_files_with_other_content_are_refused(text, words, tmp_path, refused):
    tip = TipLine(("A",), (1,), np.array([[1.0, 0, 0]]))
    (tmp_path / "a.unv").write_text(text)
    refused(lambda f: read_modal(f, tip=tip), tmp_path / "a.unv", *words)


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
def test_tables_of_modal_data_with_mistakes_are_refused(text, words, tmp_path, refused):
    (tmp_path / "a.csv").write_text(text)
    refused(read_modal, tmp_path / "a.csv", *words)


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
def test_matrix_tables_with_mistakes_are_refused(name, text, words, tmp_path, refused):
    (tmp_path / name).write_text(text)
    (tmp_path / "M.csv").write_text("1,0\n0,1\n")
    (tmp_path / "map.csv").write_text("node,component\n1,1\n1,2\n")
    if words == ("K.mtx",) and "nan" in text:
        words = ("K.mtx", "NaN")
    refused(read, [tmp_path / name, tmp_path / "M.csv", tmp_path / "map.csv"], *words)


def test_errors_of_damage_are_told_from_errors_of_content(full_model, tmp_path):
    path = write_model(full_model, tmp_path / "a.op4").paths[0]
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(DamagedFile, match="cut off"):
        read(path)


def test_a_blade_file_with_another_schema_is_refused(tmp_path, refused):
    (tmp_path / "a.json").write_text(json.dumps({"schema": "other/1"}))
    refused(read_modal, tmp_path / "a.json", "a.json", "schema")


def test_a_sparse_matrix_is_read_dense_where_it_is_full(full_model, tmp_path):
    # Not damage: what is written must not depend on how it is kept.
    path = write_model(full_model, tmp_path / "a.bdf").paths[0]
    assert isinstance(read(path).model.mass, csc_array)

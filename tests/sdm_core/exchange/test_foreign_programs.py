"""Files written, and read, by other programs' libraries agree with ours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg
from scipy.io import loadmat, mmwrite, savemat
from scipy.sparse import csc_array, issparse

from sdm_core.blade.exchange import export_blade, read_matrix_model, read_modal, write_model
from sdm_core.blade.exchange.nastran.dmig import read_dmig
from sdm_core.blade.exchange.nastran.op4 import read_op4
from sdm_core.blade.matrix_model import SpeedState
from sdm_core.blade.tip_line import TipLine
from sdm_core.errors import InvalidInput

AXIS = {"rotation_axis": (0.0, 0.0, 1.0)}


def oracle(module: str):
    """Another program's module; how numbers are printed, which one of them changes on import, is put back."""
    with np.printoptions():
        return pytest.importorskip(module)


def dense(matrix) -> np.ndarray:
    return matrix.toarray() if issparse(matrix) else np.asarray(matrix)


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("layout", ["dense", "bigmat", "nonbigmat"])
@pytest.mark.parametrize("order", ["<", ">"])
def test_output4_of_another_library_reads_to_the_last_bit(binary, layout, order, full_model, tmp_path):
    op4 = oracle("pyyeti.nastran.op4")
    matrices = {"KAA": full_model.states[0].stiffness.toarray(), "MAA": full_model.mass.toarray()}
    path = tmp_path / "a.op4"
    op4.write(str(path), matrices, binary=binary, sparse=layout, endian=order)
    read = read_op4(path).matrices
    for name, matrix in matrices.items():
        assert np.array_equal(dense(read[name]), matrix)


@pytest.mark.parametrize("form", ["op4", "op4-ascii"])
def test_another_library_reads_our_output4(form, full_model, reduced_model, tmp_path):
    op4 = oracle("pyyeti.nastran.op4")
    for model in (full_model, reduced_model):
        write_model(model, tmp_path / "a.op4", format=form)
        read = op4.read(str(tmp_path / "a.op4"))
        assert np.array_equal(dense(read["m"]), dense(model.mass))
        assert np.array_equal(dense(read["k2"]), dense(model.states[1].stiffness))


def test_output4_as_nastran_writes_it_by_default_is_read(tmp_path):
    # Five fields of sixteen characters, numbers without blanks between them, form 6, single precision.
    head = "       2       2       6       1KAA     "
    body = "       1       1       2\n 2.000000000E+00-1.000000000E+00\n       2       1       2\n"
    body += "-1.000000000E+00 3.000000000E+00\n       3       1       1\n 1.000000000E+00\n"
    (tmp_path / "a.op4").write_text(f"{head}\n{body}")
    assert np.array_equal(read_op4(tmp_path / "a.op4").matrices["KAA"], [[2, -1], [-1, 3]])


def test_another_library_reads_our_dmig(reduced_model, tmp_path):
    bulk = oracle("pyyeti.nastran.bulk")
    write_model(reduced_model, tmp_path / "a.bdf")
    read = bulk.rddmig(str(tmp_path / "a.bdf"))
    whole = np.asarray(read["kaax1"]) + np.asarray(read["kaax1r"])
    assert np.array_equal(whole, reduced_model.states[0].stiffness)
    first = np.asarray(read["kaax1"])
    assert abs(first - whole).max() < 1e-13 * abs(whole).max()


def test_we_read_dmig_of_another_library(reduced_model, tmp_path):
    bulk = oracle("pyyeti.nastran.bulk")
    import pandas as pd

    nodes = reduced_model.dofs.node.copy()
    nodes[9:] = 9001 + np.arange(12)
    index = pd.MultiIndex.from_arrays([nodes, reduced_model.dofs.component], names=["id", "dof"])
    frames = {
        name: pd.DataFrame(matrix, index=index, columns=index)
        for name, matrix in (("KAAX", reduced_model.states[0].stiffness), ("MAAX", reduced_model.mass))
    }
    path = tmp_path / "a.pch"
    with path.open("w") as file:
        for name, frame in frames.items():
            bulk.wtdmig(file, {name: frame})
    content = read_dmig(path)
    for name, matrix in (("KAAX", reduced_model.states[0].stiffness), ("MAAX", reduced_model.mass)):
        assert abs(dense(content.matrices[name]) - matrix).max() < 1e-9 * abs(matrix).max()
    assert np.array_equal(content.dofs.component, reduced_model.dofs.component)


def test_bulk_data_in_small_free_and_large_fields_say_the_same(tmp_path):
    small = (
        "GRID    11              1.5     -2.-1   .25\n"
        "GRID,12,,2.5,0.,1.+1\n"
        "DMIG    KAAX    0       6       1       0                       4\n"
        "DMIG    KAAX    11      1               11      1       2.5+3\n"
        "        12      3       -1.5\n"
        "DMIG,KAAX,12,3,,12,3,4.D0,\n"
    )
    large = (
        "GRID*                 11                             1.5            -.20\n"
        "*                    .25\n"
        "GRID*,12,,2.5,0.\n*,10.\n"
        "DMIG    KAAX    0       6       2       0                       4\n"
        "DMIG*   KAAX                          11               1\n"
        "*                     11               1          2500.0\n"
        "*                     12               3    -1.500000+00\n"
        "DMIG*   KAAX                          12               3\n"
        "*                     12               3     4.0D+00\n"
        "ENDDATA\n"
    )
    for i, text in enumerate((small, "NASTRAN SYSTEM\nCEND\nBEGIN BULK\n" + large)):
        path = tmp_path / f"{i}.bdf"
        path.write_text(text)
        content = read_dmig(path)
        assert np.array_equal(dense(content.matrices["KAAX"]), [[2500.0, -1.5], [-1.5, 4.0]])
        assert content.positions == {11: (1.5, -0.2, 0.25), 12: (2.5, 0.0, 10.0)}
        assert (content.dofs.node.tolist(), content.dofs.component.tolist()) == ([11, 12], [1, 3])


@pytest.mark.parametrize("kind", ["CORD2R", "CORD2C", "CORD2S"])
def test_nodes_in_systems_of_their_own_are_turned_to_x_y_z(kind, full_model, tip, tmp_path):
    """The same beam with places and displacements along a system that is shifted and turned."""
    origin = np.array([0.02, -0.01, -0.3])
    a, b = origin, origin + np.array([0.1, 0.0, 1.0])
    c = origin + np.array([1.0, 0.5, 0.0])
    e3 = (b - a) / np.linalg.norm(b - a)
    e2 = np.cross(e3, c - a) / np.linalg.norm(np.cross(e3, c - a))
    axes = np.column_stack((np.cross(e2, e3), e2, e3))
    points, rotations = {}, []
    for node, place in full_model.node_position_m.items():
        x, y, z = axes.T @ (np.array(place) - origin)
        rho, r = np.hypot(x, y), np.linalg.norm((x, y, z))
        theta = np.degrees(np.arctan2(y, x))
        if kind == "CORD2R":
            points[node], local = (x, y, z), np.eye(3)
        elif kind == "CORD2C":
            points[node] = (rho, theta, z)
            local = np.array([[x / rho, -y / rho, 0], [y / rho, x / rho, 0], [0, 0, 1]])
        else:
            points[node] = (r, np.degrees(np.arctan2(rho, z)), theta)
            out, around = np.array([x, y, z]) / r, np.array([-y, x, 0]) / rho
            local = np.column_stack((out, np.cross(around, out), around))
        if node in set(full_model.dofs.node.tolist()):
            rotations.append(axes @ local)
    turn = linalg.block_diag(*rotations)

    def along(matrix) -> np.ndarray:
        turned = turn.T @ dense(matrix) @ turn
        return (turned + turned.T) / 2

    states = (SpeedState(0.0, along(full_model.states[0].stiffness)),)
    path = write_model(
        replace(full_model, mass=along(full_model.mass), states=states, node_position_m={}),
        tmp_path / "a.bdf",
    ).paths[0]
    cards = (
        f"{kind},3,0," + ",".join(f"{v:.17g}" for v in (*a, *b)) + "\n," + ",".join(f"{v:.17g}" for v in c)
    )
    cards += "".join(f"\nGRID,{n},3,{p[0]:.17g},{p[1]:.17g},{p[2]:.17g},3" for n, p in points.items())
    cards += "\nGRID,99999,7,0.,0.,0.\n"  # of no matrix, in a system that is not here
    path.write_text(path.read_text().replace("BEGIN BULK\n", "BEGIN BULK\n" + cards))
    found = read_matrix_model(path, tip_nodes=tip.nodes)
    scale = abs(full_model.states[0].stiffness).max()
    assert abs(dense(found.model.states[0].stiffness) - full_model.states[0].stiffness).max() < 1e-12 * scale
    for node, place in full_model.node_position_m.items():
        assert found.model.node_position_m[node] == pytest.approx(place, abs=1e-14)
    assert any("48 nodes turned" in str(item) for item in found.findings.items)
    path.write_text(path.read_text().replace(f"{kind},3,", f"{kind},4,"))
    with pytest.raises(InvalidInput, match="system 3"):
        read_matrix_model(path)


def test_another_library_reads_our_universal_file(blade, tmp_path):
    pyuff = oracle("pyuff")
    export_blade(blade, tmp_path / "a.unv")
    sets = pyuff.UFF(str(tmp_path / "a.unv")).read_sets()
    modes = [s for s in sets if s["type"] == 55 and s["data_ch"] == 2]
    assert [s["freq"] for s in modes[:5]] == pytest.approx(blade.states[0].frequency_hz, rel=1e-5)
    assert {s["modal_m"] for s in modes} == {1.0}
    scalars = [s for s in sets if s["type"] == 58 and s["rsp_dir"] == 0 and s["func_type"] == 23]
    assert scalars[0]["data"] == pytest.approx(blade.states[0].mode_shape[:, 0], rel=1e-12)
    nodes = next(s for s in sets if s["type"] == 2411)
    assert np.hypot(nodes["x"], nodes["y"]) == pytest.approx(blade.tip_radius_m, rel=1e-14)


def test_modes_of_another_library_are_normalised_by_their_modal_mass(tmp_path):
    pyuff = oracle("pyuff")
    path = tmp_path / "a.unv"
    shape = np.array([[3.0, 0.0, 4.0], [6.0, 8.0, 2.0]])
    for k, row in enumerate(shape):
        pyuff.UFF(str(path)).write_sets(
            pyuff.prepare_55(
                model_type=1,
                id1="NONE",
                id2="NONE",
                id3="NONE",
                id4="NONE",
                id5="NONE",
                analysis_type=2,
                data_ch=2,
                spec_data_type=8,
                data_type=2,
                r1=row,
                r2=0 * row,
                r3=2 * row,
                n_data_per_node=3,
                node_nums=np.array([7, 8, 9]),
                load_case=1,
                mode_n=k + 1,
                freq=150.0 * (k + 1),
                modal_m=4.0,
                modal_damp_vis=2e-3,
                modal_damp_his=0.0,
            ),
            "add",
        )
    tip = TipLine(("LE", "TE"), (7, 9), np.array([[1.0, 0, 0], [0, 0, 1.0]]), "given")
    found = read_modal({80.0: path}, tip=tip)
    state = found.blade.states[0]
    assert state.mode_shape == pytest.approx(np.array([[1.5, 4.0], [3.0, 2.0]]))
    assert (state.speed_hz, found.blade.damping_ratio.tolist()) == (80.0, [2e-3, 2e-3])
    in_tonnes = read_modal(path, tip=tip, units="mm-t-s").blade.states[0]
    assert in_tonnes.mode_shape * 1000**0.5 == pytest.approx(state.mode_shape)
    with pytest.raises(InvalidInput, match="tip nodes"):
        read_modal(path)


@pytest.mark.parametrize("compressed", [True, False])
def test_matlab_variables_in_a_structure_with_speeds_in_rad_per_second(compressed, full_model, tmp_path):
    pages = np.stack([s.stiffness.toarray() for s in full_model.states], axis=-1)
    dofs = np.stack((full_model.dofs.node, full_model.dofs.component), axis=1)
    tree = {
        "blade": {"K": pages, "M": full_model.mass, "Omega": 2 * np.pi * np.array([0.0, 180.0]), "dofs": dofs}
    }
    savemat(tmp_path / "a.mat", tree | {"remark": "from a thesis"}, do_compression=compressed)
    found = read_matrix_model(tmp_path / "a.mat", **AXIS)
    assert [s.speed_hz for s in found.model.states] == pytest.approx([0.0, 180.0])
    assert np.array_equal(dense(found.model.states[1].stiffness), pages[:, :, 1])
    assert any("rad/s" in str(item) for item in found.findings.items)


def test_scipy_reads_our_matlab_file(full_model, tmp_path):
    write_model(full_model, tmp_path / "a.mat")
    read = loadmat(tmp_path / "a.mat")
    assert abs(csc_array(read["K2"]) - full_model.states[1].stiffness).max() == 0


def test_our_version_7_3_file_has_the_marks_matlab_looks_for(full_model, blade, tmp_path):
    import h5py

    write_model(full_model, tmp_path / "a.mat", format="mat7.3")
    data = (tmp_path / "a.mat").read_bytes()
    assert data.startswith(b"MATLAB 7.3 MAT-file") and data[124:128] == b"\x00\x02IM"
    with h5py.File(tmp_path / "a.mat") as file:
        assert file["M"].attrs["MATLAB_sparse"] == len(full_model.dofs)
        assert file["DOFS"].attrs["MATLAB_class"] == b"double"
    export_blade(blade, tmp_path / "b.mat", format="mat7.3")
    with h5py.File(tmp_path / "b.mat") as file:
        cells = file["blade/tip_nodes"]
        assert cells.attrs["MATLAB_class"] == b"cell"
        assert "".join(map(chr, file[cells[0, 0]][()].ravel())) == "LE"


@pytest.mark.parametrize("layout", ["dense", "sparse"])
@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
def test_matrix_market_in_every_storage_reads_the_same(layout, symmetry, full_model, tmp_path):
    model = full_model
    for name, matrix in (("K", model.states[0].stiffness), ("M", model.mass)):
        stored = matrix if layout == "sparse" else matrix.toarray()
        mmwrite(tmp_path / f"{name}.mtx", stored, symmetry=symmetry, precision=17)
    rows = zip(model.dofs.node, model.dofs.component, strict=True)
    table = "\ufeffnode;component\r\n" + "".join(f"{n};{c}\r\n" for n, c in rows)
    (tmp_path / "dofs.csv").write_text(table, encoding="utf-8", newline="")
    files = [tmp_path / name for name in ("K.mtx", "M.mtx", "dofs.csv")]
    read = read_matrix_model(files, **AXIS).model
    assert np.array_equal(dense(read.states[0].stiffness), model.states[0].stiffness.toarray())

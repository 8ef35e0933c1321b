"""What an import says about a file that can be used: figures, and doubts with their likely cause."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from sdm_core.blade import Blade, ModalState
from sdm_core.blade.exchange import export_blade, read_matrix_model, read_modal, write_model
from sdm_core.blade.exchange.checks.modal import mass_normalisation
from sdm_core.blade.exchange.content import arrays_of_model
from sdm_core.blade.exchange.nastran.op4_write import _ascii
from sdm_core.blade.matrix_model import DofMap, MatrixModel, SpeedState
from sdm_core.errors import InvalidInput

AXIS = {"rotation_axis": (0.0, 0.0, 1.0)}


def imported(model: MatrixModel, folder, **settings):
    return read_matrix_model(write_model(model, folder / "a.npz").paths, **settings)


def doubts(found) -> str:
    return " | ".join(map(str, found.findings.warnings))


def test_a_good_model_raises_no_doubt_and_its_figures_are_right(full_model, tip, tmp_path):
    found = imported(full_model, tmp_path, tip_nodes=tip.nodes)
    assert not found.findings.warnings
    figures = found.findings.figures
    assert (figures["size"], figures["nodes"], figures["modal_coordinates"]) == (144, 48, 0)
    assert figures["rigid_body_modes_at_0_hz"] == 0
    assert figures["frequency_hz_at_180_hz"][:5] == pytest.approx(
        full_model.to_blade(tip, damping_ratio=1e-3).states[1].frequency_hz, rel=1e-9
    )
    # The clamped end takes two thirds of the mass of one element of eight: ∫N² = h/3.
    whole = 4400 * 0.06 * 0.02 * 0.003
    assert figures["mass_moved_kg"] == pytest.approx((whole * (1 - 2 / 24),) * 3, rel=1e-9)


def test_mass_of_a_free_body_is_whole_and_its_six_rigid_modes_are_counted(full_model, tmp_path):
    # Two masses on a spring in space: an exact free body.
    k = np.zeros((6, 6))
    k[np.ix_([0, 3], [0, 3])] = 1e6 * np.array([[1, -1], [-1, 1]])
    free = MatrixModel(
        "dumb-bell",
        DofMap([1, 1, 1, 2, 2, 2], [1, 2, 3, 1, 2, 3]),
        np.diag([0.1, 0.1, 0.1, 0.3, 0.3, 0.3]),
        (SpeedState(0.0, k),),
        {1: (0.2, 0, 0), 2: (0.3, 0, 0)},
    )
    found = imported(free, tmp_path)
    assert found.findings.figures["mass_moved_kg"] == pytest.approx((0.4, 0.4, 0.4))
    assert found.findings.figures["rigid_body_modes_at_0_hz"] == 5
    assert found.findings.figures["frequency_hz_at_0_hz"][0] == pytest.approx(
        np.sqrt(1e6 / 0.075) / (2 * np.pi), rel=1e-9
    )
    assert "clamp the root" in doubts(found)


def test_large_sparse_and_small_dense_checks_agree(full_model, monkeypatch, tmp_path):
    from sdm_core.blade.exchange.checks import definiteness

    dense = imported(full_model, tmp_path).findings.figures
    monkeypatch.setattr(definiteness, "DENSE_UP_TO", 10)
    sparse = imported(full_model, tmp_path).findings.figures
    for key in ("frequency_hz_at_0_hz", "frequency_hz_at_180_hz"):
        assert sparse[key] == pytest.approx(dense[key], rel=1e-8)
    for size in (10, 1500):
        monkeypatch.setattr(definiteness, "DENSE_UP_TO", size)
        heavy = full_model.mass.tolil()
        heavy[0, 3] = heavy[3, 0] = 1.0
        with pytest.raises(InvalidInput, match="negative eigenvalue"):
            imported(replace(full_model, mass=heavy.tocsc()), tmp_path)
        with pytest.raises(InvalidInput, match="negative ω²"):
            soft = full_model.states[0].stiffness.tolil()
            soft[50, 50] = -soft[50, 50]
            imported(replace(full_model, states=(SpeedState(0.0, soft.tocsc()),)), tmp_path)


def in_millimetres(model: MatrixModel) -> MatrixModel:
    return replace(
        model,
        mass=model.mass * 1e-3,
        states=tuple(
            replace(s, stiffness=s.stiffness * 1e-3, static_displacement=None) for s in model.states
        ),
        node_position_m={n: tuple(1e3 * x for x in p) for n, p in model.node_position_m.items()},
    )


@pytest.mark.parametrize("kind", ["full", "reduced"])
def test_millimetres_and_tonnes_are_converted_when_said_and_named_when_not(kind, request, tip, tmp_path):
    model = request.getfixturevalue(f"{kind}_model")
    raw = in_millimetres(model)
    if kind == "reduced":  # modal coordinates keep a modal mass of one: t mm² for kg m²
        d = np.where(model.dofs.component == 0, 1000.0**0.5, 1.0)
        raw = replace(
            raw,
            mass=raw.mass * np.outer(d, d),
            states=tuple(replace(s, stiffness=s.stiffness * np.outer(d, d)) for s in raw.states),
        )
    paths = write_model(raw, tmp_path / "a.op4").paths
    said = read_matrix_model(paths, units="mm-t-s", tip_nodes=tip.nodes)
    assert not said.findings.warnings
    ours, theirs = (m.to_blade(tip, damping_ratio=1e-3) for m in (said.model, model))
    assert ours.states[1].frequency_hz == pytest.approx(theirs.states[1].frequency_hz, rel=1e-9)
    assert abs(ours.states[1].mode_shape) == pytest.approx(
        abs(theirs.states[1].mode_shape), rel=1e-7, abs=1e-9
    )
    assert ours.tip_radius_m == pytest.approx(theirs.tip_radius_m)
    assert abs(said.model.mass - model.mass).max() < 1e-12
    untold = doubts(read_matrix_model(paths))
    assert untold.count('give units="mm-t-s"') == 2
    again = doubts(read_matrix_model(write_model(model, tmp_path / "b.op4").paths, units="mm-t-s"))
    assert 'units="SI"' in again


def test_displacements_and_rotations_convert_by_their_own_units(full_model, tmp_path):
    dofs = DofMap([1, 1, 1, 1], [1, 2, 3, 6])
    k = np.diag([2.0, 2.0, 2.0, 5.0]) + 0.1
    model = MatrixModel("m", dofs, np.eye(4), (SpeedState(0.0, k, np.full(4, 3.0)),), {1: (250.0, 0, 0)})
    found = read_matrix_model(write_model(model, tmp_path / "a.op4").paths, units="mm-t-s").model
    # N/mm, N and N mm: 1e3 N/m, N, 1e-3 N m; mm and rad.
    assert found.states[0].stiffness[0, 0] == pytest.approx(2.1e3)
    assert found.states[0].stiffness[0, 3] == pytest.approx(0.1)
    assert found.states[0].stiffness[3, 3] == pytest.approx(5.1e-3)
    assert found.mass.diagonal() == pytest.approx([1e3, 1e3, 1e3, 1e-3])
    assert found.states[0].static_displacement == pytest.approx([3e-3, 3e-3, 3e-3, 3.0])
    assert found.node_position_m[1] == pytest.approx((0.25, 0, 0))


@pytest.mark.parametrize("units", ["SI", "mm-t-s"])
@pytest.mark.parametrize(("header", "x"), [("node,x_m,y_m,z_m", 0.25), ("node,x_mm,y_mm,z_mm", 250.0)])
def test_a_table_of_places_names_its_own_unit(units, header, x, tmp_path):
    (tmp_path / "K.csv").write_text("4e6,0,0\n0,9e6,0\n0,0,9e6\n")
    (tmp_path / "M.csv").write_text("0.1,0,0\n0,0.1,0\n0,0,0.1\n")
    (tmp_path / "map.csv").write_text("node,component\n7,1\n7,2\n7,3\n")
    (tmp_path / "nodes.csv").write_text(f"{header}\n7,{x},0,0\n")
    files = [tmp_path / name for name in ("K.csv", "M.csv", "map.csv", "nodes.csv")]
    assert read_matrix_model(files, units=units).model.node_position_m[7] == pytest.approx((0.25, 0, 0))


def test_stiffness_and_mass_with_rows_in_different_order_are_brought_together(full_model, tip, tmp_path):
    mixed = np.random.default_rng(2).permutation(len(full_model.dofs))
    other = DofMap(full_model.dofs.node[mixed], full_model.dofs.component[mixed])
    k = full_model.states[0].stiffness.toarray()[np.ix_(mixed, mixed)]
    write_model(replace(full_model, dofs=other, states=(SpeedState(0.0, k),)), tmp_path / "k.op4")
    write_model(full_model, tmp_path / "m.op4")
    files = [tmp_path / "k.op4", tmp_path / "m.op4"]
    found = read_matrix_model(files, stiffness={0.0: "k.op4:K1"}, mass="m.op4:M", **AXIS)
    assert np.array_equal(found.model.states[0].stiffness, full_model.states[0].stiffness.toarray())
    assert any("reordered" in item.what for item in found.findings.items)


def test_mixed_unit_systems_show_in_the_first_frequency(full_model, tmp_path):
    mixed = replace(full_model, states=(SpeedState(0.0, full_model.states[0].stiffness * 1e-6),))
    assert "1e6" in doubts(imported(mixed, tmp_path))
    mixed = replace(full_model, states=(SpeedState(0.0, full_model.states[0].stiffness * 1e3),))
    assert "N/m with mass in t" in doubts(imported(mixed, tmp_path))


def test_speeds_in_rpm_show_in_the_tip_speed(full_model, tmp_path):
    fast = replace(
        full_model, states=(full_model.states[0], replace(full_model.states[1], speed_hz=10_800.0))
    )
    assert "divide rpm by 60" in doubts(imported(fast, tmp_path))


def test_exchanged_speeds_show_in_a_falling_frequency(full_model, tmp_path):
    rest, run = full_model.states
    stiff = replace(run, stiffness=run.stiffness * 1.2)
    wrong = replace(full_model, states=(replace(stiff, speed_hz=0.0), replace(rest, speed_hz=180.0)))
    assert "speeds exchanged" in doubts(imported(wrong, tmp_path))


def test_one_speed_twice_is_refused(full_model, tmp_path):
    twice = replace(full_model, states=(full_model.states[0], full_model.states[0]))
    with pytest.raises(InvalidInput, match="one stiffness a rotor speed"):
        imported(twice, tmp_path)


def test_a_mixed_up_map_shows_in_unequal_masses(full_model, tmp_path):
    component = full_model.dofs.component.copy()
    component[full_model.dofs.node > 140] = np.tile([1, 4, 5], int((full_model.dofs.node > 140).sum()) // 3)
    found = imported(replace(full_model, dofs=DofMap(full_model.dofs.node, component)), tmp_path)
    assert "mixed up" in doubts(found)
    assert any("lack translations" in str(item) for item in found.findings.items)


def test_a_wrong_rotation_axis_shows_at_the_tip(full_model, tip, tmp_path):
    inner = sorted(full_model.node_position_m)[6:9]
    assert "farthest from the axis" in doubts(imported(full_model, tmp_path, tip_nodes=inner))
    along = full_model.positions(tip.nodes)[1]
    assert "nodes lie on it" in doubts(imported(full_model, tmp_path, rotation_axis=along))
    with pytest.raises(InvalidInput, match="lies on the rotation axis"):
        imported(full_model, tmp_path, rotation_axis=along, tip_nodes=tip.nodes)
    with pytest.raises(InvalidInput, match="no displacement 1"):
        imported(full_model, tmp_path, tip_nodes=[101])
    assert imported(full_model, tmp_path, rotation_axis=(0, 0, 3)).model.rotation_axis == (0.0, 0.0, 1.0)


def test_small_asymmetry_is_made_symmetric_and_said(full_model, tmp_path):
    k = full_model.states[0].stiffness.toarray()
    k[0, 1] += 1e-8 * abs(k).max()
    found = imported(replace(full_model, states=(SpeedState(0.0, k),)), tmp_path)
    assert any("made symmetric" in item.what for item in found.findings.items)
    out = found.model.states[0].stiffness
    assert np.array_equal(out, out.T)


def test_mode_shapes_beside_the_matrices_are_held_against_the_mass(full_model, tmp_path):
    _, shape = full_model.modes(full_model.states[0], 4)
    products = mass_normalisation("PHI", shape, full_model.mass)
    assert not products.warnings
    for scale, count in ((1.0, 0), (1 / abs(shape).max(axis=0), 1)):
        arrays = arrays_of_model(full_model) | {"PHI": shape * scale}
        (tmp_path / "a.op4").write_bytes(b"".join(_ascii(arrays)))
        found = read_matrix_model(tmp_path / "a.op4").findings
        assert len(found.warnings) == count
        assert len(found.figures["modal_masses_of_PHI"]) == 4
    assert "not mass-normalised" in str(found.warnings[0])


def changed(blade: Blade, scale) -> Blade:
    states = [
        ModalState(s.speed_hz, s.frequency_hz, s.mode_shape * scale(s.mode_shape)) for s in blade.states[:1]
    ]
    return Blade("b", blade.tip_nodes, 1e-3, states, mass_kg=blade.mass_kg)


def test_unit_amplitudes_and_other_mass_units_show_in_the_shapes(blade, tmp_path):
    def said(scale) -> str:
        path = export_blade(changed(blade, scale), tmp_path / "a.csv").paths[0]
        return doubts(read_modal(path))

    assert said(lambda shape: 1.0) == ""
    assert "unit amplitude" in said(lambda shape: 1 / abs(shape).max(axis=1, keepdims=True))
    assert 'units="mm-t-s"' in said(lambda shape: 1000**0.5 * 30)


def test_unit_modal_mass_with_unit_amplitude_is_doubted(tmp_path):
    lone = Blade("b", ("A",), 1e-3, [ModalState(0.0, [200.0, 700.0], [[1.0], [1.0]])])
    found = read_modal(export_blade(lone, tmp_path / "a.unv").paths[0])
    assert sum("need their own modal mass" in str(item) for item in found.findings.warnings) == 2


def test_nothing_heavy_is_loaded_before_a_file_needs_it():
    code = "import sys, sdm_core.blade.exchange; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not {"h5py", "pyuff", "pyyeti", "pandas", "numba", "matplotlib", "torch"} & set(loaded.split())

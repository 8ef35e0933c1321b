"""What is written to a file comes back from it, in every format."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import issparse

from sdm_core.blade import example_blade
from sdm_core.blade.exchange import FORMATS, export_blade, read_matrix_model, read_modal, write_model
from sdm_core.blade.matrix_model import DofMap, MatrixModel, SpeedState
from sdm_core.blade.tracking import FURTHER_SHAPES
from sdm_core.errors import InvalidInput

MATRIX_FORMATS = {
    "op4": ".op4",
    "op4-ascii": ".op4",
    "dmig": ".bdf",
    "mat": ".mat",
    "mat7.3": ".mat",
    "mtx": ".mtx",
    "calculix": ".sti",
    "csv": ".csv",
    "npz": ".npz",
}
MODAL_FORMATS = {
    "json": ".json",
    "npz": ".npz",
    "mat": ".mat",
    "mat7.3": ".mat",
    "csv": ".csv",
    "uff": ".unv",
}


def dense(matrix) -> np.ndarray:
    return matrix.toarray() if issparse(matrix) else matrix


def apart(a, b) -> float:
    """Largest difference over the largest entry."""
    return float(abs(dense(a) - dense(b)).max() / abs(dense(b)).max())


def there_and_back(model: MatrixModel, name: str, folder) -> MatrixModel:
    written = write_model(model, folder / f"beam{MATRIX_FORMATS[name]}", format=name)
    return read_matrix_model(written.paths, rotation_axis=model.rotation_axis).model


def test_every_format_that_writes_is_tried_here():
    assert {f.name for f in FORMATS if "matrices" in f.writes} == set(MATRIX_FORMATS)
    assert {f.name for f in FORMATS if "modal data" in f.writes} == set(MODAL_FORMATS)


@pytest.mark.parametrize(
    ("kind", "name"),
    [(k, n) for k in ("full", "reduced") for n in MATRIX_FORMATS if (k, n) != ("reduced", "calculix")],
)
def test_matrices_frequencies_and_shapes_come_back_to_1e_10(kind, name, request, tip, tmp_path):
    model: MatrixModel = request.getfixturevalue(f"{kind}_model")
    back = there_and_back(model, name, tmp_path)
    assert np.array_equal(back.dofs.node, model.dofs.node)
    assert np.array_equal(back.dofs.component, model.dofs.component)
    assert apart(back.mass, model.mass) < 1e-10
    assert issparse(back.mass) == issparse(model.mass)
    assert [s.speed_hz for s in back.states] == [s.speed_hz for s in model.states]
    for ours, theirs in zip(back.states, model.states, strict=True):
        assert apart(ours.stiffness, theirs.stiffness) < 1e-10
    for node in tip.nodes:
        assert back.node_position_m[node] == pytest.approx(model.node_position_m[node], rel=1e-10, abs=1e-12)
    blades = [m.to_blade(tip, damping_ratio=1e-3, modes=5) for m in (back, model)]
    for ours, theirs in zip(blades[0].states, blades[1].states, strict=True):
        assert ours.frequency_hz == pytest.approx(theirs.frequency_hz, rel=1e-10)
        assert apart(ours.mode_shape, theirs.mode_shape) < 1e-10


@pytest.mark.parametrize(
    "name", ["op4", "op4-ascii", "mat", "mat7.3", "mtx", "csv", "npz", "calculix", "dmig"]
)
def test_matrices_come_back_to_the_last_bit(name, full_model, tmp_path):
    back = there_and_back(full_model, name, tmp_path)
    assert apart(back.mass, full_model.mass) == 0.0
    assert [apart(a.stiffness, b.stiffness) for a, b in zip(back.states, full_model.states, strict=True)] == [
        0,
        0,
    ]


@pytest.mark.parametrize("name", ["op4", "op4-ascii", "mat", "mat7.3", "npz"])
def test_static_displacements_at_speed_come_back(name, full_model, tmp_path):
    back = there_and_back(full_model, name, tmp_path)
    assert back.states[0].static_displacement is None
    assert np.array_equal(back.states[1].static_displacement, full_model.states[1].static_displacement)


def test_what_a_format_has_no_place_for_is_said(full_model, blade, tmp_path):
    assert "static_displacement" in write_model(full_model, tmp_path / "a.bdf").left_out
    assert "tip_growth_m" in export_blade(blade, tmp_path / "a.unv").left_out


def test_an_archive_keeps_name_axis_and_all_places_of_a_model(full_model, tmp_path):
    turned = replace(full_model, rotation_axis=(0.6, 0.0, 0.8))
    written = write_model(turned, tmp_path / "a.npz")
    back = read_matrix_model(written.paths).model
    assert (back.name, back.rotation_axis) == (turned.name, turned.rotation_axis)
    assert back.node_position_m == turned.node_position_m


def test_rows_in_any_order_keep_their_meaning_in_dmig(full_model, tip, tmp_path):
    mixed = np.random.default_rng(1).permutation(len(full_model.dofs))
    k = full_model.states[0].stiffness.toarray()[np.ix_(mixed, mixed)]
    m = full_model.mass.toarray()[np.ix_(mixed, mixed)]
    dofs = DofMap(full_model.dofs.node[mixed], full_model.dofs.component[mixed])
    shuffled = replace(full_model, dofs=dofs, mass=m, states=(SpeedState(0.0, k),))
    back = there_and_back(shuffled, "dmig", tmp_path)
    ours, theirs = (x.to_blade(tip, damping_ratio=1e-3).states[0] for x in (back, full_model))
    assert ours.frequency_hz == pytest.approx(theirs.frequency_hz, rel=1e-9)
    assert abs(ours.mode_shape) == pytest.approx(abs(theirs.mode_shape), rel=1e-7)


@pytest.mark.parametrize("name", MODAL_FORMATS)
def test_modal_data_of_two_speeds_come_back_to_1e_10(name, blade, tmp_path):
    written = export_blade(blade, tmp_path / f"blade{MODAL_FORMATS[name]}", format=name)
    back = read_modal(written.paths[0]).blade
    assert (back.name, back.tip_nodes, back.direction) == (blade.name, blade.tip_nodes, blade.direction)
    assert np.array_equal(back.damping_ratio, blade.damping_ratio)
    for ours, theirs in zip(back.states, blade.states, strict=True):
        assert ours.speed_hz == theirs.speed_hz
        assert np.array_equal(ours.frequency_hz, theirs.frequency_hz)
        for key in ("mode_shape", *FURTHER_SHAPES):
            assert apart(getattr(ours, key), getattr(theirs, key)) < 1e-10
    for key in ("tip_radius_m", "tip_z_m", "tip_theta_rad"):
        assert getattr(back, key) == pytest.approx(getattr(blade, key), rel=1e-12, abs=1e-15)
    if not written.left_out:
        assert (back.mass_kg, back.design_speed_hz, back.material) == (
            blade.mass_kg,
            blade.design_speed_hz,
            blade.material,
        )
        assert np.array_equal(back.states[1].tip_growth_m, blade.states[1].tip_growth_m)
        assert back.states[0].tip_growth_m is None
        assert back.states[1].untwist_rad == blade.states[1].untwist_rad


@pytest.mark.parametrize("name", MODAL_FORMATS)
@pytest.mark.parametrize("example", ["nasa_rotor_37", "generic_compressor_blade"])
def test_the_shipped_blades_come_back(name, example, tmp_path):
    blade = example_blade(example)
    path = export_blade(blade, tmp_path / f"blade{MODAL_FORMATS[name]}", format=name).paths[0]
    back = read_modal(path).blade
    assert back.tip_nodes == blade.tip_nodes
    for ours, theirs in zip(back.states, blade.states, strict=True):
        assert np.array_equal(ours.frequency_hz, theirs.frequency_hz)
        assert ours.mode_shape == pytest.approx(theirs.mode_shape, rel=1e-10)


def test_a_blade_without_places_keeps_its_amplitudes_in_a_universal_file(blade, tmp_path):
    bare = replace(blade, tip_radius_m=None, tip_z_m=None, tip_theta_rad=None)
    written = export_blade(bare, tmp_path / "a.unv")
    assert any("mode_shape_radial" in what for what in written.left_out)
    back = read_modal(written.paths[0]).blade
    assert back.states[1].mode_shape == pytest.approx(blade.states[1].mode_shape, rel=1e-12)
    assert back.tip_radius_m is None


def test_modal_rows_are_refused_where_the_format_has_none(reduced_model, tmp_path):
    with pytest.raises(InvalidInput, match="displacements only"):
        write_model(reduced_model, tmp_path / "a.sti")
    assert not list(tmp_path.iterdir())

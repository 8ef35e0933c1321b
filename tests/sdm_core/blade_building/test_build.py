"""A profile becomes a blade file: reduction, contact line, progress, refusals."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from named_solids import block, coarse_blade

from sdm_core.blade import blade_from_dict, blade_to_dict
from sdm_core.blade.build import build_blade
from sdm_core.blade.component_modes import CraigBampton
from sdm_core.blade.finite_elements import TITANIUM, SolidModel, equilibrium
from sdm_core.blade.matrix_model import lowest_modes
from sdm_core.blade.solid_mesh import InvertedElements, SolidMesh, Subdivision
from sdm_core.blade.tip_contact import TipContact
from sdm_core.errors import Cancelled, InvalidInput


@pytest.fixture(scope="module")
def build():
    return build_blade(coarse_blade())


def test_reduced_model_has_the_full_models_modes_between_its_speeds(build):
    assert np.abs(build.check.frequency_error).max() < 1e-3
    assert build.check.shape_error.max() < 1e-2
    assert build.reduced_size < build.full_size / 10


def test_reduced_model_has_the_full_models_modes_at_its_speeds():
    mesh = SolidMesh.of(block(1.0, 0.4, 0.05), Subdivision(4, 8, 1))
    model = SolidModel(mesh, TITANIUM)
    states = [equilibrium(model, speed) for speed in (0.0, 30.0)]
    tip = [mesh.node_at(2 * i, 16, 1) for i in range(5)]
    reduced = CraigBampton(held_modes=6, free_modes=5).reduce("plate", model, tip, states)
    for state, at_speed in zip(reduced.states, states, strict=True):
        full, _ = lowest_modes(at_speed.stiffness, model.mass, 5)
        assert reduced.modes(state, 5)[0] == pytest.approx(full, rel=1e-6)


def test_static_response_to_tip_forces_at_rest_is_exact_in_the_reduced_model():
    mesh = SolidMesh.of(block(1.0, 0.4, 0.05), Subdivision(4, 8, 1))
    model = SolidModel(mesh, TITANIUM)
    tip = [mesh.node_at(0, 16, 1), mesh.node_at(8, 16, 1)]
    reduced = CraigBampton(held_modes=1, free_modes=1).reduce("plate", model, tip, [equilibrium(model, 0.0)])
    force = np.arange(1.0, 7.0)
    whole = np.zeros(model.size)
    whole[model.rows(np.array(tip)).ravel()] = force
    from sdm_core.blade.factorization import SymmetricFactor

    full = SymmetricFactor(model.stiffness_at_rest()).solve(whole)[model.rows(np.array(tip)).ravel()]
    load = np.concatenate((force, np.zeros(len(reduced.dofs) - 6)))
    assert np.linalg.solve(reduced.states[0].stiffness, load)[:6] == pytest.approx(full, rel=1e-8)


def test_centrifugal_stiffening_raises_the_first_frequency(build):
    first = [state.frequency_hz[0] for state in build.blade.states]
    assert first[0] < first[1] < first[2]


def test_built_blade_survives_its_file(build):
    again = blade_from_dict(json.loads(json.dumps(blade_to_dict(build.blade))))
    assert again.states[2].untwist_rad == build.blade.states[2].untwist_rad
    assert np.array_equal(again.states[2].mode_shape, build.blade.states[2].mode_shape)
    assert np.array_equal(again.states[2].tip_growth_m, build.blade.states[2].tip_growth_m)
    assert again.tip_theta_rad == build.blade.tip_theta_rad


def test_contact_amplitudes_are_the_projection_on_the_casing_normal(build):
    state, slope = build.blade.states[0], -0.1
    normal = (state.mode_shape_radial - slope * state.mode_shape_axial) / np.hypot(1.0, slope)
    assert state.mode_shape == pytest.approx(normal, rel=1e-9, abs=1e-12)


def test_radial_contact_takes_the_radial_amplitudes():
    radial = build_blade(replace(coarse_blade(), tip=TipContact(direction="radial")), verify=False).blade
    assert radial.direction == "radial"
    assert radial.states[0].mode_shape == pytest.approx(radial.states[0].mode_shape_radial)


def test_given_contact_direction_is_taken_in_radial_tangential_axial_parts():
    tangential = build_blade(replace(coarse_blade(), tip=TipContact(direction=(0.0, 2.0, 0.0))), verify=False)
    state = tangential.blade.states[0]
    assert tangential.blade.direction == "given"
    assert state.mode_shape == pytest.approx(state.mode_shape_tangential)


def test_suction_and_pressure_lines_lie_on_either_side_of_the_middle():
    profile = coarse_blade()
    mesh = SolidMesh.of(profile.sections().solid(profile.cut).positions, profile.subdivision)
    place = {
        line: mesh.position_m[list(TipContact(nodes=5, line=line).on(mesh).nodes)]
        for line in ("pressure", "middle", "suction")
    }
    assert 0.5 * (place["pressure"] + place["suction"]) == pytest.approx(place["middle"], abs=1e-5)
    # The suction side bulges: towards the rotation for this camber.
    angle = {line: np.arctan2(p[2, 1], p[2, 0]) for line, p in place.items()}
    assert angle["suction"] > angle["middle"] > angle["pressure"]


def test_the_same_profile_gives_the_same_blade_to_the_last_bit(build):
    again = build_blade(coarse_blade(), verify=False)
    for one, other in zip(build.blade.states, again.blade.states, strict=True):
        assert np.array_equal(one.frequency_hz, other.frequency_hz)
        assert np.array_equal(one.mode_shape, other.mode_shape)


def test_inverted_elements_are_named_by_their_place():
    def crossing(s, h, t):
        points = block(1.0, 0.4, 0.05)(s, h, t)
        points[..., 2] *= 1 - 1.6 * points[..., :1].repeat(1, axis=-1)[..., 0]
        return points

    with pytest.raises(InvertedElements, match=r"% of the span, .* % of the chord"):
        SolidMesh.of(crossing, Subdivision(4, 8, 1))


def test_progress_rises_to_one_and_says_what_is_done():
    said = []
    build_blade(coarse_blade(), progress=lambda done, what: said.append((done, what)))
    shares = [done for done, _ in said]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert any("equilibrium at 250 Hz" in what or "equilibrium at 262.5 Hz" in what for _, what in said)


def test_a_build_stops_when_its_progress_says_so():
    def stop(done: float, what: str) -> None:
        if "fixed-interface" in what:
            raise Cancelled("stopped")

    with pytest.raises(Cancelled):
        build_blade(coarse_blade(), progress=stop)


def test_more_tip_nodes_than_the_mesh_has_are_refused():
    with pytest.raises(InvalidInput, match=r"tip.nodes = 31: the mesh has 9 nodes"):
        build_blade(replace(coarse_blade(), tip=TipContact(nodes=31)))

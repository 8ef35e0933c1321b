"""Finite elements against beams and plates whose frequencies are known."""

from __future__ import annotations

import numpy as np
import pytest
from named_solids import STEEL_WITHOUT_POISSON, block

from sdm_core.blade.finite_elements import Material, SolidModel, equilibrium
from sdm_core.blade.finite_elements.equilibrium import NoEquilibrium
from sdm_core.blade.matrix_model import lowest_modes
from sdm_core.blade.solid_mesh import SolidMesh, Subdivision


def _beam(slenderness: float, elements: int) -> tuple[SolidModel, float]:
    """A beam of length 1 m with square section, and √(EI/ρAL⁴) in rad/s."""
    depth = 1.0 / slenderness
    material = STEEL_WITHOUT_POISSON
    mesh = SolidMesh.of(block(1.0, depth, depth), Subdivision(1, elements, 1))
    scale = np.sqrt(material.youngs_modulus / material.density / 12) * depth
    return SolidModel(mesh, material), scale


def test_rotating_beam_flaps_at_wrights_frequencies():
    # Wright, Smith, Thresher, Wang (1982): uniform, clamped at the axis, out of the plane of rotation.
    model, scale = _beam(100.0, 40)
    before = None
    for eta, known in zip((0, 3, 6, 12), (3.5160, 4.7973, 7.3604, 13.1702), strict=True):
        before = equilibrium(model, eta * scale / (2 * np.pi), before)
        omega2, shape = lowest_modes(before.stiffness, model.mass, 4)
        by_direction = (shape.reshape(-1, 3, 4) ** 2).sum(axis=0)
        out_of_plane = by_direction[2] > 0.5 * by_direction.sum(axis=0)
        first_flap = np.sqrt(omega2[np.argmax(out_of_plane)]) / scale
        assert first_flap == pytest.approx(known, rel=1e-3)


def test_in_the_plane_of_rotation_the_beam_is_softer_by_the_speed_squared():
    # Out of the plane ω² exceeds the in-plane ω² by Ω² exactly, in every mode (Wright 1982).
    model, scale = _beam(100.0, 20)
    at_speed = equilibrium(model, 6 * scale / (2 * np.pi))
    omega2, shape = lowest_modes(at_speed.stiffness, model.mass, 4)
    by_direction = (shape.reshape(-1, 3, 4) ** 2).sum(axis=0)
    flap = omega2[by_direction[2] > by_direction[1]]
    lag = omega2[by_direction[2] < by_direction[1]]
    assert (flap - lag) / scale**2 == pytest.approx([36.0, 36.0], rel=2e-3)


def test_cantilever_plate_has_the_frequencies_of_nafems_fv16():
    mesh = SolidMesh.of(block(10.0, 10.0, 0.05), Subdivision(16, 16, 1))
    model = SolidModel(mesh, Material(200e9, 0.3, 8000.0))
    omega2, _ = lowest_modes(model.stiffness_at_rest(), model.mass, 6)
    known = [0.421, 1.029, 2.582, 3.306, 3.753, 6.555]
    assert np.sqrt(omega2) / (2 * np.pi) == pytest.approx(known, rel=1e-2)


def test_centrifugal_load_stretches_a_bar_as_statics_says():
    # Free end of a bar from the axis: u = ρΩ²L³/3E, for small strains.
    model, _ = _beam(10.0, 4)
    speed_hz = 5.0
    at_speed = equilibrium(model, speed_hz)
    end = np.flatnonzero(model.mesh.position_m[:, 0] > 1.0 - 1e-12)
    material = model.material
    known = material.density * (2 * np.pi * speed_hz) ** 2 / (3 * material.youngs_modulus)
    assert at_speed.displacement[model.rows(end)[:, 0]].mean() == pytest.approx(known, rel=1e-4)


def test_tangent_is_the_derivative_of_the_internal_forces():
    model = SolidModel(
        SolidMesh.of(block(1.0, 0.5, 0.2), Subdivision(2, 3, 1)), Material(108e9, 0.34, 4400.0)
    )
    rng = np.random.default_rng(3)
    u, step = 0.02 * rng.standard_normal(model.size), rng.standard_normal(model.size)
    _, stiffness = model.tangent(u)
    ahead, behind = model.tangent(u + 1e-6 * step)[0], model.tangent(u - 1e-6 * step)[0]
    assert stiffness @ step == pytest.approx((ahead - behind) / 2e-6, rel=1e-6, abs=1e-6 * abs(ahead).max())
    assert abs(stiffness - stiffness.T).max() < 1e-12 * abs(stiffness).max()


def test_assembly_is_that_of_the_library_term_by_term():
    # The slow twin: the weak form of linear elasticity written in the library's own language.
    import skfem
    from skfem.helpers import ddot, eye, sym_grad, trace

    material = Material(108e9, 0.34, 4400.0)
    model = SolidModel(SolidMesh.of(block(1.0, 0.5, 0.2), Subdivision(2, 2, 1)), material)
    lam, mu = material.lame_lambda, material.shear_modulus
    element = skfem.ElementVector(skfem.ElementHexS2())
    basis = skfem.Basis(model.mesh.mesh, element, intorder=5)

    @skfem.BilinearForm
    def elasticity(u, v, _):
        strain = sym_grad(u)
        return ddot(lam * eye(trace(strain), 3) + 2 * mu * strain, sym_grad(v))

    @skfem.BilinearForm
    def inertia(u, v, _):
        return material.density * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2])

    corners = basis.nodal_dofs.shape[1]
    # The library numbers corners' three components first, then those of the edges.
    number = np.empty((model.mesh.node_count, 3), dtype=int)
    number[:corners] = basis.nodal_dofs.T
    number[corners:] = basis.edge_dofs.T
    ours = number[model.free_nodes].ravel()
    for form, matrix in ((elasticity, model.stiffness_at_rest()), (inertia, model.mass)):
        theirs = form.assemble(basis)[ours][:, ours]
        assert abs(theirs - matrix).max() < 1e-12 * abs(matrix).max()


def test_a_blade_too_soft_for_its_speed_is_refused_with_the_speed_it_can_bear():
    soft = Material(1e7, 0.3, 8000.0)
    arched = SolidMesh.of(_bow, Subdivision(1, 8, 1))
    with pytest.raises(NoEquilibrium, match="lower the design speed"):
        equilibrium(SolidModel(arched, soft), 2000.0)


def _bow(s: np.ndarray, h: np.ndarray, t: np.ndarray) -> np.ndarray:
    points = block(1.0, 0.05, 0.02)(s, h, t)
    points[..., 2] += 0.3 * np.sin(2.0 * points[..., 0])
    points[..., 0] += 0.1
    return points

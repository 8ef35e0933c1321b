"""Central differences with contact: twin, orders, energy, invariants."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from liner_rubs import one_mode, rotor_37

from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.time_domain.liner import plain_revolution
from sdm_core.time_domain.liner.abradable_liner import AbradableLiner, Friction
from sdm_core.time_domain.liner.casing import Casing
from sdm_core.time_domain.liner.central_differences import CentralDifferences
from sdm_core.time_domain.liner.liner_rub import InitialMotion, LinerRub
from sdm_core.time_domain.liner.rub_history import RubHistory
from sdm_core.time_domain.liner.simulation import run_revolutions, simulate_rub

FAR = Casing(0.25, 0.1)
SOFT = AbradableLiner.from_cutting_stiffness(1e4, elastic_recovery=0.05)
EDGES_AND_MIDDLE = ("LE", "N5", "TE")

NAMED_RUBS = {
    "leading edge": rotor_37(),
    "nothing to yield at": rotor_37(yield_force_n=0.0),
    "three nodes": rotor_37(EDGES_AND_MIDDLE),
    "three nodes with friction": rotor_37(EDGES_AND_MIDDLE, friction=Friction(0.2, 1)),
    "stiff liner": rotor_37(EDGES_AND_MIDDLE, ke=1e6, elastic_recovery=0.3),
    "hardening that accumulates": replace(
        rotor_37(), liner=replace(rotor_37().liner, hardening_restarts=False)
    ),
    "perfect plasticity": replace(rotor_37(), liner=AbradableLiner(2e9, 3e6, 0.0, 5e-3, 3.4e-3, 1e-3)),
    "fed": replace(rotor_37(("TE",)), casing=Casing(0.25, 2e-5, feed_per_revolution_m=1e-5)),
}


def arrays(history: RubHistory) -> dict[str, np.ndarray]:
    return {
        "position": history.position,
        "velocity": history.velocity,
        "force": history.force_n,
        "worn": history.worn_m,
        "peak": history.peak_m,
        "energy": history.energy.contact_j,
    }


@pytest.mark.parametrize("name", NAMED_RUBS)
def test_compiled_and_plain_revolutions_agree(name):
    rub, method = NAMED_RUBS[name], CentralDifferences(200, 8, samples_per_revolution=100)
    fast = run_revolutions(rub, 290.0, 4, method)
    slow = run_revolutions(rub, 290.0, 4, method, kernel=plain_revolution.one_revolution)
    assert fast.force_n.max() > 0
    for key, value in arrays(slow).items():
        assert arrays(fast)[key] == pytest.approx(value, rel=1e-9, abs=1e-9 * np.abs(value).max()), key


@pytest.mark.parametrize("name", NAMED_RUBS)
def test_the_account_of_energy_closes_to_rounding(name):
    found = simulate_rub(NAMED_RUBS[name], 290.0, 12, CentralDifferences(500))
    energy = found.energy
    assert energy.turnover_j > 0
    assert np.abs(energy.imbalance_j).max() < 1e-10 * energy.turnover_j
    assert (np.diff(energy.damping_j) <= 0).all(), "damping only takes"


@pytest.mark.parametrize("name", NAMED_RUBS)
def test_contact_pushes_and_never_pulls_and_what_is_worn_stays_worn(name):
    found = simulate_rub(NAMED_RUBS[name], 290.0, 12, CentralDifferences(500))
    assert found.force_n.min() == 0.0
    assert found.worn_m.min() >= 0.0
    assert (np.diff(found.worn_volume_m3) >= 0).all()
    assert found.worn_volume_m3[-1] > 0


@given(
    ke=st.floats(1e2, 1e6),
    recovery=st.floats(0.005, 0.95),
    strength=st.floats(0.0, 60.0),
    feed=st.floats(0.0, 2e-5),
    oval=st.floats(0.0, 3e-4),
    speed=st.floats(100.0, 300.0),
    nodes=st.sets(st.sampled_from(example_blade("nasa_rotor_37").tip_nodes), min_size=1, max_size=3),
    mu=st.sampled_from([None, 0.1, 0.3]),
)
@settings(max_examples=40, deadline=None)
def test_any_rub_conserves_energy_and_material(ke, recovery, strength, feed, oval, speed, nodes, mu):
    rub = LinerRub(
        example_blade("nasa_rotor_37"),
        tuple(sorted(nodes)),
        AbradableLiner.from_cutting_stiffness(ke, elastic_recovery=recovery, yield_force_n=strength),
        Casing(0.25, 5e-5, oval, 2, 3.0, feed),
        None if mu is None else Friction(mu, 1),
    )
    found = run_revolutions(rub, speed, 6, CentralDifferences(200))
    assert found.force_n.min() >= 0
    assert (np.diff(found.worn_volume_m3) >= 0).all()
    assert np.abs(found.energy.imbalance_j).max() <= 1e-9 * found.energy.turnover_j


def test_free_vibration_is_of_second_order_and_decays_as_the_damping_says():
    rub, start = LinerRub(one_mode(0.02), ("tip",), SOFT, FAR), InitialMotion(np.array([1e-5]), [2e-3])
    error = []
    for steps in (1, 2, 4):
        found = simulate_rub(rub, 30.0, 2, CentralDifferences(300, steps, 100), initial=start)
        omega, decay = 2 * np.pi * 100.0, 0.02 * 2 * np.pi * 100.0
        damped, t = np.sqrt(omega**2 - decay**2), found.time_s
        sine = (2e-3 + decay * 1e-5) / damped
        exact = np.exp(-decay * t) * (1e-5 * np.cos(damped * t) + sine * np.sin(damped * t))
        error.append(np.abs(found.position[:, 0] - exact).max())
    assert np.array(error[:-1]) / error[1:] == pytest.approx(4.0, rel=0.02)
    assert error[-1] < 1e-3 * 1e-5


def test_energy_of_the_scheme_is_kinetic_and_strain_energy_to_second_order():
    rub, start = LinerRub(one_mode(0.0), ("tip",), SOFT, FAR), InitialMotion(np.array([1e-5]))
    wrong = []
    for steps in (1, 2):
        found = simulate_rub(rub, 30.0, 3, CentralDifferences(300, steps, 100), initial=start)
        assert np.abs(found.energy.imbalance_j).max() < 1e-12 * found.energy.start_j
        wrong.append(np.abs(found.modal_energy_j[:, 0] - found.energy.start_j).max())
    assert wrong[0] / wrong[1] == pytest.approx(4.0, rel=0.05)


def test_where_the_force_jumps_the_motion_converges_with_the_step_at_first_order():
    rub = rotor_37(yield_force_n=0.0, elastic_recovery=0.3)

    def displacement(steps: int) -> np.ndarray:
        found = simulate_rub(rub, 290.0, 4, CentralDifferences(250, steps, 250))
        return found.displacement_m[found.of_revolution(-1), 0][:: found.samples_per_revolution // 250]

    reference = displacement(512)
    error = [np.abs(displacement(steps) - reference).max() for steps in (16, 32, 64)]
    assert error[-1] < 0.02 * np.abs(reference).max()
    assert np.array(error[:-1]) / error[1:] == pytest.approx(2.1, abs=0.5)


def test_forces_of_several_nodes_belong_to_the_displacements_they_correct():
    rub = rotor_37(example_blade("nasa_rotor_37").tip_nodes, ke=1e6, elastic_recovery=0.3)
    found = simulate_rub(rub, 290.0, 6, CentralDifferences(500))
    assert 1 < found.correction_rounds < 50


def test_two_nodes_that_move_as_one_are_one_node_of_twice_the_width():
    shape = [[3.0, 3.0], [-5.0, -5.0]]
    blade = Blade("pair", ("a", "b"), 1e-2, [ModalState(0.0, [100.0, 340.0], shape)])
    casing = Casing(0.25, 1e-4, ovalisation_m=2e-4, ovalisation_revolutions=3.0)
    wide = AbradableLiner.from_cutting_stiffness(2e5, elastic_recovery=0.2, yield_force_n=10.0)
    narrow = replace(wide, axial_width_m=wide.axial_width_m / 2)
    method = CentralDifferences(400, 1)
    one = simulate_rub(LinerRub(blade, ("a",), wide, casing), 40.0, 8, method)
    two = simulate_rub(LinerRub(blade, ("a", "b"), narrow, casing), 40.0, 8, method)
    assert two.correction_rounds > 2
    assert two.worn_m == pytest.approx(np.tile(one.worn_m, (2, 1)), abs=1e-12)
    assert two.force_n.sum(axis=1) == pytest.approx(one.force_n[:, 0], abs=1e-6)


def test_neither_the_sign_of_a_mode_nor_the_order_of_the_nodes_matters():
    rub = rotor_37(EDGES_AND_MIDDLE, friction=Friction(0.2, 1))
    turned = [s.reordered(np.arange(5), np.array([1.0, -1.0, 1.0, -1.0, -1.0])) for s in rub.blade.states]
    other = replace(
        rub, blade=replace(rub.blade, states=tuple(turned)), nodes=tuple(reversed(EDGES_AND_MIDDLE))
    )
    a, b = (simulate_rub(one, 290.0, 6, CentralDifferences(500)) for one in (rub, other))
    assert b.worn_m[::-1] == pytest.approx(a.worn_m, abs=1e-12)
    assert b.displacement_m == pytest.approx(a.displacement_m, abs=1e-12)


def test_in_a_round_casing_every_angle_is_worn_alike():
    rub = LinerRub(
        Blade("stiff", ("tip",), 0.1, [ModalState(0.0, [300.0], [[0.5]])]),
        ("tip",),
        SOFT,
        Casing(0.25, 0.0, feed_per_revolution_m=1e-6),
    )
    found = simulate_rub(rub, 50.0, 40, CentralDifferences(500))
    spiral = 1e-6 * np.arange(500) / 500
    assert np.ptp(found.worn_m[0] - spiral) < 1e-9
    assert found.lobes[0].count == 0


def test_a_rigid_blade_wears_an_ovalised_casing_where_it_is_nearest():
    rub = LinerRub(
        Blade("rigid", ("tip",), 0.1, [ModalState(0.0, [500.0], [[1e-3]])]),
        ("tip",),
        SOFT,
        Casing(0.25, 1e-4, ovalisation_m=3e-4, lobes=3, ovalisation_revolutions=4.0),
    )
    found = simulate_rub(rub, 50.0, 8, CentralDifferences(600))
    groove = np.maximum(0.0, 3e-4 * np.cos(3 * found.angle_rad) - 1e-4)
    # The last pass springs back by ε = 0.05 of a chip, and the next takes of that again.
    assert found.worn_m[0] == pytest.approx(groove, abs=1e-7)
    assert found.lobes[0].ovalisation == 3
    assert found.lobes[0].ovalisation_amplitude_m > found.lobes[0].amplitude_m


def test_friction_bends_the_tip_against_its_sliding():
    omega = 2 * np.pi * 100.0
    state = ModalState(0.0, [100.0, 120.0], [[2.0], [0.0]], mode_shape_tangential=[[0.0], [3.0]])
    blade = Blade("two", ("tip",), 0.2, [state])
    casing = Casing(0.25, 0.0, feed_per_revolution_m=1e-6)
    for rotation in (1, -1):
        rub = LinerRub(blade, ("tip",), SOFT, casing, Friction(0.25, rotation))
        found = simulate_rub(rub, 40.0, 60, CentralDifferences(1000))
        force = found.force_n[-1, 0]
        assert found.position[-1, 0] == pytest.approx(-2.0 * force / omega**2, rel=1e-3)
        sideways = -rotation * 0.25 * 3.0 * force / (2 * np.pi * 120.0) ** 2
        assert found.position[-1, 1] == pytest.approx(sideways, rel=1e-3)
        assert found.energy.friction_j[-1] > 0, (
            "the rotor drives the tip over the liner, and friction bends it"
        )


def test_friction_between_bending_and_contact_moves_the_boundary():
    # V_c and V_t of one sign: friction adds to what the contact does, of the other it takes away.
    growth = []
    for sideways in (-3.0, 3.0):
        state = ModalState(0.0, [100.0], [[3.0]], mode_shape_tangential=[[sideways]])
        blade = Blade("leaning", ("tip",), 0.01, [state])
        rub = LinerRub(
            blade,
            ("tip",),
            AbradableLiner.from_cutting_stiffness(1e3, elastic_recovery=0.01),
            Casing(0.25, 0.0, feed_per_revolution_m=1e-6),
            Friction(0.3, 1),
        )
        found = simulate_rub(
            rub, 100.0 / 2.77, 40, CentralDifferences(4000, 1), initial=InitialMotion([3e-8])
        )
        growth.append(found.displacement_m[found.of_revolution(-1), 0].std())
    assert growth[1] > 2 * growth[0]

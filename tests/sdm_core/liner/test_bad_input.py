"""What cannot be simulated is refused by name, with what to write instead."""

from __future__ import annotations

from dataclasses import replace

import pytest
from liner_rubs import one_mode, rotor_37

from sdm_core.errors import Cancelled, InvalidInput, LinerWornThrough, OutOfSpeedRange, TooMuchWork
from sdm_core.interruption import interruptible
from sdm_core.time_domain.liner.abradable_liner import AbradableLiner, Friction
from sdm_core.time_domain.liner.casing import Casing
from sdm_core.time_domain.liner.central_differences import CentralDifferences
from sdm_core.time_domain.liner.liner_rub import InitialMotion, LinerRub
from sdm_core.time_domain.liner.simulation import simulate_rub

SOFT = AbradableLiner.from_cutting_stiffness(1e4)


def test_an_unstable_step_names_the_least_steps_a_revolution_and_those_are_stable():
    rub = rotor_37()
    with pytest.raises(InvalidInput, match="at least 78 steps a revolution") as refused:
        simulate_rub(rub, 250.0, 3, CentralDifferences(40, 1))
    assert refused.value.field == "steps_per_cell"
    assert "steps_per_cell = 2 with 40 cells" in str(refused.value)
    pushed = InitialMotion([1e-6] * 5)
    far = replace(rub, casing=Casing(0.25, 0.1))
    found = simulate_rub(far, 250.0, 50, CentralDifferences(78, 1, 20), initial=pushed)
    assert found.peak_m.max() < 1e-3


def test_more_steps_than_can_be_taken_are_refused():
    with pytest.raises(TooMuchWork, match="raise the speed"):
        simulate_rub(rotor_37(), 1e-3, 1)


def test_a_liner_thinner_than_the_wear_ends_with_node_angle_and_remedy():
    rub = rotor_37(("N5", "LE"), thickness_m=8e-5)
    rub = replace(rub, casing=replace(rub.casing, lobes=1))
    with pytest.raises(LinerWornThrough) as ended:
        simulate_rub(rub, 250.0, 8, CentralDifferences(500))
    for said in ("liner.thickness_m = 8e-05", "under node", "degrees", "thicker liner", "less feed"):
        assert said in str(ended.value)


@pytest.mark.parametrize(
    ("clearance", "oval"), [(-1e-6, 0.0), (1e-4, 2e-4), ((1e-4, -1e-5), 0.0), ((3e-4, 1e-4), 2e-4)]
)
def test_contact_before_anything_moves_is_refused_unless_said_on_purpose(clearance, oval):
    with pytest.raises(InvalidInput, match="before anything moves"):
        Casing(0.25, clearance, ovalisation_m=oval)
    Casing(0.25, clearance, ovalisation_m=oval, interference=True)


def test_friction_asks_for_tangential_shapes():
    with pytest.raises(InvalidInput, match=r"without mode_shape_tangential.*leave friction out"):
        LinerRub(one_mode(), ("tip",), SOFT, Casing(0.25, 1e-4), Friction(0.1, 1))


@pytest.mark.parametrize(
    ("field", "make"),
    [
        ("youngs_modulus_pa", lambda: AbradableLiner(0.0, 1.0, 1.0, 1e-3, 1e-3)),
        ("yield_stress_pa", lambda: AbradableLiner(1e9, -1.0, 1.0, 1e-3, 1e-3)),
        ("plastic_modulus_pa", lambda: AbradableLiner(1e9, 1.0, float("nan"), 1e-3, 1e-3)),
        ("thickness_m", lambda: AbradableLiner(1e9, 1.0, 1.0, 0.0, 1e-3)),
        ("axial_width_m", lambda: AbradableLiner(1e9, 1.0, 1.0, 1e-3, 0.0)),
        ("axial_width_m[1]", lambda: AbradableLiner(1e9, 1.0, 1.0, 1e-3, (1e-3, -1.0))),
        ("contact_length_m", lambda: AbradableLiner(1e9, 1.0, 1.0, 1e-3, 1e-3, -1.0)),
        ("hardening_restarts", lambda: AbradableLiner(1e9, 1.0, 1.0, 1e-3, 1e-3, None, 1)),
        ("elastic_recovery", lambda: AbradableLiner.from_cutting_stiffness(1e4, elastic_recovery=1.0)),
        ("lobes", lambda: Casing(0.25, 1e-4, lobes=0)),
        ("radius_m", lambda: Casing(0.0, 1e-4)),
        ("feed_per_revolution_m", lambda: Casing(0.25, 1e-4, feed_per_revolution_m=-1e-6)),
        ("friction.coefficient", lambda: Friction(-0.1, 1)),
        ("friction.rotation", lambda: Friction(0.1, 0)),
        ("cells", lambda: CentralDifferences(cells=3)),
        ("steps_per_cell", lambda: CentralDifferences(steps_per_cell=0)),
        ("samples_per_revolution", lambda: CentralDifferences(samples_per_revolution=2.5)),
        ("nodes[1]", lambda: replace(rotor_37(), nodes=("LE", "tip"))),
        ("nodes[1]", lambda: replace(rotor_37(), nodes=("LE", "LE"))),
        ("nodes", lambda: replace(rotor_37(), nodes=())),
        ("casing.clearance_m", lambda: replace(rotor_37(), casing=Casing(0.25, (1e-4, 1e-4)))),
        ("liner.axial_width_m", lambda: replace(rotor_37(), liner=replace(SOFT, axial_width_m=(1e-3,) * 2))),
        ("revolutions", lambda: simulate_rub(rotor_37(), 250.0, 0)),
        ("revolutions", lambda: simulate_rub(rotor_37(), 250.0, 2.5)),
        ("speed_hz", lambda: simulate_rub(rotor_37(), -1.0, 2)),
        ("initial.displacement", lambda: simulate_rub(rotor_37(), 250.0, 2, initial=InitialMotion([1e-6]))),
    ],
)
def test_numbers_out_of_range_are_named(field, make):
    with pytest.raises(InvalidInput) as refused:
        make()
    assert refused.value.field == field


def test_speeds_beyond_the_modal_data_are_refused_unless_extrapolated():
    with pytest.raises(OutOfSpeedRange):
        simulate_rub(rotor_37(), 400.0, 1)
    assert simulate_rub(rotor_37(), 400.0, 1, CentralDifferences(200), extrapolate=True).speed_hz == 400.0


def test_a_simulation_can_be_stopped_between_revolutions():
    done = []

    def enough() -> None:
        if len(done) == 3:
            raise Cancelled("enough")

    with interruptible(enough), pytest.raises(Cancelled):
        simulate_rub(rotor_37(), 250.0, 50, progress=lambda n, of: done.append((n, of)))
    assert done == [(1, 50), (2, 50), (3, 50)]

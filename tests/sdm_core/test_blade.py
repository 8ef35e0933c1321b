"""Blades: interpolation in Ω², tracking of modes, the real examples."""

import numpy as np
import pytest

from sdm_core.blade import EXAMPLES, Blade, ModalState, example_blade
from sdm_core.boundary import boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput, ModesNotTracked, OutOfSpeedRange
from sdm_core.rubbing_blade import RubbingBlade


def blade_of(*states: ModalState, damping=1e-3, nodes=("LE", "TE")) -> Blade:
    return Blade("test", nodes, damping, states)


def state(speed, frequency, shape) -> ModalState:
    return ModalState(speed, np.array(frequency), np.array(shape))


def test_squared_frequency_is_interpolated_as_a_parabola_in_squared_speed():
    def frequency(speed):
        return np.sqrt(1e4 + 3.0 * speed**2 + 2e-4 * speed**4)

    states = [state(s, [frequency(s)], [[1.0, 2.0]]) for s in (0.0, 60.0, 100.0)]
    found = blade_of(*states).at_speed(80.0)
    assert found.frequency_hz[0] == pytest.approx(frequency(80.0), rel=1e-12)


@pytest.mark.parametrize("name", EXAMPLES)
def test_interpolation_passes_through_every_state(name):
    blade = example_blade(name)
    for given in blade.states:
        if given.speed_hz > 0:
            found = blade.at_speed(given.speed_hz)
            np.testing.assert_allclose(found.frequency_hz, given.frequency_hz, rtol=1e-12)
            np.testing.assert_allclose(found.mode_shape, given.mode_shape, atol=1e-12)


def test_speed_outside_the_states_is_refused_unless_asked_for():
    blade = example_blade("nasa_rotor_37")
    with pytest.raises(OutOfSpeedRange, match=r"speed_hz\[0\] = 400.0.*0 to 300.802 Hz"):
        blade.at_speed(400.0)
    assert blade.at_speed(400.0, extrapolate=True).frequency_hz[0] > blade.at_speed(300.0).frequency_hz[0]


def test_one_state_means_no_centrifugal_effect_at_any_speed():
    blade = blade_of(state(0.0, [100.0, 250.0], [[1.0, 2.0], [3.0, -1.0]]))
    np.testing.assert_allclose(blade.at_speed(900.0).frequency_hz, [100.0, 250.0], rtol=1e-14)


def test_modes_that_cross_in_frequency_are_followed_by_shape_and_sign():
    first = state(0.0, [100.0, 110.0], [[5.0, 5.0], [-4.0, 4.0]])
    second = state(50.0, [106.0, 125.0], [[4.1, -4.0], [-5.0, -5.1]])
    blade = blade_of(first, second)
    np.testing.assert_allclose(blade.states[1].frequency_hz, [125.0, 106.0])
    np.testing.assert_allclose(blade.states[1].mode_shape, [[5.0, 5.1], [-4.1, 4.0]])


def test_a_crossing_that_cannot_be_followed_is_refused_by_name():
    first = state(0.0, [100.0, 101.0], [[5.0, 5.0], [5.0, 5.0]])
    second = state(50.0, [120.0, 121.0], [[5.0, 5.0], [5.0, 5.0]])
    with pytest.raises(ModesNotTracked, match=r"mode 1 \(100 Hz\) and mode 2 \(101 Hz\) from 0 to 50"):
        blade_of(first, second)


def test_a_mode_whose_shape_is_lost_is_refused_by_name():
    first = state(0.0, [100.0, 300.0], [[5.0, 5.0], [-4.0, 4.0]])
    second = state(50.0, [104.0, 306.0], [[5.0, 5.0], [4.0, 4.0]])
    with pytest.raises(ModesNotTracked, match="mode 2"):
        blade_of(first, second)


@pytest.mark.parametrize("name", EXAMPLES)
def test_order_and_signs_of_the_modes_in_the_file_do_not_matter(name):
    blade = example_blade(name)
    rng = np.random.default_rng(4)
    turned = [
        s.reordered(rng.permutation(blade.mode_count), rng.choice([-1.0, 1.0], blade.mode_count))
        for s in blade.states
    ]
    again = Blade(blade.name, blade.tip_nodes, blade.damping_ratio, turned)
    speed = np.array([120.0])
    ours, theirs = blade.at_speeds(speed), again.at_speeds(speed)
    np.testing.assert_allclose(ours[0], theirs[0], rtol=1e-12)
    np.testing.assert_allclose(np.abs(ours[1]), np.abs(theirs[1]), rtol=1e-9, atol=1e-12)


def test_rotor_37_is_far_more_sensitive_at_its_leading_edge():
    # Pins which end of the tip is which: swapping two nodes moves these figures.
    blade = example_blade("nasa_rotor_37")
    speed = np.linspace(80.0, 95.0, 31)
    lowest = {
        node: np.nanmin(boundary(blade, ContactConfiguration.at(node), speed, 4e4).critical_ke)
        for node in ("LE", "N2", "TE")
    }
    assert lowest["LE"] == pytest.approx(8160, rel=5e-3)
    assert lowest["N2"] == pytest.approx(8480, rel=2e-2)
    assert lowest["TE"] == pytest.approx(15868, rel=5e-3)


def test_weights_go_to_the_nodes_they_name():
    blade = example_blade("nasa_rotor_37")
    problem = RubbingBlade.from_blade(blade, ContactConfiguration({"N4": 0.25}), 200.0, 1.0)
    column = blade.tip_nodes.index("N4")
    expected = 0.25 * blade.at_speed(200.0).mode_shape[:, column] ** 2
    np.testing.assert_allclose(problem.contact_matrix.diagonal(), expected, rtol=1e-12)


def test_radial_direction_reproduces_the_radial_shapes():
    blade = example_blade("nasa_rotor_37")
    radial = blade.in_direction("radial")
    assert radial.direction == "radial"
    assert radial.states[0].mode_shape[0, 0] == pytest.approx(1.1267, rel=1e-4)
    with pytest.raises(InvalidInput, match="mode_shape_radial"):
        blade_of(state(0.0, [1.0], [[1.0, 1.0]])).in_direction("radial")

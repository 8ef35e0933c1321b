"""Known answers of DESIGN, section 6."""

import numpy as np
import pytest
from named_problems import (
    AT_TIP,
    BENCHMARK_KE,
    BENCHMARK_SPEEDS,
    MATHIEU_RADIUS,
    MILLING_RADIUS,
    benchmark_blade,
    mathieu,
    milling,
    one_mode,
    receptance,
)
from scipy.optimize import minimize_scalar

from sdm_core.blade import example_blade
from sdm_core.boundary import boundary, verdicts
from sdm_core.contact import ContactConfiguration
from sdm_core.lobe_tips import least_critical_ke
from sdm_core.permanent_contact.root_count import unstable_root_count
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.semi_discretization import Averaged, Converged
from sdm_core.stability import stability


@pytest.mark.parametrize("damping_ratio", [2e-4, 2e-3, 1e-2, 0.05])
def test_critical_stiffness_of_one_mode_is_two_xi_times_one_plus_xi(damping_ratio):
    blade = one_mode(damping_ratio)
    ke_unit = (2 * np.pi) ** 2

    def critical(speed):
        return boundary(blade, AT_TIP, np.array([speed]), 10 * ke_unit).critical_ke[0] / ke_unit

    coarse = np.linspace(0.25, 0.8, 400)
    values = boundary(blade, AT_TIP, coarse, 10 * ke_unit).critical_ke
    best = int(np.nanargmin(values))
    bounds = coarse[max(best - 1, 0)], coarse[min(best + 1, len(coarse) - 1)]
    lowest = minimize_scalar(critical, bounds=bounds, method="bounded", options={"xatol": 1e-10}).fun
    assert lowest == pytest.approx(2 * damping_ratio * (1 + damping_ratio), rel=1e-6)


def test_delayed_mathieu_has_its_published_multiplier():
    found = stability(mathieu())
    assert found.stable is True
    assert found.spectral_radius == pytest.approx(MATHIEU_RADIUS, rel=1e-4)
    assert found.error_estimate <= 1e-4


@pytest.mark.parametrize("depth", sorted(MILLING_RADIUS))
def test_down_milling_has_its_published_multiplier(depth):
    found = stability(milling(depth))
    assert found.stable is False
    assert found.spectral_radius == pytest.approx(MILLING_RADIUS[depth], rel=2e-4)


@pytest.mark.parametrize(
    ("equation", "exact"),
    [(mathieu(), None), (milling(0.5e-3), None), (milling(1.0e-3), None)],
    ids=["mathieu", "milling 0.5 mm", "milling 1 mm"],
)
def test_averaged_semi_discretization_converges_with_order_two(equation, exact):
    exact = abs(Converged(1e-7).dominant(equation).multiplier)
    steps = np.array([40, 80, 160, 320])
    error = [abs(abs(Averaged(int(n)).multipliers(equation)[0]) - exact) for n in steps]
    order = -np.polyfit(np.log(steps), np.log(error), 1)[0]
    assert order == pytest.approx(2.0, abs=0.15)


def test_every_verdict_of_the_benchmark_chart_is_that_of_the_root_count():
    blade = benchmark_blade()
    speed, ke = np.meshgrid(BENCHMARK_SPEEDS, BENCHMARK_KE)
    answered = verdicts(blade, AT_TIP, speed.ravel(), ke.ravel()).reshape(speed.shape)
    wrong = 0
    for i, value in enumerate(BENCHMARK_SPEEDS):
        problem = RubbingBlade.from_blade(blade, AT_TIP, value, 0.0)
        count = unstable_root_count(receptance(problem), value, BENCHMARK_KE)
        assert not np.isnan(count).any()
        wrong += int((answered[:, i] != (count == 0)).sum())
    assert wrong == 0
    assert 0.2 < (answered == 0).mean() < 0.9  # a chart of one colour would prove nothing


def test_sixty_steps_call_an_unstable_point_at_low_speed_stable():
    # Fact 1 of DESIGN: at Ω/f1 = 0.05 the critical K_e of N = 60 is half as large again.
    blade = benchmark_blade()
    critical = boundary(blade, AT_TIP, np.array([0.05]), 10.0).critical_ke[0]
    problem = RubbingBlade.from_blade(blade, AT_TIP, 0.05, 1.2 * critical)
    assert stability(problem).stable is False
    assert stability(problem, Averaged(60)).stable is True
    assert "fixed N = 60" in stability(problem, Averaged(60)).method


def test_the_deepest_lobe_is_found_also_when_it_alone_is_asked_for():
    # On rotor 37 the grid of speeds ranks two lobes 0.3 % apart the wrong way round.
    blade, contact = example_blade("nasa_rotor_37"), ContactConfiguration.at("LE")
    (alone,) = least_critical_ke(blade, contact, 150.0, 300.0, 2.5e4, count=1)
    every = least_critical_ke(blade, contact, 150.0, 300.0, 2.5e4, count=400)
    assert alone.ke == pytest.approx(every[0].ke, rel=1e-4)

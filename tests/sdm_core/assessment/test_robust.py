"""Robust verdicts: the worst blade of a family is found, named, and bracketed by a proof."""

from __future__ import annotations

import numpy as np
import pytest
from named_problems import AT_TIP, benchmark_blade, one_mode

from sdm_core.assessment.robust import (
    STABLE_FOR_ALL,
    UNSTABLE_FOR_ALL,
    UNSTABLE_FOR_SOME,
    robust_at_speeds,
    robust_over_range,
)
from sdm_core.assessment.robust_band import robust_band
from sdm_core.assessment.uncertain_blade import Factors, Uncertainty, first_crossings, problems_at, slopes
from sdm_core.blade import example_blade
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import least_critical_ke

LE = ContactConfiguration.at("LE")
ONLY_DAMPING = Uncertainty(frequency=(1.0, 1.0))


def test_of_one_mode_half_the_damping_is_the_worst_and_twice_the_best():
    damping = 4e-3
    blade = one_mode(damping, frequency_hz=100.0, amplitude=2.0)
    nominal = 2 * damping * (1 + damping) * (2 * np.pi * 100.0) ** 2 / 4.0
    found = robust_over_range(blade, AT_TIP, (15.0, 50.0), 4 * nominal, uncertainty=ONLY_DAMPING)
    for case, factor in ((found.worst, 0.5), (found.nominal, 1.0), (found.best, 2.0)):
        xi = factor * damping
        assert case.ke == pytest.approx(2 * xi * (1 + xi) * (2 * np.pi * 100.0) ** 2 / 4.0, rel=1e-3)
        assert case.damping == pytest.approx((factor,))
    assert found.worst.described == "damping of mode 1 × 0.5"
    assert found.worst.causes[0].effect == pytest.approx(-0.5, abs=0.01)


def test_amplitudes_off_by_a_factor_change_stiffness_by_its_square():
    blade = benchmark_blade()
    family = Uncertainty((1.0, 1.0), (1.0, 1.0), (0.8, 1.25), per_mode=False)
    found = robust_over_range(blade, AT_TIP, (0.15, 0.45), 2.0, uncertainty=family)
    assert found.worst.ke == pytest.approx(found.nominal.ke / 1.25**2, rel=1e-4)
    assert found.best.ke == pytest.approx(found.nominal.ke / 0.8**2, rel=1e-4)
    assert found.worst.described == "amplitude of all modes +25.0 %"


def test_frequencies_of_one_mode_scale_stiffness_and_speeds_alike():
    """All frequencies of a blade of one state times a: K_e times a² and every speed times a."""
    blade = one_mode(3e-3, frequency_hz=100.0, amplitude=2.0)
    family = Uncertainty((1.0, 1.0), (0.95, 1.05))
    found = robust_over_range(blade, AT_TIP, (10.0, 70.0), 1e3, uncertainty=family)
    assert found.worst.ke == pytest.approx(found.nominal.ke * 0.95**2, rel=2e-3)


def test_at_a_fixed_speed_the_worst_frequency_lies_inside_and_puts_a_lobe_tip_on_it():
    """One mode at a speed beside its lobe's tip: shifting the frequency moves the tip there."""
    damping, frequency = 3e-3, 100.0
    blade = one_mode(damping, frequency, amplitude=2.0)
    chatter = frequency * np.sqrt(1 + 2 * damping)
    tip = chatter / 4.75
    speed = tip * 1.012  # 1.2 % off: inside the ± 3 %
    family = Uncertainty((1.0, 1.0), (0.97, 1.03))
    found = robust_at_speeds(blade, AT_TIP, [speed], 2e4, uncertainty=family)
    # K_e along f at fixed Ω is K_e at Ω/f times f²: its least is found here by brute force.
    factors = np.linspace(0.97, 1.03, 2001)
    problems = [
        problems_at(blade, AT_TIP, np.array([speed]), Factors(np.ones(1), np.array([f]), np.ones(1)))[0]
        for f in factors
    ]
    swept = first_crossings(problems, 2e4).critical_ke
    assert found.worst.ke == pytest.approx(np.nanmin(swept), rel=1e-4)
    assert found.worst.ke <= np.nanmin(swept) * (1 + 1e-9)
    assert found.worst.frequency[0] == pytest.approx(factors[np.nanargmin(swept)], abs=1e-3)
    assert 0.975 < found.worst.frequency[0] < 1.025
    assert found.nominal.ke > 1.03 * found.worst.ke


@pytest.mark.parametrize("at", [None, [0.19, 0.31]])
def test_no_random_blade_of_the_family_is_worse_than_the_worst_found(at):
    blade, family = benchmark_blade(), Uncertainty()
    span = (0.15, 0.45)
    if at is None:
        found = robust_over_range(blade, AT_TIP, span, 2.0, uncertainty=family)
    else:
        found = robust_at_speeds(blade, AT_TIP, at, 20.0, uncertainty=family)
    speed = np.array(at) if at else 1 / np.linspace(1 / 0.45, 1 / 0.15, 120)
    rng = np.random.default_rng(1)
    for _ in range(60):
        factors = Factors(rng.choice([0.5, rng.uniform(0.5, 2.0)], 2), rng.uniform(0.97, 1.03, 2), np.ones(2))
        first = first_crossings(problems_at(blade, AT_TIP, speed, factors), 20.0).critical_ke
        assert not (first < found.worst.ke * (1 - 1e-3)).any()
    assert found.guaranteed_ke <= found.worst.ke


def test_worst_case_of_rotor_37_is_its_first_mode_and_lies_on_the_proven_floor():
    found = robust_over_range(example_blade("nasa_rotor_37"), LE, (150.0, 300.0), 2.5e4, ke_liner=9000.0)
    assert found.guaranteed_ke <= found.worst.ke < 1.06 * found.guaranteed_ke
    assert found.worst.causes[0].quantity == "damping"
    assert found.worst.causes[0].factor == pytest.approx(0.5)
    assert found.verdict == UNSTABLE_FOR_SOME and found.verdict_proven
    assert "worst case" in found.described and "proven" in found.described


def test_verdicts_against_soft_middling_and_hard_liners():
    blade = one_mode(4e-3, frequency_hz=100.0, amplitude=2.0)
    nominal = 2 * 4e-3 * 1.004 * (2 * np.pi * 100.0) ** 2 / 4.0
    verdicts = {
        liner: robust_over_range(
            blade, AT_TIP, (15.0, 50.0), 5 * nominal, uncertainty=ONLY_DAMPING, ke_liner=liner * nominal
        )
        for liner in (0.4, 1.0, 2.5)
    }
    assert [v.verdict for v in verdicts.values()] == [STABLE_FOR_ALL, UNSTABLE_FOR_SOME, UNSTABLE_FOR_ALL]
    assert [v.verdict_proven for v in verdicts.values()] == [True, True, False]


def test_a_family_of_one_blade_is_that_blade():
    blade, nothing = example_blade("nasa_rotor_37"), Uncertainty((1.0, 1.0), (1.0, 1.0))
    found = robust_over_range(blade, LE, (200.0, 300.0), 2.5e4, uncertainty=nothing)
    least = least_critical_ke(blade, LE, 200.0, 300.0, 2.5e4)[0]
    for case in (found.nominal, found.worst, found.best):
        assert case.ke == pytest.approx(least.ke, rel=1e-4)
        assert case.described == "nominal"


def test_slopes_are_the_differences_of_the_first_crossing():
    blade = example_blade("nasa_rotor_37")
    variables = Uncertainty(amplitude=(0.9, 1.1)).variables(5)
    speed, logs = np.array([241.0]), np.random.default_rng(2).normal(size=len(variables)) * 0.01

    def first(at: np.ndarray) -> tuple[float, float]:
        problems = problems_at(blade, LE, speed, Factors.of(variables, at, 5))
        found = first_crossings(problems, 1e5)
        return float(found.critical_ke[0]), float(found.chatter_hz[0])

    ke, chatter = first(logs)
    problem = problems_at(blade, LE, speed, Factors.of(variables, logs, 5))[0]
    found = slopes(problem, ke, chatter, variables)
    for i in range(len(variables)):
        step = np.zeros(len(variables))
        step[i] = 1e-5
        difference = np.log(first(logs + step)[0] / first(logs - step)[0]) / 2e-5
        assert found[i] == pytest.approx(difference, rel=1e-4, abs=1e-5)


def test_the_band_holds_the_nominal_boundary_and_its_floor_follows_damping():
    blade = one_mode(4e-3, frequency_hz=100.0, amplitude=2.0)
    speed = np.linspace(18.0, 40.0, 60)
    band = robust_band(blade, AT_TIP, speed, 2e4)
    nominal = np.nan_to_num(band.nominal, nan=np.inf)
    assert (np.nan_to_num(band.lowest, nan=np.inf) <= nominal).all()
    assert (np.nan_to_num(band.highest, nan=np.inf) >= nominal).all()
    both = np.isfinite(band.lowest) & np.isfinite(band.lowest_damped)
    ratio = np.nanmin(band.lowest_damped[both]) / np.nanmin(band.lowest[both])
    assert ratio == pytest.approx(2.0 * 1.008 / (0.5 * 1.002), rel=0.02)


def test_with_arcs_the_worst_is_searched_and_nothing_is_said_to_be_proven():
    blade = one_mode(4e-3, frequency_hz=100.0, amplitude=2.0)
    half = ContactConfiguration.at("tip", arcs=[(0.0, 0.5)])
    found = robust_at_speeds(
        blade, half, [21.0], 4e4, uncertainty=Uncertainty(per_mode=False), ke_liner=100.0
    )
    assert found.guaranteed_ke is None
    assert found.worst.ke < found.nominal.ke
    assert found.verdict == STABLE_FOR_ALL and not found.verdict_proven


@pytest.mark.parametrize("bad", [{"damping": (1.1, 2.0)}, {"frequency": (0.97,)}, {"amplitude": (0.0, 1.0)}])
def test_ranges_without_the_nominal_value_are_refused(bad):
    with pytest.raises(InvalidInput, match="uncertainty"):
        Uncertainty(**bad)

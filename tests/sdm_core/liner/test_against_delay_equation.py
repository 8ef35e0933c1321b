"""The liner in kept contact beside the delay equation, of which it knows nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from liner_rubs import AMPLITUDE, DAMPING, FEED_M, FLOOR_KE, FREQUENCY_HZ, kept_in_contact, one_mode
from scipy.signal import detrend

from sdm_core.contact import ContactConfiguration
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.stability import StabilitySolution, stability
from sdm_core.time_domain.liner.central_differences import CentralDifferences
from sdm_core.time_domain.liner.liner_rub import InitialMotion, LinerRub
from sdm_core.time_domain.liner.rub_history import RubHistory
from sdm_core.time_domain.liner.simulation import simulate_rub

KE = 1.3 * FLOOR_KE
NUDGE = InitialMotion(np.array([1e-7 / AMPLITUDE]))
IN_LOBES = [k + 0.77 for k in range(1, 7)]
BETWEEN = [k + 0.35 for k in range(1, 7)]


def delayed(oscillations: float, ke: float = KE) -> StabilitySolution:
    problem = RubbingBlade.from_blade(
        one_mode(), ContactConfiguration.at("tip"), FREQUENCY_HZ / oscillations, ke
    )
    return stability(problem, truncation=False)


def rubbed(
    rub: LinerRub, oscillations: float, revolutions: int, cells: int = 4000, steps_per_cell: int = 1
) -> RubHistory:
    method = CentralDifferences(cells, steps_per_cell, samples_per_revolution=200)
    return simulate_rub(rub, FREQUENCY_HZ / oscillations, revolutions, method, initial=NUDGE)


def vibration(history: RubHistory) -> np.ndarray:
    """Standard deviation of the tip's displacement in each revolution, about its own straight trend."""
    each = history.displacement_m[:, 0].reshape(-1, history.samples_per_revolution)
    return detrend(each, axis=1).std(axis=1)


def growth(rub: LinerRub, history: RubHistory, first: int = 10, last: int = 40) -> float:
    """Per revolution, fitted to the energy of the motion about the position of rest under a steady cut."""
    steady = float(rub.bars(4).plastic[0]) * FEED_M
    rest = -AMPLITUDE * steady / history.omega[0] ** 2
    energy = history.velocity[:, 0] ** 2 + (history.omega[0] * (history.position[:, 0] - rest)) ** 2
    each = energy.reshape(-1, history.samples_per_revolution).mean(axis=1)[first:last]
    return float(np.polyfit(np.arange(first, last), np.log(each), 1)[0] / 2)


@pytest.mark.parametrize("oscillations", IN_LOBES)
def test_in_a_lobe_of_the_delay_equation_chatter_grows_and_carves_round_f_over_speed_lobes(oscillations):
    assert delayed(oscillations).stable is False
    found = rubbed(kept_in_contact(KE), oscillations, 300)
    assert vibration(found)[-1] > 0.5 * FEED_M > 5 * vibration(found)[2]
    assert found.lobes[0].count == round(oscillations)
    assert (found.force_n[-found.samples_per_revolution :] == 0).any(), "chatter ends in separation"


@pytest.mark.parametrize("oscillations", BETWEEN)
def test_between_the_lobes_the_same_nudge_settles_to_an_even_cut(oscillations):
    assert delayed(oscillations).stable is True
    found = rubbed(kept_in_contact(KE), oscillations, 300)
    assert vibration(found)[-1] < 1e-6 * vibration(found)[2]
    assert found.lobes[0].count == 0
    assert found.force_n[found.samples_per_revolution :].min() > 0


@pytest.mark.parametrize("oscillations", [1.77, 2.77, 6.77, 3.35, 4.35])
def test_growth_per_revolution_is_that_of_the_delay_equation_to_second_order(oscillations):
    exact = delayed(oscillations).growth_per_revolution
    rub = kept_in_contact(KE, elastic_recovery=1e-6)
    wrong = [growth(rub, rubbed(rub, oscillations, 40, cells)) - exact for cells in (250, 500, 4000)]
    assert wrong[0] / wrong[1] == pytest.approx(4.0, abs=0.3)
    assert abs(wrong[2]) < 4e-5


def test_cells_of_finite_length_damp_by_what_is_said_of_them():
    rub, oscillations = kept_in_contact(KE, elastic_recovery=0.02), 4.77
    plain, cells = rubbed(rub, oscillations, 40, 4000, 1), rubbed(rub, oscillations, 40, 1000, 4)
    # The same steps, so that they differ by the cells alone; more damping moves a root by its real part.
    added = float(cells.cell_damping_ratio[0])
    damped = replace(rub, blade=one_mode(DAMPING + added))
    assert plain.cell_damping_ratio == 0
    expected = growth(rub, rubbed(damped, oscillations, 40, 4000, 1)) - growth(rub, plain)
    assert growth(rub, cells) - growth(rub, plain) == pytest.approx(expected, rel=0.05)
    assert expected < -0.01


def fading_memory_growth(oscillations: float, ke: float, recovery: float) -> float:
    """Re(s)τ of s² + 2ξωs + ω² + K_eφ²(1 − z)/(1 − εz) = 0, z = e^{−sτ}, nearest to the blade's own mode."""
    omega, tau = 2 * np.pi * FREQUENCY_HZ, oscillations / FREQUENCY_HZ

    def residual(s: complex) -> complex:
        z = np.exp(-s * tau)
        memory = (1 - z) / (1 - recovery * z)
        return s * s + 2 * DAMPING * omega * s + omega**2 + ke * AMPLITUDE**2 * memory

    s = 1j * omega
    for _ in range(50):
        tiny = 1e-6 * omega
        s -= residual(s) * 2 * tiny / (residual(s + tiny) - residual(s - tiny))
    assert abs(residual(s)) < 1e-9 * omega**2
    return s.real * tau


@pytest.mark.parametrize("recovery", [0.1, 0.3])
def test_what_springs_back_makes_the_memory_fade_over_several_revolutions(recovery):
    rub = kept_in_contact(KE, elastic_recovery=recovery)
    found = growth(rub, rubbed(rub, 2.77, 40))
    assert found == pytest.approx(fading_memory_growth(2.77, KE, recovery), abs=1e-4)
    assert abs(found - delayed(2.77).growth_per_revolution) > 100e-4 * recovery


@pytest.mark.parametrize("recovery", [0.05, 0.3, 0.7])
def test_every_critical_stiffness_rises_by_one_plus_the_elastic_recovery(recovery):
    oscillations = np.linspace(2.5, 3.2, 141)

    def floor_growth(ke: float) -> float:
        return max(fading_memory_growth(n, ke, recovery) for n in oscillations)

    factor = kept_in_contact(KE, elastic_recovery=recovery).liner.critical_ke_factor
    assert factor == pytest.approx(1 + recovery)
    assert floor_growth(0.995 * factor * FLOOR_KE) < 0 < floor_growth(1.005 * factor * FLOOR_KE)


@pytest.mark.parametrize("oscillations", IN_LOBES[:3])
def test_with_hardening_accumulated_regeneration_is_gone_and_no_lobe_grows(oscillations):
    rub = kept_in_contact(KE)
    rub = replace(rub, liner=replace(rub.liner, hardening_restarts=False))
    moving = vibration(rubbed(rub, oscillations, 60))
    assert moving[-1] < 0.01 * moving[2]

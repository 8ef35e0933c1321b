"""Friction in the liner beside friction in the delay equation, G = (V_n + μV_t)WV_nᵀ (decision 27)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from liner_rubs import DAMPING, FEED_M, FLOOR_KE, FREQUENCY_HZ, kept_in_contact

from sdm_core.blade import Blade, ModalState
from sdm_core.delay_equation import DelayEquation
from sdm_core.stability import stability
from sdm_core.time_domain.liner.abradable_liner import Friction
from sdm_core.time_domain.liner.central_differences import CentralDifferences
from sdm_core.time_domain.liner.simulation import InitialMotion, simulate_rub

FREQUENCIES_HZ = np.array([FREQUENCY_HZ, 2.63 * FREQUENCY_HZ])
NORMAL, TANGENTIAL = np.array([[3.0], [-2.0]]), np.array([[4.0], [5.0]])
KE = 1.3 * FLOOR_KE
LEAN = Blade("leaning", ("tip",), DAMPING, [ModalState(0.0, FREQUENCIES_HZ, NORMAL, None, TANGENTIAL)])


def delayed(oscillations: float, along: float) -> float:
    """Growth per revolution by the delay equation; `along` is μ, negative where the blade turns backwards."""
    omega = 2 * np.pi * FREQUENCIES_HZ
    contact = (NORMAL + along * TANGENTIAL) @ NORMAL.T
    damping, stiffness = np.diag(2 * DAMPING * omega), np.diag(omega**2)
    tau = oscillations / FREQUENCY_HZ
    equation = DelayEquation.of_second_order(np.eye(2), damping, stiffness, KE * contact, tau)
    return stability(equation).growth_per_revolution


def rubbed(oscillations: float, along: float, first: int = 10, last: int = 25) -> float:
    """Growth per revolution of the energy about the position of rest, while the contact is kept."""
    friction = Friction(abs(along), 1 if along > 0 else -1) if along else None
    rub = replace(kept_in_contact(KE, elastic_recovery=1e-6), blade=LEAN, friction=friction)
    method = CentralDifferences(4000, 1, samples_per_revolution=200)
    nudge = InitialMotion(np.array([1e-9, 0.0]))
    found = simulate_rub(rub, FREQUENCY_HZ / oscillations, last, method, initial=nudge)
    steady = float(rub.bars(4).plastic[0]) * FEED_M
    rest = -(NORMAL + along * TANGENTIAL)[:, 0] * steady / found.omega**2
    energy = (found.velocity**2 + (found.omega * (found.position - rest)) ** 2).sum(axis=1)
    each = energy.reshape(-1, found.samples_per_revolution).mean(axis=1)[first:last]
    return float(np.polyfit(np.arange(first, last), np.log(each), 1)[0] / 2)


@pytest.mark.parametrize("along", [0.0, 0.2, -0.2])
@pytest.mark.parametrize("oscillations", [2.77, 2.35])
def test_vibration_under_friction_grows_as_the_delay_equation_with_an_unsymmetric_matrix(oscillations, along):
    assert rubbed(oscillations, along) == pytest.approx(delayed(oscillations, along), abs=6e-5)


def test_friction_of_a_tip_that_leaves_the_casing_when_pushed_back_makes_chatter_worse():
    against, without, along = (delayed(2.77, mu) for mu in (-0.2, 0.0, 0.2))
    assert against < without < along and without < along - 0.01

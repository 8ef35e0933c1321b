"""Named problems with known answers (DESIGN, section 6) and blades made for tests."""

from __future__ import annotations

import numpy as np

from sdm_core.blade import Blade, ModalState
from sdm_core.contact import ContactConfiguration
from sdm_core.delay_equation import DelayEquation, delayed_mathieu, down_milling
from sdm_core.permanent_contact.receptance import ContactReceptance
from sdm_core.rubbing_blade import RubbingBlade, single_state_problem

MATHIEU_RADIUS = 0.512052
MILLING_RADIUS = {0.5e-3: 1.07398, 1.0e-3: 1.40647}


def mathieu() -> DelayEquation:
    """ẍ + 0.1ẋ + (3 + 2cos t)x = −0.15 x(t − 2π)."""
    return delayed_mathieu(3.0, 2.0, -0.15, 0.1)


def milling(depth: float) -> DelayEquation:
    """Full-immersion down-milling, two teeth, 5,000 rpm (Insperger and Stépán 2004)."""
    return down_milling(
        teeth=2,
        tangential_coefficient=6e8,
        normal_coefficient=2e8,
        frequency_hz=922.0,
        damping_ratio=0.011,
        mass=0.03993,
        spindle_rpm=5000.0,
        depth=depth,
    )


def one_mode(damping_ratio: float, frequency_hz: float = 1.0, amplitude: float = 1.0) -> Blade:
    state = ModalState(0.0, np.array([frequency_hz]), np.array([[amplitude]]))
    return Blade("one mode", ("tip",), damping_ratio, [state])


def benchmark_blade() -> Blade:
    """f = 1 and 4 Hz, ξ = 2e-3, one node, amplitudes 1 and 0.8."""
    state = ModalState(0.0, np.array([1.0, 4.0]), np.array([[1.0], [0.8]]))
    return Blade("benchmark", ("tip",), 2e-3, [state])


BENCHMARK_SPEEDS = np.linspace(0.02, 0.45, 200)
BENCHMARK_KE = np.linspace(0.0, 0.1, 200) * (2 * np.pi) ** 2
AT_TIP = ContactConfiguration.at("tip")


def receptance(problem: RubbingBlade) -> ContactReceptance:
    return ContactReceptance(problem.omega, problem.damping_ratio, problem.contact_factor)


def random_problem(
    rng: np.random.Generator,
    arcs: list[list[float]] | None = None,
    kappa: float = 0.05,
    most_modes: int = 5,
) -> RubbingBlade:
    """A random blade of one to `most_modes` modes at three nodes."""
    n = int(rng.integers(1, most_modes + 1))
    frequency = np.cumprod(np.r_[100.0, rng.uniform(1.3, 3.0, n - 1)])
    shape = rng.normal(size=(n, 3)) * rng.uniform(1.0, 8.0, (n, 1))
    scale = 1.0 / ((shape**2).sum(axis=1) / (2 * np.pi * frequency) ** 2).max()
    speed = frequency[0] * rng.uniform(0.15, 0.8)
    damping = np.full(n, 10 ** rng.uniform(-3.3, -2.0))
    return single_state_problem(frequency, damping, shape, np.ones(3), speed, kappa * scale, arcs)

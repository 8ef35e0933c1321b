"""Rubbing blades that the tests of the liner share."""

from __future__ import annotations

import numpy as np

from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.time_domain.liner.abradable_liner import AbradableLiner, Friction
from sdm_core.time_domain.liner.casing import Casing
from sdm_core.time_domain.liner.liner_rub import LinerRub

FREQUENCY_HZ, DAMPING, AMPLITUDE = 100.0, 0.01, 3.0
FLOOR_KE = 2 * DAMPING * (1 + DAMPING) * (2 * np.pi * FREQUENCY_HZ) ** 2 / AMPLITUDE**2
FEED_M = 1e-6


def one_mode(damping_ratio: float = DAMPING, amplitude: float = AMPLITUDE) -> Blade:
    return Blade("one mode", ("tip",), damping_ratio, [ModalState(0.0, [FREQUENCY_HZ], [[amplitude]])])


def kept_in_contact(ke: float, elastic_recovery: float = 0.01, **liner) -> LinerRub:
    """One mode whose casing closes in: the contact is kept as long as the vibration is small."""
    material = AbradableLiner.from_cutting_stiffness(
        ke, elastic_recovery=elastic_recovery, thickness_m=20e-3, **liner
    )
    return LinerRub(one_mode(), ("tip",), material, Casing(0.25, 0.0, feed_per_revolution_m=FEED_M))


def rotor_37(
    nodes: tuple[str, ...] = ("LE",),
    ke: float = 1e4,
    friction: Friction | None = None,
    **liner,
) -> LinerRub:
    """NASA rotor 37 in a casing with two lobes that come in over five revolutions."""
    settings = {"elastic_recovery": 0.02, "yield_force_n": 10.0, "axial_width_m": 3.4e-3} | liner
    return LinerRub(
        example_blade("nasa_rotor_37"),
        nodes,
        AbradableLiner.from_cutting_stiffness(ke, **settings),
        Casing(0.252, 1e-4, ovalisation_m=2e-4, ovalisation_revolutions=3.0),
        friction,
    )

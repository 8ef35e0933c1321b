"""Which points of a blade's map are worth asking three times: where answers are most easily wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sdm_core.lobe_tips import CriticalSpeed
from training.answers import BoundaryAnswers

NEAR_BOUNDARY, LOBE_TIP, LOW_SPEED, ANYWHERE = "near boundary", "lobe tip", "low speed", "anywhere"
BESIDE = 0.02
"""How far from the boundary, relative to its K_e."""
_LOW = 0.1  # of the speed range


@dataclass(frozen=True)
class Point:
    """A rotor speed and a cutting stiffness, and why it was chosen."""

    kind: str
    speed_hz: float
    ke: float


def chosen_points(
    boundary: BoundaryAnswers, tips: Sequence[CriticalSpeed], ke_max: float, count: int, seed: int
) -> list[Point]:
    """Pairs on both sides of the boundary, at lobe tips and at the lowest speeds, and points anywhere.

    Parameters
    ----------
    boundary
        First crossings over the speeds of the map, by the exact core.
    tips
        Tips of its lobes, smallest K_e first.
    count
        Points in all; about a third by the boundary, and as many at tips and at low speeds together.
    seed
        Of the choice.
    """
    rng = np.random.default_rng(seed)
    low, high = float(boundary.speed_hz.min()), float(boundary.speed_hz.max())
    crossed = np.flatnonzero(boundary.critical_ke <= ke_max / (1 + BESIDE))
    slow = crossed[boundary.speed_hz[crossed] <= low + _LOW * (high - low)]
    pairs: list[tuple[str, float, float]] = []
    pairs += [(LOBE_TIP, tip.speed_hz, tip.ke) for tip in tips[: max(1, count // 10)] if tip.ke < ke_max]
    for kind, among, many in ((LOW_SPEED, slow, count // 10), (NEAR_BOUNDARY, crossed, count // 6)):
        for i in rng.permutation(among)[: max(1, many)]:
            pairs.append((kind, float(boundary.speed_hz[i]), float(boundary.critical_ke[i])))
    points = [Point(kind, speed, ke * (1 + side)) for kind, speed, ke in pairs for side in (-BESIDE, BESIDE)]
    points = [point for point in points if point.ke <= ke_max][:count]
    while len(points) < count:
        points.append(Point(ANYWHERE, float(rng.uniform(low, high)), float(rng.uniform(0.0, ke_max))))
    return points

"""Campbell diagram: natural frequencies and engine orders, with the lobes' deepest speeds over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sdm_core.assessment.mode_lobes import nearest_mode
from sdm_core.blade import Blade
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import CriticalSpeed, check_range

DEFAULT_ORDERS = tuple(range(1, 13))
HIGHEST_ORDER = 1000
_SPEEDS_DRAWN = 200
# A root of the polynomial counts as real up to this much of the interval: touches are double roots,
# which rounding moves off the axis by its square root.
_OFF_AXIS = 1e-6


@dataclass(frozen=True)
class OrderCrossing:
    """A rotor speed at which an engine order excites a mode: f_j(Ω) = kΩ.

    Attributes
    ----------
    order, mode
        k, and the number of the mode counted from 1.
    speed_hz, frequency_hz
        Hz.
    """

    order: int
    mode: int
    speed_hz: float
    frequency_hz: float


@dataclass(frozen=True)
class LobePoint:
    """Deepest speed of a lobe in the Campbell diagram.

    Attributes
    ----------
    tip
        K_e, rotor speed, chatter frequency and wear lobes.
    mode
        Number of the mode with the nearest natural frequency at that speed, counted from 1.
    """

    tip: CriticalSpeed
    mode: int


@dataclass(frozen=True)
class CampbellDiagram:
    """Natural frequencies over rotor speed, engine orders, their crossings and the deepest speeds.

    Attributes
    ----------
    speed_hz
        Hz, shape (m,).
    frequency_hz
        Natural frequencies, Hz, shape (m, n).
    engine_orders
        Orders looked at.
    crossings
        All of them in the range, by rising speed.
    lobe_points
        Tips of the lobes, deepest first.
    """

    speed_hz: np.ndarray
    frequency_hz: np.ndarray
    engine_orders: tuple[int, ...]
    crossings: tuple[OrderCrossing, ...]
    lobe_points: tuple[LobePoint, ...]


def campbell_diagram(
    blade: Blade,
    speed_range_hz: tuple[float, float],
    *,
    engine_orders: Sequence[int] = DEFAULT_ORDERS,
    tips: Sequence[CriticalSpeed] = (),
) -> CampbellDiagram:
    """Campbell diagram of a blade over a range of rotor speeds.

    Parameters
    ----------
    speed_range_hz
        Hz.
    engine_orders
        Whole numbers from 1 up.
    tips
        Deepest speeds of the lobes, from `least_critical_ke` with a large count. In permanent contact they
        lie near orders k + 3/4: chatter at a tip is a quarter wave ahead of whole lobes.

    Raises
    ------
    InvalidInput
        For an unusable range or order.
    OutOfSpeedRange
        Where the blade's modal data do not reach.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> found = campbell_diagram(example_blade("nasa_rotor_37"), (60.0, 300.0), engine_orders=[4])
    >>> [(c.order, c.mode, round(c.speed_hz, 2)) for c in found.crossings]
    [(4, 1, 282.1)]
    """
    check_range(*speed_range_hz)
    orders = _checked_orders(engine_orders)
    speed = np.linspace(*speed_range_hz, _SPEEDS_DRAWN)
    frequency = blade.at_speeds(speed)[0] / (2 * np.pi)
    crossings = [crossing for order in orders for crossing in _crossings_of(blade, speed_range_hz, order)]
    points = []
    for tip in tips:
        natural = blade.at_speeds(np.array([tip.speed_hz]))[0][0] / (2 * np.pi)
        points.append(LobePoint(tip, nearest_mode(natural, tip.chatter_hz)))
    return CampbellDiagram(
        speed,
        frequency,
        orders,
        tuple(sorted(crossings, key=lambda c: (c.speed_hz, c.order))),
        tuple(points),
    )


def _crossings_of(blade: Blade, speed_range_hz: tuple[float, float], order: int) -> list[OrderCrossing]:
    """Roots of ω_j²(x) − (2πk)²x over x = Ω², in which ω_j² is a cubic between two states."""
    low, high = (speed**2 for speed in speed_range_hz)
    states = [s.speed_hz**2 for s in blade.states if low < s.speed_hz**2 < high]
    out: list[OrderCrossing] = []
    for a, b in pairwise([low, *states, high]):
        at = np.polynomial.chebyshev.chebpts2(4)
        x = 0.5 * (a + b) + 0.5 * (b - a) * at
        # Within the interval, not beyond it by rounding.
        x[0], x[-1] = a, b
        excess = blade.at_speeds(np.sqrt(x))[0] ** 2 - (2 * np.pi * order) ** 2 * x[:, None]
        for j in range(blade.mode_count):
            for root in _real_roots(at, excess[:, j]):
                if root == 1.0 and b < high:
                    continue  # the next interval begins there
                speed = float(np.clip(np.sqrt(0.5 * (a + b) + 0.5 * (b - a) * root), *speed_range_hz))
                out.append(OrderCrossing(order, j + 1, speed, order * speed))
    return out


def _real_roots(at: np.ndarray, values: np.ndarray) -> list[float]:
    """Roots in [−1, 1] of the cubic through four points."""
    cubic = np.polynomial.Polynomial(np.linalg.solve(np.vander(at, increasing=True), values))
    # Leading coefficients that are rounding only would bring roots from nowhere.
    cubic = cubic.trim(1e-13 * np.abs(cubic.coef).max())
    found = cubic.roots()
    real = np.sort(found.real[np.abs(found.imag) < _OFF_AXIS])
    slope = cubic.deriv()
    # One step of Newton's method takes off what the eigenvalue solver left.
    real = np.array([x - cubic(x) / slope(x) if slope(x) != 0 else x for x in real])
    inside = np.abs(real) <= 1 + 1e-12
    return [float(np.clip(x, -1, 1)) for x in real[inside]]


def _checked_orders(engine_orders: Sequence[int]) -> tuple[int, ...]:
    for i, order in enumerate(engine_orders):
        whole = isinstance(order, int | np.integer) and not isinstance(order, bool)
        if not whole or not 1 <= order <= HIGHEST_ORDER:
            raise InvalidInput(f"engine_orders[{i}]", order, f"give a whole number from 1 to {HIGHEST_ORDER}")
    return tuple(sorted({int(order) for order in engine_orders}))

"""The casing that the blade runs in: how far away it is, and how that changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sdm_core.errors import InvalidInput
from sdm_core.time_domain.liner.abradable_liner import LENGTH_LIMIT, per_node
from sdm_core.validation import number

MOST_LOBES = 200


@dataclass(frozen=True)
class Casing:
    """A rigid casing, ovalised by m lobes, that may close in on the blade.

    Gap between a tip node at rest and the liner as it was when new, at angle θ and after q revolutions:

        g_i(θ, q) = clearance_i − a(q) cos(mθ) − feed · q,    a(q) = ovalisation · min(1, q/q₀).

    The casing is nearest at θ = 0, 2π/m, ...: there the tip touches first.

    Parameters
    ----------
    radius_m
        R, m.
    clearance_m
        Gap of the round casing, m, one number or one a contact node (along the chord).
    ovalisation_m
        Amplitude, m.
    lobes
        m.
    ovalisation_revolutions
        q₀, revolutions over which the casing is ovalised; 0 is at once.
    feed_per_revolution_m
        What the casing closes in by each revolution, m.
    interference
        Says that the tip may reach into the liner before anything moves.

    Raises
    ------
    InvalidInput
        For numbers out of range, and where the tip reaches into the liner at the start.

    Examples
    --------
    >>> Casing(0.25, 2e-4, ovalisation_m=1e-4).gap(1, 4)[0].round(6)
    array([0.0001, 0.0003, 0.0001, 0.0003])
    """

    radius_m: float
    clearance_m: float | tuple[float, ...]
    ovalisation_m: float = 0.0
    lobes: int = 2
    ovalisation_revolutions: float = 0.0
    feed_per_revolution_m: float = 0.0
    interference: bool = False

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "radius_m", number("radius_m", self.radius_m, 0.0, 1e3, "m", open_low=True))
        put(self, "ovalisation_m", number("ovalisation_m", self.ovalisation_m, 0.0, LENGTH_LIMIT, "m"))
        put(
            self,
            "ovalisation_revolutions",
            number("ovalisation_revolutions", self.ovalisation_revolutions, 0.0, 1e6, ""),
        )
        put(
            self,
            "feed_per_revolution_m",
            number("feed_per_revolution_m", self.feed_per_revolution_m, 0.0, LENGTH_LIMIT, "m"),
        )
        if (
            isinstance(self.lobes, bool)
            or not isinstance(self.lobes, int)
            or not 1 <= self.lobes <= MOST_LOBES
        ):
            raise InvalidInput("lobes", self.lobes, f"give a whole number from 1 to {MOST_LOBES}")
        if not isinstance(self.clearance_m, int | float | np.number):
            each = per_node("clearance_m", self.clearance_m, len(self.clearance_m), *_LIMITS, "m")
            put(self, "clearance_m", tuple(each.tolist()))
        self._refuse_interference()

    def clearances(self, nodes: int) -> np.ndarray:
        """Clearance of each of `nodes` contact nodes, m, shape (r,)."""
        return per_node("casing.clearance_m", self.clearance_m, nodes, *_LIMITS, "m")

    def gap(self, nodes: int, cells: int, revolution: float = 0.0) -> np.ndarray:
        """Gap to the new liner over the revolution that follows `revolution`, m, shape (r, cells).

        Each cell stands where it is met: its angle is that of its middle, and the casing has come in by the
        time the blade gets there. Angles are counted from the middle of the first cell.
        """
        turn = np.arange(cells) / cells
        passed = revolution + turn
        grown = (
            1.0 if self.ovalisation_revolutions == 0 else np.minimum(1, passed / self.ovalisation_revolutions)
        )
        inward = self.ovalisation_m * grown * np.cos(2 * np.pi * self.lobes * turn)
        return self.clearances(nodes)[:, None] - inward - self.feed_per_revolution_m * passed

    def _refuse_interference(self) -> None:
        clearance: Any = np.atleast_1d(np.asarray(self.clearance_m, dtype=float))
        for i, value in enumerate(clearance):
            field = "clearance_m" if len(clearance) == 1 else f"clearance_m[{i}]"
            number(field, float(value), *_LIMITS, "m")
            at_once = self.ovalisation_m if self.ovalisation_revolutions == 0 else 0.0
            if not self.interference and value - at_once < 0:
                why = "" if value < 0 else f" under an ovalisation of {at_once:g} m"
                raise InvalidInput(
                    field,
                    float(value),
                    f"the tip reaches into the liner before anything moves{why}: give more clearance, let "
                    "the ovalisation grow (ovalisation_revolutions), or say interference=True",
                )


_LIMITS = (-LENGTH_LIMIT, LENGTH_LIMIT)

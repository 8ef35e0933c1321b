"""Clearance consumption: how far growth, untwist and vibration close the gap between tip and casing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sdm_core.assessment.tip_motion import tip_motion
from sdm_core.blade import Blade
from sdm_core.blade.over_speed import over_speed
from sdm_core.errors import InvalidInput
from sdm_core.lobe_tips import check_range
from sdm_core.validation import number, vector

_SPEEDS = 41


@dataclass(frozen=True)
class ClearanceUse:
    """Clearance from leading to trailing edge over rotor speed.

    Attributes
    ----------
    nodes
        Names of the r tip nodes.
    speed_hz
        Hz, shape (m,).
    growth_m
        Static displacement towards the casing by rotation, m, shape (m, r); None where the blade does not
        give it. It holds what the untwist contributes: the two are not to be added.
    untwist_rad
        Turn of the tip's chord by rotation, rad, shape (m,); None where not given.
    cold_clearance_m, running_clearance_m
        Gap at rest, m, shape (r,); and left at speed, shape (m, r): below 0 the tip cuts into the liner
        without any vibration. None where no cold clearance was given. Without growth the running clearance is
        the cold one, and `missing` says so.
    contact_per_tip
        Displacement towards the casing at each node over the largest tip displacement (the length of the
        vector), mode by mode, shape (m, n, r): mm per mm of vibration.
    contact_per_coordinate
        The same per unit modal coordinate (kg^½ m): the mass-normalised amplitude, kg^-1/2, shape (m, n, r).
    missing
        What the blade does not give, and what follows from that, in words.
    """

    nodes: tuple[str, ...]
    speed_hz: np.ndarray
    growth_m: np.ndarray | None
    untwist_rad: np.ndarray | None
    cold_clearance_m: np.ndarray | None
    running_clearance_m: np.ndarray | None
    contact_per_tip: np.ndarray
    contact_per_coordinate: np.ndarray
    missing: tuple[str, ...]

    @property
    def touching_tip_m(self) -> np.ndarray | None:
        """Vibration at which each node touches: the largest tip displacement (half the peak-to-peak), m,
        shape (m, n, r); infinite where the node does not move towards the casing, 0 where it rubs already."""
        return self._touching(self.contact_per_tip)

    @property
    def touching_coordinate(self) -> np.ndarray | None:
        """The same as modal coordinate, kg^½ m, shape (m, n, r)."""
        return self._touching(self.contact_per_coordinate)

    @property
    def first_to_touch(self) -> tuple[tuple[str, ...], ...] | None:
        """Node that touches first, by speed and mode: m rows of n names."""
        touching = self.touching_tip_m
        if touching is None or self.running_clearance_m is None:
            return None
        # Where several rub already, the deepest; else the first that vibration brings into contact.
        order = np.where(
            (self.running_clearance_m <= 0)[:, None, :], self.running_clearance_m[:, None, :], touching
        )
        return tuple(tuple(self.nodes[i] for i in row) for row in order.argmin(axis=2))

    @property
    def tightest(self) -> tuple[str, ...] | None:
        """Node with the least running clearance at each speed, without vibration."""
        if self.running_clearance_m is None:
            return None
        return tuple(self.nodes[i] for i in self.running_clearance_m.argmin(axis=1))

    def _touching(self, moved: np.ndarray) -> np.ndarray | None:
        if self.running_clearance_m is None:
            return None
        gap = np.maximum(self.running_clearance_m, 0.0)[:, None, :]
        still = np.abs(moved) == 0
        return np.where(still & (gap > 0), np.inf, gap / np.where(still, 1.0, np.abs(moved)))


def clearance_use(
    blade: Blade,
    speed_range_hz: tuple[float, float],
    cold_clearance_m: float | Sequence[float] | None = None,
) -> ClearanceUse:
    """Growth, untwist and vibration of the tip against the clearance, over a range of speeds.

    Parameters
    ----------
    speed_range_hz
        Hz.
    cold_clearance_m
        Gap at rest in the contact direction, one number or one a tip node, m.

    Raises
    ------
    InvalidInput
        For an unusable range or clearance.
    OutOfSpeedRange
        Where the blade's modal data do not reach.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> found = clearance_use(example_blade("nasa_rotor_37"), (60.0, 300.0), 4e-4)
    >>> found.first_to_touch[0][:2]
    ('LE', 'LE')
    """
    check_range(*speed_range_hz)
    speed = np.linspace(*speed_range_hz, _SPEEDS)
    motion = tip_motion(blade, speed)
    largest = motion.magnitude.max(axis=2, keepdims=True)
    growth, untwist = over_speed(blade, "tip_growth_m", speed), over_speed(blade, "untwist_rad", speed)
    cold = None if cold_clearance_m is None else _cold(blade, cold_clearance_m)
    missing = list(motion.missing)
    if not motion.in_space:
        missing.append(
            "displacement per tip displacement is an upper bound, and the vibration at which a node touches "
            "a lower one: the tip may move more in a direction that is not known"
        )
    if growth is None:
        missing.append("tip_growth_m: running clearance is taken as the cold one, which is unsafe")
    if untwist is None:
        missing.append("untwist_rad: the turn of the tip by rotation is not known")
    if cold is None:
        missing.append("cold_clearance_m: no running clearance and no amplitudes that touch")
    running = None
    if cold is not None:
        running = np.broadcast_to(cold, (len(speed), len(cold))) - (0.0 if growth is None else growth)
    return ClearanceUse(
        blade.tip_nodes,
        speed,
        growth,
        untwist,
        cold,
        running,
        motion.contact / np.where(largest > 0, largest, 1.0),
        np.array(motion.contact),
        tuple(missing),
    )


def _cold(blade: Blade, clearance: float | Sequence[float]) -> np.ndarray:
    if isinstance(clearance, int | float | np.number):
        one = number("cold_clearance_m", clearance, 0.0, 1.0, "m")
        return np.full(len(blade.tip_nodes), one)
    each = vector("cold_clearance_m", clearance, 0.0, 1.0, "m")
    if len(each) != len(blade.tip_nodes):
        raise InvalidInput(
            "cold_clearance_m",
            f"{len(each)} numbers",
            f"give one number, or one a tip node: {len(blade.tip_nodes)}",
        )
    return each

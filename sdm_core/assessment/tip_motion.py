"""Motion of the tip nodes in space at a rotor speed, as far as a blade's file tells it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.blade import Blade
from sdm_core.blade.over_speed import over_speed

# Below this slope of the tip line the casing-normal amplitude hardly holds any axial motion, and
# taking it from there would magnify the error of the slope more than twentyfold.
LEAST_SLOPE = 0.05


@dataclass(frozen=True)
class TipMotion:
    """Mass-normalised motion of the tip nodes, each of shape (m, n, r), kg^-1/2.

    Attributes
    ----------
    contact
        In the contact direction.
    radial, tangential, axial
        Along the cylindrical directions, None where not known.
    axial_derived
        True where the axial motion follows from the casing-normal and the radial one by the slope of
        the tip line, instead of being given.
    missing
        What the blade does not give, in words.
    """

    contact: np.ndarray
    radial: np.ndarray | None
    tangential: np.ndarray | None
    axial: np.ndarray | None
    axial_derived: bool
    missing: tuple[str, ...]

    @property
    def in_space(self) -> bool:
        """True where the whole displacement vector is known."""
        return self.radial is not None and self.tangential is not None and self.axial is not None

    @property
    def magnitude(self) -> np.ndarray:
        """Length of the displacement vector, shape (m, n, r), at least: of the directions known.

        In the plane of axis and radius the contact amplitude itself is such a length.
        """
        meridional = self.contact**2
        if self.radial is not None:
            axial = 0.0 if self.axial is None else self.axial**2
            meridional = np.maximum(meridional, self.radial**2 + axial)
        tangential = 0.0 if self.tangential is None else self.tangential**2
        return np.sqrt(meridional + tangential)


def tip_motion(blade: Blade, speed_hz: np.ndarray) -> TipMotion:
    """Motion of the tip at rotor speeds, interpolated in Ω² as the blade's own mode shapes are.

    Casing-normal amplitudes are u_n = (u_r − s u_z)/√(1 + s²) with s = dr/dz of the casing. Where
    the axial motion u_z is not given but u_r, the tip line and its slope s are, it follows from
    there, taking the casing to run parallel to the tip.

    Parameters
    ----------
    speed_hz
        Hz, shape (m,).

    Raises
    ------
    OutOfSpeedRange
        Where the blade's modal data do not reach.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> motion = tip_motion(example_blade("nasa_rotor_37"), np.array([250.0]))
    >>> motion.in_space, motion.axial_derived
    (True, True)
    """
    contact = blade.at_speeds(speed_hz)[1]
    radial, tangential, axial = (
        over_speed(blade, f"mode_shape_{direction}", speed_hz)
        for direction in ("radial", "tangential", "axial")
    )
    if radial is None and blade.direction == "radial":
        radial = contact
    derived, missing = False, []
    if axial is None and radial is not None and (slope := _casing_slope(blade)) is not None:
        axial, derived = (radial - np.hypot(1.0, slope) * contact) / slope, True
        missing.append(
            "mode_shape_axial: derived from the casing-normal and radial amplitudes and the slope of the tip"
        )
    missing += [
        f"mode_shape_{name}: the motion in this direction is not known"
        for name, shape in (("radial", radial), ("tangential", tangential), ("axial", axial))
        if shape is None
    ]
    return TipMotion(contact, radial, tangential, axial, derived, tuple(missing))


def _casing_slope(blade: Blade) -> np.ndarray | None:
    """dr/dz at the tip nodes, shape (r,); None where not known or too flat to derive from."""
    if blade.direction != "casing_normal" or blade.tip_radius_m is None or blade.tip_z_m is None:
        return None
    if len(blade.tip_nodes) < 3 or (np.diff(blade.tip_z_m) == 0).any():
        return None
    slope = np.gradient(np.array(blade.tip_radius_m), np.array(blade.tip_z_m))
    return slope if (np.abs(slope) >= LEAST_SLOPE).all() else None

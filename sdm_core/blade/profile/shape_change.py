"""Lean, sweep, thickness, stagger and chord of any blade changed a little, for derivatives and studies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from sdm_core.blade.profile.aerofoil import area_centroid
from sdm_core.blade.profile.blade_profile import BladeProfile
from sdm_core.blade.profile.sections import SectionTable
from sdm_core.validation import number

# Of the differences that give derivatives: small against what bends K_e, large against the rounding of modes.
STEPS = {"lean_deg": 0.2, "sweep_deg": 0.2, "stagger_deg": 0.2, "thickness": 0.01, "chord": 0.01}


@dataclass(frozen=True)
class ShapeChange:
    """A change of every section of a blade, which stays between its hub and its casing.

    Parameters
    ----------
    lean_deg, sweep_deg
        Tilt of the stacking line about the root, towards the rotation and downstream, degrees.
    stagger_deg
        Turn of each section about its centroid, degrees; positive: the trailing edge leads more.
    thickness, chord
        Factors; a section's chord grows about its centroid at the same thickness.

    Examples
    --------
    >>> ShapeChange.from_mapping({"thickness": 1.1}).thickness
    1.1
    """

    lean_deg: float = 0.0
    sweep_deg: float = 0.0
    stagger_deg: float = 0.0
    thickness: float = 1.0
    chord: float = 1.0

    def __post_init__(self) -> None:
        for name in ("lean_deg", "sweep_deg", "stagger_deg"):
            number(name, getattr(self, name), -30.0, 30.0, "degrees")
        for name in ("thickness", "chord"):
            number(name, getattr(self, name), 0.2, 5.0, "times as much")

    @classmethod
    def from_mapping(cls, values: Mapping[str, float]) -> ShapeChange:
        return cls(**values)

    @classmethod
    def nominal(cls) -> dict[str, float]:
        """No change, by parameter."""
        return {field.name: float(getattr(cls(), field.name)) for field in fields(cls)}

    def of_profile(self, profile: BladeProfile) -> BladeProfile:
        """The profile with its sections changed: as a table, also where it was parametric."""
        tip = profile.tip
        if tip.casing_slope is None:
            tip = replace(tip, casing_slope=profile.casing_slope)
        return replace(profile, shape=self.of_sections(profile.sections()), edge_cut=profile.cut, tip=tip)

    def of_sections(self, table: SectionTable) -> SectionTable:
        """The changed sections."""
        radius = np.array([side[..., 1].mean() for side in table.sides])
        return SectionTable(
            [self._of_section(side, r - radius[0], r) for side, r in zip(table.sides, radius, strict=True)]
        )

    def _of_section(self, side: np.ndarray, height: float, radius: float) -> np.ndarray:
        """One section, unrolled on the cylinder of its mean radius, as (z, r, θ) again."""
        flat = np.stack((side[..., 0], radius * side[..., 2]), axis=-1)
        centre = area_centroid(np.concatenate((flat[0], flat[1][::-1])))
        middle = flat.mean(axis=0)
        half = 0.5 * (flat[1] - flat[0])
        chord = (middle[-1] - middle[0]) / np.linalg.norm(middle[-1] - middle[0])
        # Along the chord only: the camber keeps its height, so that its angle falls as the chord grows.
        along = (middle - centre) @ chord
        middle = middle + (self.chord - 1.0) * np.outer(along, chord)
        flat = np.stack((middle - self.thickness * half, middle + self.thickness * half))
        turn = np.radians(self.stagger_deg)
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        tilt = height * np.tan(np.radians([self.sweep_deg, self.lean_deg]))
        flat = (flat - centre) @ rotation.T + centre + tilt
        z, y = flat[..., 0], flat[..., 1]
        # The surface of revolution stays: r is that of the section's own meridional line at the new z.
        return np.stack((z, _meridional(side, z), y / radius), axis=-1)


def _meridional(side: np.ndarray, z: np.ndarray) -> np.ndarray:
    """r of the surface a section lies on at z, straight on beyond its ends."""
    line = side.mean(axis=0)[:, :2]
    line = line[np.argsort(line[:, 0])]
    inside = np.interp(z, line[:, 0], line[:, 1])
    reach = max(len(line) // 20, 1)
    for end, within in ((0, reach), (-1, -1 - reach)):
        slope = (line[end, 1] - line[within, 1]) / (line[end, 0] - line[within, 0])
        beyond = z < line[0, 0] if end == 0 else z > line[-1, 0]
        inside = np.where(beyond, line[end, 1] + slope * (z - line[end, 0]), inside)
    return inside

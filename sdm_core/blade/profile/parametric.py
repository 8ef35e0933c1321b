"""A compressor blade from a handful of parameters, each given from hub to tip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from sdm_core.blade.profile.aerofoil import Aerofoil, area_centroid
from sdm_core.blade.profile.sections import SectionTable
from sdm_core.errors import InvalidInput
from sdm_core.validation import number, vector

FromHubToTip = float | Sequence[float]

# Above it a section runs along the circumference, and its edges meet those of its neighbours.
STEEPEST_EDGE_DEG = 85.0
_MOST_VALUES = 21
_SECTIONS = 13
_CHORD_POINTS = 101


@dataclass(frozen=True)
class ParametricBlade:
    """Sections with a circular-arc camber line on cylinders, their centroids stacked on a line.

    Whatever varies over the span is a number, or a list of numbers evenly spaced from hub to tip: two
    make it linear, three a parabola, more a cubic spline.

    Parameters
    ----------
    span_m, hub_radius_m
        Along the stacking line, and radius of the root there, m.
    chord_m
        Hub to tip, m.
    thickness_ratio
        Largest thickness over chord, hub to tip.
    stagger_deg
        Chord against the rotor's axis, degrees, hub to tip; positive: the trailing edge leads.
    camber_deg
        Turning of the camber line, degrees, hub to tip.
    lean_deg, sweep_deg
        Of the stacking line against the radius, towards the rotation and downstream, degrees; a list
        gives the local angle hub to tip.
    edge_cut
        Share of the camber line cut off at each edge, which makes it blunt.
    edge_thickness_ratio
        Thickness at the uncut edge over the largest.
    casing_slope, hub_slope
        dr/dz of the casing and of the hub.

    Raises
    ------
    InvalidInput
        For values no blade has, naming parameter, value and range.

    Examples
    --------
    >>> blade = ParametricBlade(span_m=0.08, hub_radius_m=0.2, chord_m=0.04, thickness_ratio=0.08)
    >>> blade.sections().sides[0].shape
    (2, 101, 3)
    """

    span_m: float
    hub_radius_m: float
    chord_m: FromHubToTip
    thickness_ratio: FromHubToTip
    stagger_deg: FromHubToTip = 0.0
    camber_deg: FromHubToTip = 0.0
    lean_deg: FromHubToTip = 0.0
    sweep_deg: FromHubToTip = 0.0
    edge_cut: float = 0.01
    edge_thickness_ratio: float = 0.08
    casing_slope: float = 0.0
    hub_slope: float = 0.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        limits = {
            "span_m": (1e-3, 5.0, "m"),
            "hub_radius_m": (1e-3, 5.0, "m"),
            "edge_cut": (0.0, 0.2, "of the chord"),
            "edge_thickness_ratio": (0.0, 1.0, ""),
            "casing_slope": (-1.5, 1.5, ""),
            "hub_slope": (-1.5, 1.5, ""),
        }
        for name, (low, high, unit) in limits.items():
            put(self, name, number(name, getattr(self, name), low, high, unit))
        over_span = {
            "chord_m": (1e-3, 2.0, "m"),
            "thickness_ratio": (5e-3, 0.5, ""),
            "stagger_deg": (-STEEPEST_EDGE_DEG, STEEPEST_EDGE_DEG, "degrees"),
            "camber_deg": (-120.0, 120.0, "degrees"),
            "lean_deg": (-60.0, 60.0, "degrees"),
            "sweep_deg": (-60.0, 60.0, "degrees"),
        }
        for name, (low, high, unit) in over_span.items():
            put(self, name, _from_hub_to_tip(name, getattr(self, name), low, high, unit))
        self._check_edges()

    def _check_edges(self) -> None:
        h = np.linspace(0.0, 1.0, _SECTIONS)
        stagger, camber = _over_span(self.stagger_deg, h), _over_span(self.camber_deg, h)
        steepest = np.abs(stagger) + 0.5 * np.abs(camber)
        if steepest.max() > STEEPEST_EDGE_DEG:
            i = int(np.argmax(steepest))
            raise InvalidInput(
                "stagger_deg",
                f"{stagger[i]:.4g} with camber {camber[i]:.4g} at {100 * h[i]:.0f} % of the span",
                f"keep |stagger| + |camber|/2 below {STEEPEST_EDGE_DEG:g} degrees, or an edge runs backwards",
            )
        for name, low in (("chord_m", 0.0), ("thickness_ratio", 0.0)):
            between = _over_span(getattr(self, name), h)
            if between.min() <= low:
                raise InvalidInput(
                    name,
                    f"{between.min():.4g} at {100 * h[int(np.argmin(between))]:.0f} % of the span",
                    "the curve through the values must stay above 0: give values that vary less",
                )

    def sections(self) -> SectionTable:
        """The sections, stacked on their centroids along the leaning and swept line.

        Raises
        ------
        InvalidInput
            When hub and casing meet within the chord.
        """
        h = np.linspace(0.0, 1.0, _SECTIONS)
        chord, ratio = _over_span(self.chord_m, h), _over_span(self.thickness_ratio, h)
        stagger = np.radians(_over_span(self.stagger_deg, h))
        camber = np.radians(_over_span(self.camber_deg, h))
        shift_z = self.span_m * _integral_of_tangent(self.sweep_deg, h)
        shift_y = self.span_m * _integral_of_tangent(self.lean_deg, h)
        s = np.linspace(0.0, 1.0, _CHORD_POINTS)
        sides = []
        for i in range(len(h)):
            flat = Aerofoil(chord[i], ratio[i] * chord[i], camber[i], self.edge_thickness_ratio).sides(s)
            flat = flat - area_centroid(np.concatenate((flat[0], flat[1][::-1])))
            along, across = flat[..., 0], flat[..., 1]
            z = along * np.cos(stagger[i]) - across * np.sin(stagger[i]) + shift_z[i]
            y = along * np.sin(stagger[i]) + across * np.cos(stagger[i]) + shift_y[i]
            sides.append(self._on_surface(h[i], z, y))
        return SectionTable(sides)

    def _on_surface(self, h: float, z: np.ndarray, y: np.ndarray) -> np.ndarray:
        """A flat section wrapped on the surface of revolution at span fraction h, as (z, r, θ)."""
        hub = self.hub_radius_m + self.hub_slope * z
        tip = self.hub_radius_m + self.span_m + self.casing_slope * z
        if hub.min() <= 0 or (tip - hub).min() <= 0.02 * self.span_m:
            raise InvalidInput(
                "casing_slope",
                f"{self.casing_slope:g} with hub_slope {self.hub_slope:g}",
                "hub and casing meet (or the hub meets the axis) within the chord: give smaller slopes",
            )
        radius = hub + h * (tip - hub)
        stacking_radius = self.hub_radius_m + h * self.span_m
        return np.stack((z, radius, y / stacking_radius), axis=-1)


def _from_hub_to_tip(name: str, value: FromHubToTip, low: float, high: float, unit: str) -> FromHubToTip:
    if isinstance(value, int | float | np.number):
        return number(name, value, low, high, unit)
    values = vector(name, value, low, high, unit)
    if len(values) > _MOST_VALUES:
        raise InvalidInput(name, f"{len(values)} numbers", f"give at most {_MOST_VALUES}, hub to tip")
    return tuple(float(v) for v in values) if len(values) > 1 else float(values[0])


def _over_span(value: FromHubToTip, h: np.ndarray) -> np.ndarray:
    values = np.atleast_1d(np.asarray(value, dtype=float))
    if len(values) == 1:
        return np.full(len(h), values[0])
    place = np.linspace(0.0, 1.0, len(values))
    return make_interp_spline(place, values, k=min(3, len(values) - 1))(h)


def _integral_of_tangent(angle_deg: FromHubToTip, h: np.ndarray) -> np.ndarray:
    """Displacement of the stacking line over the span, of which the angle is the slope."""
    fine = np.linspace(0.0, 1.0, 10 * (len(h) - 1) + 1)
    slope = np.tan(np.radians(_over_span(angle_deg, fine)))
    total = np.concatenate(([0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(fine))))
    return total[::10]

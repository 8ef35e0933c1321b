"""One blade section in the plane: circular-arc camber line and biparabolic thickness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Aerofoil:
    """A section in its own axes: x along the chord from the leading edge, y towards the suction side.

    The camber line is an arc of a circle that turns by `camber_rad` from leading to trailing edge; the
    thickness, normal to it, is a parabola along the chord over a thickness at the edges:

        t(s) = t_max [e + (1 − e) 4s(1 − s)],   s = x/c

    Parameters
    ----------
    chord_m, thickness_m
        Chord and largest thickness, m.
    camber_rad
        Turning of the camber line, rad, |camber| < π.
    edge_thickness_ratio
        e, thickness at the edges over the largest.
    """

    chord_m: float
    thickness_m: float
    camber_rad: float
    edge_thickness_ratio: float

    def sides(self, s: np.ndarray) -> np.ndarray:
        """Points of the pressure and the suction side at chord fractions, m, shape (2, len(s), 2)."""
        x = self.chord_m * s
        half_turn = 0.5 * self.camber_rad
        if abs(half_turn) < 1e-9:
            camber, slope = np.zeros_like(x), np.zeros_like(x)
        else:
            radius = 0.5 * self.chord_m / np.sin(half_turn)
            across = x - 0.5 * self.chord_m
            height = np.sqrt(radius**2 - across**2) * np.sign(half_turn)
            camber, slope = height - radius * np.cos(half_turn), -across / height
        normal = np.stack((-slope, np.ones_like(slope))) / np.hypot(1.0, slope)
        e = self.edge_thickness_ratio
        half = 0.5 * self.thickness_m * (e + (1 - e) * 4 * s * (1 - s))
        middle = np.stack((x, camber))
        return np.stack(((middle - half * normal).T, (middle + half * normal).T))


def area_centroid(outline: np.ndarray) -> np.ndarray:
    """Centroid of the area inside a closed polygon, shape (2,); `outline` has shape (m, 2).

    Examples
    --------
    >>> area_centroid(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]))
    array([1. , 0.5])
    """
    following = np.roll(outline, -1, axis=0)
    cross = outline[:, 0] * following[:, 1] - following[:, 0] * outline[:, 1]
    return ((outline + following) * cross[:, None]).sum(axis=0) / (3 * cross.sum())

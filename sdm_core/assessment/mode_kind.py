"""Modes named bending or torsion, from the tip's translation against its rotation."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from sdm_core.assessment.tip_motion import tip_motion
from sdm_core.blade import Blade
from sdm_core.errors import InvalidInput

# A tip that turns about a point d from mid-chord has translation against rotation 12 d²/c². Rotation
# takes two thirds of the whole up to d = c/√24 = 0.20 c: the axis lies between 30 and 70 % of the chord,
# where blades have their elastic axis. Translation does from d = c/√6 = 0.41 c on: the axis is near an edge
# or off the blade. Between the two the mode is neither, and is called mixed.
DOMINANT = 2 / 3
FEWEST_NODES = 3
"""Two tip nodes show no bending along the chord."""


class Kind(StrEnum):
    """What a mode does at the tip."""

    FLAP = "flap bending"
    EDGEWISE = "edgewise bending"
    BENDING = "bending"
    TORSION = "torsion"
    CHORDWISE = "chordwise bending"
    MIXED = "mixed"
    STILL = "no motion at the tip"


_LETTERS = {
    Kind.FLAP: "F",
    Kind.EDGEWISE: "E",
    Kind.BENDING: "B",
    Kind.TORSION: "T",
    Kind.CHORDWISE: "C",
    Kind.MIXED: "M",
    Kind.STILL: "-",
}


@dataclass(frozen=True)
class ModeKind:
    """One mode named.

    Attributes
    ----------
    mode, frequency_hz
        Number counted from 1; Hz, at the state it was named at.
    kind
        What takes `DOMINANT` of the tip's motion; bending is split into flap and edgewise where the
        direction of the chord is known.
    label
        ``1F``, ``2B``, ``1T``, ``1C``: counted by rising frequency within its kind among the modes of the
        blade, for a tip line alone does not show nodal lines along the span. ``M`` where mixed.
    translation, rotation, unexplained
        Shares of the tip's motion squared, adding up to 1: the tip line moved as a whole, turned about its
        middle, and what a rigid tip cannot do (it bends along the chord).
    flap_share
        Of the translation, the share normal to the chord; None where its direction is not known.
    axis_from_le
        Where along the tip line the rotation is centred, 0 at the leading and 1 at the trailing edge: the
        point that stands still normal to the chord. None without rotation.
    approximate
        Why the shares are an approximation, in words; empty where they are exact.
    """

    mode: int
    frequency_hz: float
    kind: Kind
    label: str
    translation: float
    rotation: float
    unexplained: float
    flap_share: float | None
    axis_from_le: float | None
    approximate: str

    @property
    def described(self) -> str:
        """In words, with the shares where the mode is mixed."""
        if self.kind is not Kind.MIXED:
            return f"{self.label}, {self.kind}"
        return (
            f"{self.label}, mixed: {self.translation:.0%} translation, {self.rotation:.0%} rotation, "
            f"{self.unexplained:.0%} bending along the chord"
        )


def mode_kinds(blade: Blade, speed_hz: float | None = None) -> tuple[ModeKind, ...]:
    """Every mode named by what the tip does.

    With tangential and axial motion, tip radius, z and θ, a rigid tip moves by u_t = a_t + αz and
    u_z = a_z − αs, where z and s = r̄θ are measured from the middle of the tip line; a_t, a_z, α are
    fitted by least squares over the length of the line. Centred, translation, rotation and
    remainder are orthogonal, so their squares add up.

    With less, each direction known is split by itself into its mean, its slope along the tip and
    the remainder. That is the same wherever the motion has one direction along the chord, which is
    normal to it; from contact amplitudes alone, the slope of the casing is taken for constant too.

    Parameters
    ----------
    speed_hz
        The state nearest this speed is named; None is the slowest.

    Raises
    ------
    InvalidInput
        For a blade with fewer than three tip nodes: rotation would not be told from bending.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> [kind.label for kind in mode_kinds(example_blade("nasa_rotor_37"))][:2]
    ['1B', '1T']
    """
    if len(blade.tip_nodes) < FEWEST_NODES:
        raise InvalidInput(
            "tip_nodes", list(blade.tip_nodes), "give three or more: two show no bending along the chord"
        )
    near = blade.states[0]
    if speed_hz is not None:
        near = min(blade.states, key=lambda state: abs(state.speed_hz - speed_hz))
    motion = tip_motion(blade, np.array([near.speed_hz]))
    place, reason = _along_tip(blade)
    weight = _line_weights(place)
    position = place - weight @ place
    tangential, axial = motion.tangential, motion.axial
    kinds = []
    for j, frequency in enumerate(near.frequency_hz):
        if tangential is not None and axial is not None and blade.tip_theta_rad is not None and not reason:
            kind = _in_space(blade, weight, tangential[0, j], axial[0, j])
            said = motion.missing[0] if motion.axial_derived else ""
        else:
            known = [u[0, j] for u in (tangential, axial) if u is not None]
            said = reason
            if not known:
                known = [motion.contact[0, j]]
                said = f"from contact amplitudes alone; {reason}".removesuffix("; ")
            elif motion.axial_derived:
                said = f"{reason}; {motion.missing[0]}".removeprefix("; ")
            kind = _by_direction(weight, position, known)
        kinds.append(replace(kind, mode=j + 1, frequency_hz=float(frequency), approximate=said))
    return _counted(kinds)


def _in_space(blade: Blade, weight: np.ndarray, tangential: np.ndarray, axial: np.ndarray) -> ModeKind:
    radius, z, theta = (np.array(v) for v in (blade.tip_radius_m, blade.tip_z_m, blade.tip_theta_rad))
    s = float(weight @ radius) * theta
    z, s = z - weight @ z, s - weight @ s
    moved = np.array([weight @ tangential, weight @ axial])
    inertia = weight @ (z**2 + s**2)
    turn = float(weight @ (tangential * z - axial * s) / inertia)
    whole = weight @ (tangential**2 + axial**2)
    chord = np.array([s[-1] - s[0], z[-1] - z[0]])
    length = np.linalg.norm(chord)
    normal = np.array([chord[1], -chord[0]]) / length
    along = float(moved @ normal)
    flap = along**2 / (moved @ moved) if moved @ moved > 0 else None
    # Normal to the chord the tip moves by along + turn·p, p measured towards the trailing edge.
    first = np.array([s[0], z[0]]) @ chord / length
    axis = float((-along / turn - first) / length) if turn != 0 else None
    return _named(float(moved @ moved), turn**2 * inertia, float(whole), flap, axis)


def _by_direction(weight: np.ndarray, position: np.ndarray, known: list[np.ndarray]) -> ModeKind:
    inertia = weight @ position**2
    mean = np.array([weight @ u for u in known])
    slope = np.array([weight @ (u * position) for u in known]) / inertia
    whole = sum(weight @ u**2 for u in known)
    axis = None
    if slope @ slope > 0:
        still = -(mean @ slope) / (slope @ slope)
        axis = float((still - position[0]) / (position[-1] - position[0]))
    return _named(float(mean @ mean), float(slope @ slope * inertia), float(whole), None, axis)


def _named(moved: float, turned: float, whole: float, flap: float | None, axis: float | None) -> ModeKind:
    if whole <= 0:
        return ModeKind(0, 0.0, Kind.STILL, "", 0.0, 0.0, 0.0, None, None, "")
    translation, rotation = moved / whole, turned / whole
    rest = max(1.0 - translation - rotation, 0.0)
    kind = Kind.MIXED
    if translation >= DOMINANT:
        kind = Kind.BENDING if flap is None else Kind.FLAP if flap >= 0.5 else Kind.EDGEWISE
    elif rotation >= DOMINANT:
        kind = Kind.TORSION
    elif rest >= DOMINANT:
        kind = Kind.CHORDWISE
    return ModeKind(0, 0.0, kind, "", translation, rotation, rest, flap, axis, "")


def _counted(kinds: list[ModeKind]) -> tuple[ModeKind, ...]:
    seen: Counter[Kind] = Counter()
    label = {}
    for kind in sorted(kinds, key=lambda k: k.frequency_hz):
        seen[kind.kind] += 1
        counted = kind.kind not in (Kind.MIXED, Kind.STILL)
        label[kind.mode] = f"{seen[kind.kind] if counted else ''}{_LETTERS[kind.kind]}"
    return tuple(replace(kind, label=label[kind.mode]) for kind in kinds)


def _along_tip(blade: Blade) -> tuple[np.ndarray, str]:
    """Place of the nodes along the tip line, shape (r,), and what is not known of it."""
    if blade.tip_z_m is None:
        return np.linspace(0.0, 1.0, len(blade.tip_nodes)), "nodes taken as evenly spaced: no tip_z_m"
    z = np.array(blade.tip_z_m)
    if blade.tip_radius_m is None or blade.tip_theta_rad is None:
        # At constant stagger z grows in proportion to the chord.
        rises = (np.diff(z) > 0).all() or (np.diff(z) < 0).all()
        if not rises:
            return np.linspace(0.0, 1.0, len(z)), "nodes taken as evenly spaced: tip_z_m turns back"
        return z, "stagger of the tip taken as constant: no tip_theta_rad or tip_radius_m"
    radius, theta = np.array(blade.tip_radius_m), np.array(blade.tip_theta_rad)
    points = np.stack((radius * np.cos(theta), radius * np.sin(theta), z), axis=1)
    return np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))], ""


def _line_weights(place: np.ndarray) -> np.ndarray:
    """Trapezoidal weights along the tip line, adding up to 1, shape (r,)."""
    step = np.abs(np.diff(place))
    weight = np.zeros(len(place))
    weight[:-1] += step
    weight[1:] += step
    return weight / weight.sum()

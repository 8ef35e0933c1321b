"""A blade's tip mode shapes as a universal file.

Dataset 55 has six digits in every real field by definition (6E13.5), so it carries what viewers need, and the
same figures stand with all digits in places the format has for them: frequency and damping as text in the
identification lines, amplitudes in datasets 58 (eigenvectors over the mode number, double precision, 4E20.12:
13 digits), nodes in 2411 (1P3D25.16).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sdm_core.blade.exchange.universal.modes import (
    DOUBLE,
    EIGENVECTOR,
    NORMAL_MODE,
    REAL,
    SCALAR,
    TRANSLATIONS,
)
from sdm_core.blade.modal import Blade, ModalState

_DISPLACEMENT, _STRUCTURAL = 8, 1


def write_universal(blade: Blade, path: Path) -> tuple[str, ...]:
    """Write a blade; its tip nodes get the numbers 1 to r, the rotor turns about z.

    Returns
    -------
    What the format has no place for.
    """
    left_out = [key for key in ("design_speed_hz", "mass_kg", "material") if getattr(blade, key) is not None]
    for key in ("tip_growth_m", "untwist_rad"):
        if any(getattr(state, key) is not None for state in blade.states):
            left_out.append(key)
    frames = _frames(blade)
    if frames is None and any(state.mode_shape_radial is not None for state in blade.states):
        left_out.append("mode_shape_radial, mode_shape_tangential, mode_shape_axial")
    lines = list(_header(blade))
    lines += _nodes(blade) if frames is not None else []
    for case, state in enumerate(blade.states, 1):
        vector = None if frames is None else _vectors(state, frames)
        for number in range(blade.mode_count):
            lines += _mode(blade, state, case, number, vector)
        lines += _all_digits(blade, state, case, vector)
    path.write_text("\n".join(lines) + "\n", encoding="latin-1", errors="replace", newline="\n")
    return tuple(left_out)


def _dataset(number: int, *lines: str) -> Iterator[str]:
    yield from (f"{-1:6}", f"{number:6}", *lines, f"{-1:6}")


def _header(blade: Blade) -> Iterator[str]:
    yield from _dataset(
        151, blade.name[:80], f"CONTACT_DIRECTION {blade.direction}", "rubscreen", "", "", "rubscreen", ""
    )
    yield from _dataset(
        164, f"{1:10}{'SI: Meter (newton)':20}{2:10}", _double(1.0, 1.0, 1.0), _double(273.15)
    )


def _double(*values: float) -> str:
    return "".join(f"{value:25.16E}".replace("E", "D") for value in values)


def _frames(blade: Blade) -> np.ndarray | None:
    """Radial, tangential, axial unit vectors at the tip nodes where their places are known, (r, 3, 3)."""
    if blade.tip_radius_m is None or blade.tip_z_m is None or min(blade.tip_radius_m) <= 0:
        return None
    theta = np.array(blade.tip_theta_rad if blade.tip_theta_rad is not None else [0.0] * len(blade.tip_nodes))
    zero, one = np.zeros_like(theta), np.ones_like(theta)
    return np.stack(
        (
            np.stack((np.cos(theta), np.sin(theta), zero), axis=1),
            np.stack((-np.sin(theta), np.cos(theta), zero), axis=1),
            np.stack((zero, zero, one), axis=1),
        ),
        axis=1,
    )


def _nodes(blade: Blade) -> Iterator[str]:
    frames = _frames(blade)
    assert frames is not None
    lines = []
    places = np.array(blade.tip_radius_m)[:, None] * frames[:, 0]
    places[:, 2] = np.array(blade.tip_z_m)
    for i, place in enumerate(places, 1):
        lines += [f"{i:10}{0:10}{0:10}{1:10}", _double(*place)]
    yield from _dataset(2411, *lines)


def _vectors(state: ModalState, frames: np.ndarray) -> np.ndarray | None:
    """Displacements x, y, z at the tip, (n, r, 3)."""
    parts = (state.mode_shape_radial, state.mode_shape_tangential, state.mode_shape_axial)
    if any(part is None for part in parts):
        return None
    return np.einsum("anr,rax->nrx", np.array(parts), frames)


def _mode(
    blade: Blade, state: ModalState, case: int, number: int, vector: np.ndarray | None
) -> Iterator[str]:
    frequency, damping = float(state.frequency_hz[number]), float(blade.damping_ratio[number])
    ids = (
        f"Mode {number + 1} of {blade.name}"[:80],
        f"SPEED_HZ {state.speed_hz!r}",
        f"FREQUENCY_HZ {frequency!r}",
        f"DAMPING_RATIO {damping!r}",
    )
    forms = [(SCALAR, state.mode_shape[number][:, None], "amplitude in the contact direction, kg^-1/2")]
    if vector is not None:
        forms.append((TRANSLATIONS, vector[number], "displacement x, y, z, kg^-1/2"))
    for character, values, what in forms:
        width = values.shape[1]
        lines = [f"{i:10}\n" + "".join(f"{x:13.5E}" for x in row) for i, row in enumerate(values, 1)]
        yield from _dataset(
            55,
            *ids,
            what,
            "".join(f"{x:10}" for x in (_STRUCTURAL, NORMAL_MODE, character, _DISPLACEMENT, REAL, width)),
            "".join(f"{x:10}" for x in (2, 4, case, number + 1)),
            "".join(f"{x:13.5E}" for x in (frequency, 1.0, damping, 0.0)),
            *lines,
        )


def _all_digits(blade: Blade, state: ModalState, case: int, vector: np.ndarray | None) -> Iterator[str]:
    for i, name in enumerate(blade.tip_nodes):
        columns = [(0, state.mode_shape[:, i])]
        if vector is not None:
            columns += [(axis + 1, vector[:, i, axis]) for axis in range(3)]
        for direction, values in columns:
            numbers = [f"{x:20.12E}" for x in values]
            yield from _dataset(
                58,
                "Amplitudes over the mode number, kg^-1/2",
                f"NODE {name}"[:80],
                f"SPEED_HZ {state.speed_hz!r}",
                "NONE",
                "NONE",
                f"{EIGENVECTOR:5}{0:10}{0:5}{case:10} {'NONE':10}{i + 1:10}{direction:4}"
                f" {'NONE':10}{0:10}{0:4}",
                f"{DOUBLE:10}{len(values):10}{1:10}{1.0:13.5E}{1.0:13.5E}{0.0:13.5E}",
                *(f"{kind:10}{0:5}{0:5}{0:5} {label:20} {'NONE':20}" for kind, label in _AXES),
                *("".join(numbers[k : k + 4]) for k in range(0, len(numbers), 4)),
            )


# Abscissa, ordinate, its denominator, z axis: kind of quantity (1 general, 8 displacement) and label.
_AXES = ((1, "Mode number"), (8, "Amplitude"), (0, "NONE"), (0, "NONE"))

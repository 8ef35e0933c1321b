"""A blade as named arrays, for files that name their arrays (npz, .mat).

======================================  ==========================================================
``frequency_hz``                        (n, s): a column a rotor speed
``mode_shape``                          (n, r, s): mode, tip node, speed; kg^-1/2
``mode_shape_radial`` and so on         the same, optional
``speed_hz``, ``damping_ratio``         (s,), (n,)
``tip_growth_m``, ``untwist_rad``       (r, s), (s,), optional
``tip_radius_m``, ``tip_z_m``, ...      (r,), optional
``tip_nodes``                           names, leading to trailing edge; numbered where missing
``name``, ``direction``, ``material``   text; material as JSON
======================================  ==========================================================

With one speed the last axis may be missing: MATLAB drops it. NaN at a speed says that an optional figure is
not known there.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sdm_core.blade.modal import Blade, ModalState
from sdm_core.blade.tracking import FURTHER_SHAPES
from sdm_core.errors import DamagedFile

_SHAPES = ("mode_shape", *FURTHER_SHAPES)
_PLACES = ("tip_radius_m", "tip_z_m", "tip_theta_rad")
_SCALARS = ("design_speed_hz", "mass_kg")


def arrays_of_blade(blade: Blade) -> dict[str, Any]:
    """A blade as arrays, text and lists of text."""
    states = blade.states
    out: dict[str, Any] = {
        "name": blade.name,
        "direction": blade.direction,
        "tip_nodes": list(blade.tip_nodes),
        "damping_ratio": np.array(blade.damping_ratio),
        "speed_hz": np.array([state.speed_hz for state in states]),
        "frequency_hz": np.stack([state.frequency_hz for state in states], axis=-1),
    }
    for key in (*_SHAPES, "tip_growth_m", "untwist_rad"):
        known = [np.asarray(v, dtype=float) for state in states if (v := getattr(state, key)) is not None]
        if known:
            blank = np.full(known[0].shape, np.nan)
            values = [blank if (v := getattr(state, key)) is None else np.asarray(v) for state in states]
            out[key] = np.stack(values, axis=-1)
    for key in _PLACES:
        if getattr(blade, key) is not None:
            out[key] = np.array(getattr(blade, key), dtype=float)
    for key in _SCALARS:
        if getattr(blade, key) is not None:
            out[key] = np.array([float(getattr(blade, key))])
    if blade.material is not None:
        out["material"] = json.dumps(blade.material)
    return out


def blade_of_arrays(path: Path, arrays: Mapping[str, Any]) -> Blade:
    """A blade from its arrays.

    Raises
    ------
    DamagedFile
        For arrays missing or of sizes that do not fit each other.
    InvalidInput
        For numbers that no blade has.
    """
    frequency = _numbers(path, arrays, "frequency_hz")
    shape = _numbers(path, arrays, "mode_shape")
    speed = _numbers(path, arrays, "speed_hz").ravel() if "speed_hz" in arrays else np.zeros(1)
    s = len(speed)
    if frequency.size == 0 or frequency.size % max(s, 1):
        raise DamagedFile(
            f"{path.name}: frequency_hz",
            f"{frequency.size} numbers for {s} speeds",
            "give n frequencies a speed",
        )
    n = frequency.size // s
    if s > 1 and (frequency.ndim != 2 or frequency.shape != (n, s)):
        raise DamagedFile(
            f"{path.name}: frequency_hz", f"size {frequency.shape}", f"give a column a speed: {s} columns"
        )
    frequency = frequency.reshape(n, s)
    if shape.ndim < 2 or shape.shape[0] != n:
        raise DamagedFile(
            f"{path.name}: mode_shape", f"size {shape.shape}", f"give mode, node, speed: {n} modes first"
        )
    r = shape.shape[1]

    def sized(key: str, *size: int) -> np.ndarray | None:
        if key not in arrays:
            return None
        values = _numbers(path, arrays, key)
        # MATLAB drops last axes of one and adds a second axis to vectors.
        squeezed = tuple(x for x in values.shape if x != 1)
        if squeezed != tuple(x for x in size if x != 1):
            raise DamagedFile(f"{path.name}: {key}", f"size {values.shape}", f"its size should be {size}")
        return values.reshape(size)

    shapes = {key: sized(key, n, r, s) for key in _SHAPES}
    main = shapes.pop("mode_shape")
    assert main is not None
    growth, untwist = sized("tip_growth_m", r, s), sized("untwist_rad", s)
    states = []
    for i in range(s):
        more = {key: _known(value, i) for key, value in shapes.items()}
        states.append(
            ModalState(
                float(speed[i]),
                frequency[:, i],
                main[..., i],
                **more,
                tip_growth_m=_known(growth, i),
                untwist_rad=None if (turn := _known(untwist, i)) is None else float(turn),
            )
        )
    damping = _numbers(path, arrays, "damping_ratio").ravel() if "damping_ratio" in arrays else None
    if damping is None:
        raise DamagedFile(
            f"{path.name}: damping_ratio", "missing", "save damping_ratio: one number, or one a mode"
        )
    more_of_blade: dict[str, Any] = {}
    for key in _PLACES:
        values = sized(key, r)
        more_of_blade[key] = None if values is None else values.tolist()
    for key in _SCALARS:
        values = sized(key, 1)
        more_of_blade[key] = None if values is None else float(values[0])
    return Blade(
        _text(path, arrays, "name") or path.stem,
        _names(path, arrays, r),
        float(damping[0]) if len(damping) == 1 else damping,
        states,
        _text(path, arrays, "direction") or "given",
        **more_of_blade,
        material=_material(path, arrays),
    )


def _known(values: np.ndarray | None, state: int) -> np.ndarray | None:
    """What belongs to one speed, where it is known there."""
    if values is None or np.isnan(values[..., state]).all():
        return None
    return values[..., state]


def _numbers(path: Path, arrays: Mapping[str, Any], key: str) -> np.ndarray:
    if key not in arrays:
        have = ", ".join(sorted(map(str, arrays)))[:80] or "nothing"
        raise DamagedFile(f"{path.name}: {key}", f"missing among {have}", f"save {key} in the file")
    value = arrays[key]
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "iuf":
        raise DamagedFile(f"{path.name}: {key}", type(value).__name__, "save an array of real numbers")
    return value.astype(float)


def _text(path: Path, arrays: Mapping[str, Any], key: str) -> str | None:
    value = arrays.get(key)
    if isinstance(value, list) and len(value) == 1:
        value = value[0]
    if value is None or isinstance(value, str):
        return value or None
    raise DamagedFile(f"{path.name}: {key}", type(value).__name__, "save text there")


def _names(path: Path, arrays: Mapping[str, Any], count: int) -> list[str]:
    value = arrays.get("tip_nodes")
    if value is None:
        return [f"N{i + 1}" for i in range(count)]
    rows = [value] if isinstance(value, str) else value
    if isinstance(rows, list):
        rows = [row[0] if isinstance(row, list) and len(row) == 1 else row for row in rows]
    if not isinstance(rows, list) or len(rows) != count or not all(isinstance(row, str) for row in rows):
        raise DamagedFile(f"{path.name}: tip_nodes", type(value).__name__, f"save {count} names of nodes")
    return [row.strip() for row in rows]


def _material(path: Path, arrays: Mapping[str, Any]) -> dict[str, Any] | None:
    text = _text(path, arrays, "material")
    if text is None:
        return None
    try:
        value = json.loads(text)
    except ValueError:
        value = None
    if not isinstance(value, dict):
        raise DamagedFile(f"{path.name}: material", text, 'save JSON such as {"rho": 4400.0}')
    return value

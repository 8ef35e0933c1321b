"""The blade file, `rubscreen/blade/1` (JSON)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from sdm_core.blade.modal import Blade, ModalState
from sdm_core.blade.tracking import FURTHER_SHAPES
from sdm_core.errors import InvalidInput
from sdm_core.json_file import read_json
from sdm_core.whole_files import staged

SCHEMA = "rubscreen/blade/1"
EXAMPLES = ("nasa_rotor_37", "generic_compressor_blade")

_REQUIRED = ("name", "tip_nodes", "damping_ratio", "states")
_OPTIONAL = (
    "direction",
    "design_speed_hz",
    "mass_kg",
    "tip_radius_m",
    "tip_z_m",
    "material",
    "tip_theta_rad",
)
_STATE_REQUIRED = ("speed_hz", "frequency_hz", "mode_shape")
_STATE_OPTIONAL = (*FURTHER_SHAPES, "tip_growth_m", "untwist_rad")


def blade_from_dict(data: Any) -> Blade:
    """A blade from the parsed JSON of a blade file.

    Keys the format does not know are ignored: the format grows by addition.

    Raises
    ------
    InvalidInput
        Naming the field (``states[1].mode_shape[0]``), the value and the remedy.
    """
    if not isinstance(data, Mapping):
        raise InvalidInput("blade", data, f"give an object with schema {SCHEMA!r}")
    if data.get("schema") != SCHEMA:
        raise InvalidInput("schema", data.get("schema", "missing"), f"give {SCHEMA!r}")
    _require(data, _REQUIRED, "")
    states = data["states"]
    if not isinstance(states, list) or not states:
        raise InvalidInput("states", states, "give a list of at least one modal state")
    parsed = []
    for i, state in enumerate(states):
        if not isinstance(state, Mapping):
            raise InvalidInput(f"states[{i}]", state, f"give an object with {', '.join(_STATE_REQUIRED)}")
        _require(state, _STATE_REQUIRED, f"states[{i}].")
        given = {key: state[key] for key in _STATE_OPTIONAL if state.get(key) is not None}
        try:
            parsed.append(ModalState(*(state[key] for key in _STATE_REQUIRED), **given))
        except InvalidInput as error:
            raise error.under(f"states[{i}]") from None
    optional = {key: data[key] for key in _OPTIONAL if data.get(key) is not None}
    return Blade(data["name"], data["tip_nodes"], data["damping_ratio"], parsed, **optional)


def blade_to_dict(blade: Blade) -> dict[str, Any]:
    """The blade as the JSON of a blade file; `blade_from_dict` reads it back unchanged."""
    states = []
    for state in blade.states:
        row: dict[str, Any] = {"speed_hz": state.speed_hz}
        for key in ("frequency_hz", "mode_shape", *_STATE_OPTIONAL):
            value = getattr(state, key)
            if value is not None:
                row[key] = value.tolist() if isinstance(value, np.ndarray) else value
        states.append(row)
    out: dict[str, Any] = {
        "schema": SCHEMA,
        "name": blade.name,
        "tip_nodes": list(blade.tip_nodes),
        "direction": blade.direction,
        "damping_ratio": blade.damping_ratio.tolist(),
        "states": states,
    }
    for key in _OPTIONAL[1:]:
        value = getattr(blade, key)
        if value is not None:
            out[key] = list(value) if isinstance(value, tuple) else value
    return out


def read_blade(path: str | Path) -> Blade:
    """Read a blade file.

    Raises
    ------
    InvalidInput
        When there is no such file or its content cannot be used.
    DamagedFile
        When it is not whole JSON.
    """
    path = Path(path)
    data = read_json(path, "blade file")
    try:
        return blade_from_dict(data)
    except InvalidInput as error:
        raise type(error)(f"{path.name}: {error.field}", error.value, error.remedy) from None


def write_blade(blade: Blade, path: str | Path) -> None:
    """Write a blade file, whole or not at all.

    Raises
    ------
    InvalidInput
        When it cannot be written there.
    """
    with staged(path, "blade file") as beside:
        beside.write_text(json.dumps(blade_to_dict(blade), indent=1) + "\n", encoding="utf-8")


def example_blade(name: str) -> Blade:
    """One of the real blades shipped with the package (`EXAMPLES`).

    Examples
    --------
    >>> example_blade("nasa_rotor_37").mode_count
    5
    """
    if name not in EXAMPLES:
        raise InvalidInput("example", name, f"name one of {', '.join(EXAMPLES)}")
    source = resources.files("sdm_core.blade") / "examples" / f"{name}.json"
    return blade_from_dict(json.loads(source.read_text(encoding="utf-8")))


def _require(data: Mapping[str, Any], keys: tuple[str, ...], prefix: str) -> None:
    for key in keys:
        if data.get(key) is None:
            raise InvalidInput(prefix + key, "missing", "the blade file needs it")

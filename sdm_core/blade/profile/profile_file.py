"""The profile file, `rubscreen/profile/1` (JSON)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from sdm_core.blade.finite_elements.material import TITANIUM, Material
from sdm_core.blade.profile.blade_profile import BladeProfile
from sdm_core.blade.profile.parametric import ParametricBlade
from sdm_core.blade.profile.sections import SectionTable, read_sections
from sdm_core.blade.solid_mesh import Subdivision
from sdm_core.blade.tip_contact import TipContact
from sdm_core.errors import InvalidInput
from sdm_core.json_file import read_json

SCHEMA = "rubscreen/profile/1"
EXAMPLE_PROFILES = ("transonic_profile",)
STACKINGS = ("given", "centroids")
MOST_SECTIONS, MOST_POINTS = 200, 5000

_KEYS = (
    "schema",
    "name",
    "parametric",
    "sections",
    "stacking",
    "edge_cut",
    "design_speed_hz",
    "material",
    "damping_ratio",
    "modes",
    "speeds_hz",
    "mesh",
    "tip",
)


def profile_from_dict(data: Any, folder: Path | None = None) -> BladeProfile:
    """A profile from the parsed JSON of a profile file.

    Parameters
    ----------
    data
        ``schema``, ``name``, ``design_speed_hz`` and either ``parametric`` (parameters of
        `ParametricBlade`) or ``sections``: ``{"z_m": [[…]], "r_m": …, "theta_1_rad": …,
        "theta_2_rad": …}``, rows hub to tip, or ``{"file": "sections.csv"}``. Optional: ``stacking``
        (of sections: ``given`` or ``centroids``), ``edge_cut``, ``material``, ``damping_ratio``,
        ``modes``, ``speeds_hz``, ``mesh`` (``chord``, ``span``, ``thickness`` elements), ``tip``
        (``nodes``, ``line``, ``direction``, ``casing_slope``).
    folder
        Where a section file is looked for; None: there can be none.

    Raises
    ------
    InvalidInput
        Naming the field (``parametric.chord_m[1]``), the value and the remedy. Unknown keys are
        refused: a misspelt parameter must not become its default.
    """
    if not isinstance(data, Mapping):
        raise InvalidInput("profile", data, f"give an object with schema {SCHEMA!r}")
    if data.get("schema") != SCHEMA:
        raise InvalidInput("schema", data.get("schema", "missing"), f"give {SCHEMA!r}")
    _refuse_unknown(data, _KEYS, "")
    for key in ("name", "design_speed_hz"):
        if data.get(key) is None:
            raise InvalidInput(key, "missing", "the profile needs it")
    given = {
        key: data[key]
        for key in ("damping_ratio", "modes", "speeds_hz", "edge_cut")
        if data.get(key) is not None
    }
    material = data.get("material")
    return BladeProfile(
        data["name"],
        _shape(data, folder),
        data["design_speed_hz"],
        TITANIUM if material is None else Material.from_dict(material),
        subdivision=_part(data, "mesh", Subdivision),
        tip=_part(data, "tip", TipContact),
        **given,
    )


def example_profile_document(name: str) -> dict[str, Any]:
    """One of the profiles shipped with the package (`EXAMPLE_PROFILES`), as its file has it.

    Raises
    ------
    InvalidInput
        When there is none of that name.

    Examples
    --------
    >>> profile_from_dict(example_profile_document("transonic_profile")).name
    'transonic-example'
    """
    if name not in EXAMPLE_PROFILES:
        raise InvalidInput("example", name, f"name one of {', '.join(EXAMPLE_PROFILES)}")
    source = resources.files("sdm_core.blade") / "examples" / f"{name}.json"
    document: dict[str, Any] = json.loads(source.read_text(encoding="utf-8"))
    return document


def profile_to_dict(profile: BladeProfile) -> dict[str, Any]:
    """The profile as the JSON of a profile file; `profile_from_dict` reads it back unchanged."""
    out: dict[str, Any] = {
        "schema": SCHEMA,
        "name": profile.name,
        "design_speed_hz": profile.design_speed_hz,
        "material": profile.material.to_dict(),
        "damping_ratio": _plain(profile.damping_ratio),
        "modes": profile.modes,
        "mesh": _fields(profile.subdivision),
        "tip": _fields(profile.tip),
    }
    if profile.speeds_hz is not None:
        out["speeds_hz"] = list(profile.speeds_hz)
    if isinstance(profile.shape, ParametricBlade):
        out["parametric"] = _fields(profile.shape)
        return out
    out["edge_cut"] = profile.edge_cut
    sides = profile.shape.sides
    if not all(np.array_equal(side[0, :, :2], side[1, :, :2]) for side in sides):
        raise InvalidInput(
            "sections", "two sides at different places", "the file holds θ of both sides at the same z and r"
        )
    columns = (("z_m", 0, 0), ("r_m", 0, 1), ("theta_1_rad", 0, 2), ("theta_2_rad", 1, 2))
    out["sections"] = {key: [side[i, :, k].tolist() for side in sides] for key, i, k in columns}
    return out


def read_profile(path: str | Path) -> BladeProfile:
    """Read a profile file.

    Raises
    ------
    InvalidInput
        When there is no such file or its content cannot be used.
    DamagedFile
        When it is not whole JSON.
    """
    path = Path(path)
    data = read_json(path, "profile file")
    try:
        return profile_from_dict(data, path.parent)
    except InvalidInput as error:
        raise type(error)(f"{path.name}: {error.field}", error.value, error.remedy) from None


def _shape(data: Mapping[str, Any], folder: Path | None) -> ParametricBlade | SectionTable:
    parametric, sections = data.get("parametric"), data.get("sections")
    if (parametric is None) == (sections is None):
        found = "both" if sections is not None else "neither"
        raise InvalidInput("parametric, sections", found, "give one of the two")
    stacking = data.get("stacking", "given")
    if stacking not in STACKINGS:
        raise InvalidInput("stacking", stacking, f"give one of {', '.join(STACKINGS)}")
    if sections is None:
        for key in ("stacking", "edge_cut"):
            if data.get(key) is not None:
                raise InvalidInput(key, data[key], "it goes with sections; parametric has its own edge_cut")
        blade = _part(data, "parametric", ParametricBlade)
        try:
            blade.sections()
        except InvalidInput as error:
            raise error.under("parametric") from None
        return blade
    table = _sections(sections, folder)
    return table.stacked_on_centroids() if stacking == "centroids" else table


def _sections(sections: Any, folder: Path | None) -> SectionTable:
    if not isinstance(sections, Mapping):
        raise InvalidInput(
            "sections", sections, 'give {"z_m": …, "r_m": …, "theta_1_rad": …, "theta_2_rad": …}'
        )
    if "file" in sections:
        _refuse_unknown(sections, ("file",), "sections.")
        if folder is None or not isinstance(sections["file"], str):
            raise InvalidInput("sections.file", sections["file"], "give the coordinates themselves here")
        return read_sections(folder / sections["file"])
    names = ("z_m", "r_m", "theta_1_rad", "theta_2_rad")
    _refuse_unknown(sections, names, "sections.")
    columns = []
    for name in names:
        rows = sections.get(name)
        if not isinstance(rows, list) or not 0 < len(rows) <= MOST_SECTIONS:
            raise InvalidInput(f"sections.{name}", rows, f"give up to {MOST_SECTIONS} rows, hub to tip")
        columns.append([_coordinates(f"sections.{name}[{i}]", row) for i, row in enumerate(rows)])
    sides = []
    for i, (z, r, theta_1, theta_2) in enumerate(_rows(columns)):
        if len({len(z), len(r), len(theta_1), len(theta_2)}) > 1:
            raise InvalidInput(
                f"sections, row {i}",
                f"{len(z)}, {len(r)}, {len(theta_1)} and {len(theta_2)} points",
                "give z_m, r_m, theta_1_rad and theta_2_rad at the same points",
            )
        sides.append(np.stack([np.stack((z, r, theta), axis=1) for theta in (theta_1, theta_2)]))
    return SectionTable(sides)


def _rows(columns: list[list[np.ndarray]]) -> list[tuple[np.ndarray, ...]]:
    counts = [len(column) for column in columns]
    if len(set(counts)) > 1:
        raise InvalidInput("sections", f"{counts} rows", "give every coordinate for every section")
    return list(zip(*columns, strict=True))


def _coordinates(field: str, row: Any) -> np.ndarray:
    if not isinstance(row, list) or len(row) > MOST_POINTS:
        raise InvalidInput(field, row, f"give a list of up to {MOST_POINTS} numbers")
    for i, value in enumerate(row):
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise InvalidInput(f"{field}[{i}]", value, "give a finite number")
    return np.array(row, dtype=float)


def _part(data: Mapping[str, Any], key: str, kind: type) -> Any:
    """One of the parts of a profile, its errors named by where they stand."""
    part = data.get(key)
    if part is None:
        part = {}
    if not isinstance(part, Mapping):
        raise InvalidInput(key, part, "give an object")
    known = tuple(field.name for field in fields(kind))
    _refuse_unknown(part, known, f"{key}.")
    required = [field.name for field in fields(kind) if field.name in ("span_m", "hub_radius_m", "chord_m")]
    for name in required + ["thickness_ratio"] * bool(required):
        if part.get(name) is None:
            raise InvalidInput(f"{key}.{name}", "missing", "the profile needs it")
    try:
        return kind(**{name: part[name] for name in known if part.get(name) is not None})
    except InvalidInput as error:
        prefixed = error.field.startswith(f"{key}.") or error.field == key
        raise error if prefixed else error.under(key) from None


def _refuse_unknown(data: Mapping[str, Any], known: tuple[str, ...], prefix: str) -> None:
    for key in data:
        if key not in known:
            raise InvalidInput(
                f"{prefix}{key}", data[key], f"there is no such field; known: {', '.join(known)}"
            )


def _fields(part: Any) -> dict[str, Any]:
    return {
        field.name: _plain(getattr(part, field.name))
        for field in fields(part)
        if getattr(part, field.name) is not None
    }


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value

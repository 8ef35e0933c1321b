"""JSON schema of a blade's profile, and of what ``POST /v1/blades`` is asked."""

from __future__ import annotations

from typing import Any

from sdm_core.blade.profile import SCHEMA, ParametricBlade, profile_to_dict
from sdm_core.blade.profile.blade_profile import MOST_MODES, BladeProfile
from sdm_core.blade.profile.profile_file import STACKINGS
from sdm_core.blade.solid_mesh import Subdivision
from sdm_core.blade.tip_contact import LINES, TipContact

Json = dict[str, Any]

_NUMBER: Json = {"type": "number"}
_OVER_SPAN: Json = {
    "oneOf": [_NUMBER, {"type": "array", "minItems": 1, "maxItems": 21, "items": _NUMBER}],
    "description": "One number, or a list evenly spaced from hub to tip.",
}
_ROWS: Json = {"type": "array", "items": {"type": "array", "items": _NUMBER}}


def _object(properties: Json, required: list[str], description: str) -> Json:
    return {
        "type": "object",
        "description": description,
        "required": required,
        "additionalProperties": False,
        "properties": properties,
    }


_PARAMETRIC = _object(
    {
        "span_m": _NUMBER,
        "hub_radius_m": _NUMBER,
        "chord_m": _OVER_SPAN,
        "thickness_ratio": _OVER_SPAN,
        "stagger_deg": _OVER_SPAN,
        "camber_deg": _OVER_SPAN,
        "lean_deg": _OVER_SPAN,
        "sweep_deg": _OVER_SPAN,
        "edge_cut": _NUMBER,
        "edge_thickness_ratio": _NUMBER,
        "casing_slope": _NUMBER,
        "hub_slope": _NUMBER,
    },
    ["span_m", "hub_radius_m", "chord_m", "thickness_ratio"],
    "Circular-arc sections of biparabolic thickness, stacked on their centroids.",
)
_SECTIONS = _object(
    {"z_m": _ROWS, "r_m": _ROWS, "theta_1_rad": _ROWS, "theta_2_rad": _ROWS},
    ["z_m", "r_m", "theta_1_rad", "theta_2_rad"],
    "Sections hub to tip, a row each, points from leading to trailing edge; theta of both sides.",
)
_MESH = _object(
    {name: {"type": "integer", "minimum": 1, "maximum": 1000} for name in ("chord", "span", "thickness")},
    [],
    "Quadratic hexahedra along chord, span and thickness.",
)
_TIP = _object(
    {
        "nodes": {"type": "integer", "minimum": 2, "maximum": 201},
        "line": {"enum": list(LINES)},
        "direction": {
            "oneOf": [
                {"enum": ["casing_normal", "radial"]},
                {"type": "array", "minItems": 3, "maxItems": 3, "items": _NUMBER},
            ],
            "description": "Or a vector (radial, tangential, axial).",
        },
        "casing_slope": _NUMBER,
    },
    [],
    "Contact nodes and contact direction.",
)
PROFILE: Json = _object(
    {
        "schema": {"type": "string", "const": SCHEMA},
        "name": {"type": "string", "minLength": 1},
        "parametric": _PARAMETRIC,
        "sections": _SECTIONS,
        "stacking": {"enum": list(STACKINGS), "description": "Of sections; left out: as given."},
        "edge_cut": {
            "type": "number",
            "description": "Of sections: share of chord cut off each edge.",
        },
        "design_speed_hz": {"type": "number", "exclusiveMinimum": 0},
        "material": {
            "type": "object",
            "required": ["E", "nu", "rho"],
            "properties": {"E": _NUMBER, "nu": _NUMBER, "rho": _NUMBER},
            "description": "Pa, -, kg/m3; left out: titanium.",
        },
        "damping_ratio": {"oneOf": [_NUMBER, {"type": "array", "items": _NUMBER}]},
        "modes": {"type": "integer", "minimum": 1, "maximum": MOST_MODES},
        "speeds_hz": {"type": "array", "items": _NUMBER, "description": "Of the modal states, rising."},
        "mesh": _MESH,
        "tip": _TIP,
    },
    ["schema", "name", "design_speed_hz"],
    "A blade's shape, as parameters or as sections: one of the two.",
)
BLADES_EXAMPLE: Json = {
    "profile": profile_to_dict(
        BladeProfile(
            "transonic-example",
            ParametricBlade(
                0.085, 0.19, (0.052, 0.06), (0.085, 0.035), (32.0, 58.0), (38.0, 8.0), casing_slope=-0.12
            ),
            260.0,
            subdivision=Subdivision(8, 12, 1),
            tip=TipContact(nodes=5),
        )
    )
}

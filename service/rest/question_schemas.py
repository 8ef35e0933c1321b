"""The parts of a question as OpenAPI shows them, with an example.

The core parses them (`service.rest.questions`), so here they are only described; a test posts each example.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sdm_core.blade import SCHEMA, Blade, ModalState, blade_to_dict, example_blade
from sdm_core.blade.modal import DIRECTIONS
from sdm_core.blade.tracking import FURTHER_SHAPES
from sdm_core.contact import ContactConfiguration
from sdm_core.fourier_engagement import MOST_HARMONICS
from sdm_core.validation import AMPLITUDE_LIMIT, FREQUENCY_LIMITS_HZ, KE_LIMIT, SPEED_LIMITS_HZ, WEIGHT_LIMIT
from service.rest.replies import MAP_FIELDS
from training.answers import POLICIES

Json = dict[str, Any]


def _row(item: Json, **more: Any) -> Json:
    return {"type": "array", "minItems": 1, "items": item, **more}


_FREQUENCY = {"type": "number", "minimum": FREQUENCY_LIMITS_HZ[0], "maximum": FREQUENCY_LIMITS_HZ[1]}
_SPEED = {"type": "number", "minimum": SPEED_LIMITS_HZ[0], "maximum": SPEED_LIMITS_HZ[1]}
_DAMPING = {"type": "number", "minimum": 0, "exclusiveMaximum": 1}
_AMPLITUDES = _row(_row({"type": "number", "minimum": -AMPLITUDE_LIMIT, "maximum": AMPLITUDE_LIMIT}))

SPEEDS: Json = _row(_SPEED, description="Rotor speeds in Hz (revolutions per second).")
KE: Json = _row(
    {"type": "number", "minimum": 0, "maximum": KE_LIMIT},
    description="Specific force coefficients K_e in N/m, per contact node.",
)
STATE: Json = {
    "type": "object",
    "required": ["speed_hz", "frequency_hz", "mode_shape"],
    "properties": {
        "speed_hz": {"type": "number", "minimum": 0, "maximum": SPEED_LIMITS_HZ[1]},
        "frequency_hz": _row(_FREQUENCY, description="Natural frequencies, Hz: n of them."),
        "mode_shape": {
            **_AMPLITUDES,
            "description": "Mass-normalised amplitudes at the tip nodes, kg^-1/2: n rows of r.",
        },
        **dict.fromkeys(FURTHER_SHAPES, _AMPLITUDES),
        "tip_growth_m": _row(
            {"type": "number"},
            description="Static displacement towards the casing by rotation, m: r of them.",
        ),
        "untwist_rad": {"type": "number", "description": "Turn of the tip's chord by rotation, rad."},
    },
}
BLADE: Json = {
    "type": "object",
    "description": "A blade file: modal data at one or more rotor speeds.",
    "required": ["schema", "name", "tip_nodes", "damping_ratio", "states"],
    "properties": {
        "schema": {"type": "string", "const": SCHEMA},
        "name": {"type": "string", "minLength": 1},
        "tip_nodes": _row(
            {"type": "string", "minLength": 1},
            uniqueItems=True,
            description="Names of the tip nodes, leading to trailing edge: r of them.",
        ),
        "direction": {"enum": list(DIRECTIONS), "default": "casing_normal"},
        "damping_ratio": {
            "oneOf": [_DAMPING, _row(_DAMPING)],
            "description": "One number, or one a mode.",
        },
        "states": _row(STATE, description="One state means no centrifugal effect."),
        "design_speed_hz": _SPEED,
        "mass_kg": {"type": "number", "exclusiveMinimum": 0},
        "tip_radius_m": _row({"type": "number"}),
        "tip_z_m": _row({"type": "number"}),
        "tip_theta_rad": _row({"type": "number"}),
        "material": {"type": "object"},
    },
}
_COEFFICIENTS: Json = {
    "type": "array",
    "maxItems": MOST_HARMONICS,
    "items": {"type": "number", "minimum": -1, "maximum": 1},
}
ENGAGEMENT: Json = {
    "type": "object",
    "description": "Smooth engagement round the casing, instead of arcs: mean + sum over k of "
    "cosine[k-1] cos(2 pi k theta) + sine[k-1] sin(2 pi k theta), theta in revolutions, within [0, 1]. It "
    "is the share of K_e that cuts there.",
    "required": ["mean"],
    "additionalProperties": False,
    "properties": {
        "mean": {"type": "number", "exclusiveMinimum": 0, "maximum": 1},
        "cosine": {**_COEFFICIENTS, "description": "Left out: zeros."},
        "sine": {**_COEFFICIENTS, "description": "As many as cosine. Left out: zeros."},
    },
}
CONTACT: Json = {
    "type": "object",
    "description": "Which tip nodes touch the casing, and where round it.",
    "required": ["weights"],
    "additionalProperties": False,
    "properties": {
        "weights": {
            "type": "object",
            "minProperties": 1,
            "additionalProperties": {"type": "number", "minimum": 0, "maximum": WEIGHT_LIMIT},
            "description": "Weight by node name; a node left out is not in contact.",
        },
        "arcs": {
            "oneOf": [_row(_row({"type": "number"}, minItems=2, maxItems=2)), {"type": "null"}],
            "description": "Arcs of contact as [start, end] in revolutions, sorted, not overlapping; "
            "an end may run past 1. Left out: permanent contact.",
        },
        "engagement": {"oneOf": [ENGAGEMENT, {"type": "null"}]},
    },
}
KE_MAX: Json = {
    "type": "number",
    "exclusiveMinimum": 0,
    "maximum": KE_LIMIT,
    "description": "Largest K_e to look at, N/m.",
}
POLICY: Json = {
    "enum": list(POLICIES),
    "default": "auto",
    "description": "Who answers: the surrogate where it is sure and inside its domain, else the exact core "
    "(auto); the surrogate alone; the exact core alone.",
}
ALPHA: Json = {
    "oneOf": [{"type": "number", "exclusiveMinimum": 0, "maximum": 1}, {"type": "null"}],
    "description": "Rate of unstable designs among those called stable that the answers must keep, under "
    "policy auto: one of those the model's card has a certificate for (GET /v1/models). Left out: 5e-4.",
}

MAP_FIELDS_SCHEMA: Json = {
    "oneOf": [
        {"type": "array", "minItems": 1, "uniqueItems": True, "items": {"enum": list(MAP_FIELDS)}},
        {"type": "null"},
    ],
    "description": "Those of a map's arrays that the answer is to hold. Left out: all of them.",
}


def _blade_that_fits_a_page() -> Blade:
    """NASA rotor 37 at rest, cut down to three modes and three tip nodes."""
    blade = example_blade("nasa_rotor_37")
    at_rest, nodes = blade.states[0], [0, len(blade.tip_nodes) // 2, -1]
    shape = np.round(at_rest.mode_shape[:3, nodes], 3)
    state = ModalState(0.0, np.round(at_rest.frequency_hz[:3], 1), shape)
    names = [blade.tip_nodes[i] for i in nodes]
    return Blade("nasa-rotor-37-at-rest", names, 1e-3, [state], blade.direction)


def _example(**question: Any) -> Json:
    contact = ContactConfiguration.at("LE", "TE").to_dict()
    return {"blade": blade_to_dict(_blade_that_fits_a_page()), "contact": contact, **question}


POINTS_EXAMPLE: Json = _example(speed_hz=[180.0, 286.5], ke=[1000.0, 20000.0], policy="auto")
BOUNDARY_EXAMPLE: Json = _example(speed_hz=[180.0, 240.0, 286.5], ke_max=100000.0, policy="auto")
SENSITIVITIES_EXAMPLE: Json = _example(speed_hz=[180.0, 240.0], ke_max=100000.0, policy="auto")
MAP_EXAMPLE: Json = _example(speed_hz=[180.0, 240.0, 286.5], ke=[1000.0, 20000.0], policy="auto")

"""Answers of ``POST /v1/blades``, as JSON."""

from __future__ import annotations

from typing import Any

from sdm_core.blade import Blade, blade_to_dict
from sdm_core.blade.build import BladeBuild, build_blade
from sdm_core.blade.exchange.checks.findings import Findings
from sdm_core.blade.exchange.checks.modal import check_blade
from sdm_core.blade.profile import BladeProfile

Json = dict[str, Any]


def built_reply(profile: BladeProfile, *, verify: bool) -> Json:
    """Build a profile and tell how it went.

    Raises
    ------
    InvalidInput
        When the shape cannot be meshed, finds no equilibrium, or its modes cannot be followed.
    """
    made = build_blade(profile, verify=verify)
    return {**checked_reply(made.blade), "build": build_to_dict(made)}


def checked_reply(blade: Blade) -> Json:
    """The blade file as it is understood, and what an engineer should look at."""
    return {
        "blade": blade_to_dict(blade),
        "build": None,
        "findings": findings_to_list(check_blade(blade, units="SI")),
    }


def build_to_dict(made: BladeBuild) -> Json:
    """Size, time and the reduction's error."""
    check = made.check
    reduction = None
    if check is not None:
        reduction = {
            "speed_hz": check.speed_hz,
            "full_frequency_hz": check.full_frequency_hz,
            "frequency_error": check.frequency_error,
            "shape_error": check.shape_error,
        }
    return {
        "mesh_nodes": made.mesh_nodes,
        "full_size": made.full_size,
        "reduced_size": made.reduced_size,
        "seconds": made.seconds,
        "reduction": reduction,
    }


def findings_to_list(findings: Findings) -> list[Json]:
    """Warnings and notes, in the order they were found."""
    return [
        {"severity": item.severity, "field": item.field, "what": item.what, "remedy": item.remedy}
        for item in findings.items
    ]

"""Random compressor blades of the parametric family, as profile files: what designers would screen."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from sdm_core.blade.profile import BladeProfile, ParametricBlade, profile_to_dict
from sdm_core.blade.solid_mesh import Subdivision
from sdm_core.blade.tip_contact import TipContact

COARSE = Subdivision(8, 12, 1)


def random_profile(rng: np.random.Generator, name: str, mesh: Subdivision = COARSE) -> BladeProfile:
    """A titanium blade: span 30 to 150 mm, tip speed 250 to 450 m/s, all else as compressors have it."""
    u = rng.uniform
    span = u(0.03, 0.15)
    hub = span * u(1.0, 4.0)
    shape = ParametricBlade(
        span_m=span,
        hub_radius_m=hub,
        chord_m=(span * u(0.35, 0.9), span * u(0.35, 0.9)),
        thickness_ratio=(u(0.07, 0.12), u(0.025, 0.06)),
        stagger_deg=(u(5.0, 35.0), u(40.0, 62.0)),
        camber_deg=(u(15.0, 45.0), u(0.0, 20.0)),
        lean_deg=u(-4.0, 4.0),
        sweep_deg=u(-8.0, 8.0),
        casing_slope=u(-0.25, 0.0),
    )
    speed = u(250.0, 450.0) / (hub + span) / (2 * np.pi)
    return BladeProfile(name, shape, float(speed), subdivision=mesh, tip=TipContact())


def impossible_profiles(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """Three shapes no blade can have, as profile documents by name: an edge that runs backwards, sides that
    change places, a material in GPa."""
    backwards, crossing, soft = (profile_to_dict(random_profile(rng, "impossible")) for _ in range(3))
    backwards["parametric"]["stagger_deg"] = [20.0, 84.0]
    z = np.linspace(0.0, 0.03, 11).tolist()
    half = (0.01, 0.003, -0.01)
    del crossing["parametric"]
    crossing["sections"] = {
        "z_m": [z] * 3,
        "r_m": [[0.2 + 0.03 * i] * 11 for i in range(3)],
        "theta_1_rad": [[-h] * 11 for h in half],
        "theta_2_rad": [[h] * 11 for h in half],
    }
    soft["material"]["E"] = 108.0
    return {"backwards": backwards, "crossing": crossing, "gigapascal": soft}


def write_family(folder: Path, count: int, seed: int = 4) -> None:
    """`count` profile files, the last three of them impossible."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    for i in range(count - 3):
        profile = random_profile(rng, f"blade-{i + 1:03d}")
        (folder / f"{profile.name}.json").write_text(json.dumps(profile_to_dict(profile), indent=1))
    for name, document in impossible_profiles(rng).items():
        (folder / f"{name}.json").write_text(json.dumps(document | {"name": name}, indent=1))

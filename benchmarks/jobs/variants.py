"""Design variants of real blades, as modal data: what a night's batch looks like."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from sdm_core.blade import EXAMPLES, blade_to_dict, example_blade


def variants(count: int, seed: int = 37) -> list[dict[str, Any]]:
    """`count` blade files: the shipped examples, frequencies ±10 %, amplitudes ±20 %, damping 2e-4 to 1e-2.

    Each variant is a blade of its own: no two have a frequency, an amplitude or a damping ratio in common.
    """
    rng = np.random.default_rng(seed)
    originals = [blade_to_dict(example_blade(name)) for name in EXAMPLES]
    out = []
    for i in range(count):
        blade = copy.deepcopy(originals[i % len(originals)])
        modes = len(blade["states"][0]["frequency_hz"])
        stretch = 1.0 + 0.1 * rng.uniform(-1.0, 1.0, modes).cumsum() / np.sqrt(np.arange(1, modes + 1))
        scale = 1.0 + 0.2 * rng.uniform(-1.0, 1.0, modes)
        blade["name"] = f"{blade['name']}-{i + 1:04d}"
        blade["damping_ratio"] = float(np.exp(rng.uniform(np.log(2e-4), np.log(1e-2))))
        for state in blade["states"]:
            state["frequency_hz"] = np.round(np.sort(np.array(state["frequency_hz"]) * stretch), 4).tolist()
            for key in ("mode_shape", "mode_shape_radial", "mode_shape_tangential"):
                if key in state:
                    state[key] = np.round(np.array(state[key]) * scale[:, None], 6).tolist()
        out.append(blade)
    return out


def batch(count: int, grid: int, **more: Any) -> dict[str, Any]:
    """The question: leading and trailing edge, a map of `grid` × `grid` each."""
    contacts = [{"name": edge, "weights": {edge: 1.0}} for edge in ("LE", "TE")]
    return {
        "name": f"{count} variants",
        "blades": variants(count),
        "contacts": contacts,
        "ke_liner": 5000.0,
        "map_shape": [grid, grid],
        **more,
    }

"""Modal data as one CSV table: a row for each rotor speed, mode and tip node.

Columns ``mode``, ``frequency_hz``, ``node``, ``amplitude`` (kg^-1/2), and where known ``speed_hz`` (0 where
missing), ``damping_ratio``, ``radial``, ``tangential``, ``axial`` (amplitudes), ``radius_m``, ``z_m``,
``theta_rad``, ``growth_m`` of the node and ``untwist_rad`` of the speed. Nodes stand in the order leading to
trailing edge. Lines ``# key = value`` give name, direction, design_speed_hz, mass_kg and material.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from sdm_core.blade.exchange.parsing.fortran_fields import real
from sdm_core.blade.exchange.tables.table import Table, read_table, write_table
from sdm_core.blade.modal import Blade, ModalState
from sdm_core.errors import DamagedFile

REQUIRED = ("mode", "frequency_hz", "node", "amplitude")
_SHAPES = {
    "radial": "mode_shape_radial",
    "tangential": "mode_shape_tangential",
    "axial": "mode_shape_axial",
}
_PLACES = {"radius_m": "tip_radius_m", "z_m": "tip_z_m", "theta_rad": "tip_theta_rad"}
_OPTIONAL = ("speed_hz", "damping_ratio", *_SHAPES, *_PLACES, "growth_m", "untwist_rad")


def read_csv_modal(path: Path, *, damping_ratio: float | None = None) -> Blade:
    """The blade of a table of modal data.

    Raises
    ------
    DamagedFile
        For missing columns or rows, figures that contradict each other, or text for numbers.
    """
    table = read_table(path)
    unknown = [name for name in table.header if name not in (*REQUIRED, *_OPTIONAL)]
    missing = [name for name in REQUIRED if name not in table.header]
    if missing or unknown:
        raise DamagedFile(
            f"{path.name}: header",
            f"{'no ' + missing[0] if missing else unknown[0]}",
            f"give columns {', '.join(REQUIRED)}, and if known {', '.join(_OPTIONAL)}",
        )
    names = [row[table.header.index("node")] for row in table.rows]
    nodes = list(dict.fromkeys(names))
    modes = table.whole("mode")
    speed = table.column("speed_hz") if "speed_hz" in table.header else np.zeros(len(table.rows))
    speeds, numbers = np.unique(speed), np.unique(modes)
    s, n, r = len(speeds), len(numbers), len(nodes)
    place = (
        np.searchsorted(speeds, speed),
        np.searchsorted(numbers, modes),
        np.array([nodes.index(name) for name in names]),
    )
    if len(table.rows) != s * n * r or len(np.unique(np.ravel_multi_index(place, (s, n, r)))) != s * n * r:
        raise DamagedFile(
            path.name,
            f"{len(table.rows)} rows for {s} speeds × {n} modes × {r} nodes",
            "give each speed, mode and node one row: the table is cut off or a row stands twice",
        )

    def grid(column: str) -> np.ndarray:
        out = np.empty((s, n, r))
        out[place] = table.column(column, blank=column in _BLANK)
        return out

    def same(column: str, axes: tuple[int, ...]) -> np.ndarray:
        values = grid(column)
        one = values[tuple(0 if axis in axes else slice(None) for axis in range(3))]
        if not np.array_equal(
            np.broadcast_to(np.expand_dims(one, axes), values.shape), values, equal_nan=True
        ):
            raise DamagedFile(
                f"{path.name}: {column}",
                "different values",
                f"give one {column} for each {_BELONGS[column]} in all its rows",
            )
        return one

    frequency, amplitude = same("frequency_hz", (2,)), grid("amplitude")
    shapes = {key: grid(name) for name, key in _SHAPES.items() if name in table.header}
    growth = same("growth_m", (1,)) if "growth_m" in table.header else None
    untwist = same("untwist_rad", (1, 2)) if "untwist_rad" in table.header else None
    states = [
        ModalState(
            float(speeds[i]),
            frequency[i],
            amplitude[i],
            **{key: _known(values, i) for key, values in shapes.items()},
            tip_growth_m=_known(growth, i),
            untwist_rad=None if (turn := _known(untwist, i)) is None else float(turn),
        )
        for i in range(s)
    ]
    damping: Any = damping_ratio
    if damping is None:
        if "damping_ratio" not in table.header:
            raise DamagedFile(
                f"{path.name}: damping_ratio",
                "missing",
                "add the column damping_ratio, or give damping_ratio",
            )
        damping = same("damping_ratio", (0, 2))
    places = {key: same(name, (0, 1)).tolist() for name, key in _PLACES.items() if name in table.header}
    return Blade(
        table.remarks.get("name") or path.stem,
        nodes,
        damping,
        states,
        table.remarks.get("direction", "given"),
        **places,
        **_remarks(table),
    )


# Optional figures of a speed, blank where not known there.
_BLANK = (*_SHAPES, "growth_m", "untwist_rad")
# What a column's value belongs to.
_BELONGS = {
    "frequency_hz": "mode at a speed",
    "damping_ratio": "mode",
    "growth_m": "node at a speed",
    "untwist_rad": "speed",
    **dict.fromkeys(_PLACES, "node"),
}


def _known(values: np.ndarray | None, state: int) -> np.ndarray | None:
    return None if values is None or np.isnan(values[state]).all() else values[state]


def _remarks(table: Table) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for key in ("design_speed_hz", "mass_kg"):
        if key in table.remarks:
            out[key] = real(f"{table.path.name}: {key}", table.remarks[key])
    if "material" in table.remarks:
        try:
            out["material"] = json.loads(table.remarks["material"])
        except ValueError:
            raise DamagedFile(
                f"{table.path.name}: material",
                table.remarks["material"],
                'write JSON such as {"rho": 4400.0}',
            ) from None
    return out


def write_csv_modal(blade: Blade, path: Path) -> None:
    """Write a blade as a table with all digits."""
    states = blade.states
    shapes = {n: k for n, k in _SHAPES.items() if any(getattr(s, k) is not None for s in states)}
    places = {n: k for n, k in _PLACES.items() if getattr(blade, k) is not None}
    grown = ["growth_m"] if any(state.tip_growth_m is not None for state in states) else []
    turned = ["untwist_rad"] if any(state.untwist_rad is not None for state in states) else []
    columns = ["speed_hz", "mode", "frequency_hz", "damping_ratio", "node", "amplitude"]
    rows: list[list[object]] = []
    for state in states:
        further = [getattr(state, key) for key in shapes.values()]
        for j in range(blade.mode_count):
            for i, node in enumerate(blade.tip_nodes):
                row = [
                    state.speed_hz,
                    j + 1,
                    float(state.frequency_hz[j]),
                    float(blade.damping_ratio[j]),
                    node,
                ]
                row.append(float(state.mode_shape[j, i]))
                row += ["" if shape is None else float(shape[j, i]) for shape in further]
                row += [float(getattr(blade, key)[i]) for key in places.values()]
                row += ["" if state.tip_growth_m is None else float(state.tip_growth_m[i]) for _ in grown]
                row += ["" if state.untwist_rad is None else float(state.untwist_rad) for _ in turned]
                rows.append(row)
    columns += [*shapes, *places, *grown, *turned]
    remarks = {"name": " ".join(blade.name.split()), "direction": blade.direction}
    for key in ("design_speed_hz", "mass_kg"):
        if getattr(blade, key) is not None:
            remarks[key] = repr(float(getattr(blade, key)))
    if blade.material is not None:
        remarks["material"] = json.dumps(blade.material)
    write_table(path, columns, rows, remarks)

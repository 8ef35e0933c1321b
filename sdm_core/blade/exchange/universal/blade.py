"""A blade from universal files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sdm_core.blade.exchange.checks.findings import Finding, note, warning
from sdm_core.blade.exchange.content import Positions
from sdm_core.blade.exchange.units import Units
from sdm_core.blade.exchange.universal.modes import (
    Mode,
    UniversalModes,
    checked_units,
    normalised,
    read_universal_modes,
)
from sdm_core.blade.exchange.universal.nodal_modes import NodalModes, blade_at_tip
from sdm_core.blade.modal import DIRECTIONS, Blade, ModalState
from sdm_core.blade.tip_line import TipLine, cylindrical_frames
from sdm_core.blade.tracking import FURTHER_SHAPES
from sdm_core.errors import DamagedFile, InvalidInput


def read_universal(
    sources: Path | Mapping[float, Path],
    *,
    tip: TipLine | None,
    units: Units,
    rotation_axis: tuple[float, float, float],
    damping_ratio: float | None,
    mass_normalised: bool,
    name: str | None,
    findings: list[Finding],
) -> Blade:
    """Modal data of a file with a load case a speed, or of a file a speed (see `exchange.read_modal`).

    Raises
    ------
    InvalidInput
        When tip nodes, damping or normalisation are not known.
    DamagedFile
        For a file cut off or damaged.
    """
    cases: list[tuple[float, UniversalModes, list[Mode]]] = []
    files = sources if isinstance(sources, Mapping) else {None: sources}
    for speed, path in files.items():
        modes = read_universal_modes(path)
        findings += modes.findings
        checked_units(modes, units.name, units.metres)
        if speed is not None and len(modes.cases) != 1:
            raise DamagedFile(
                path.name, f"{len(modes.cases)} load cases", "give a file with one for each speed"
            )
        for case in sorted(modes.cases):
            at = speed if speed is not None else modes.speed_hz.get(case)
            if at is None:
                if len(modes.cases) > 1:
                    raise InvalidInput(
                        f"{path.name}: load case {case}",
                        "no rotor speed",
                        "give a file for each speed: {speed_hz: file}",
                    )
                at = 0.0
                findings.append(
                    warning(path.name, "no rotor speed: taken as at rest", "give {speed_hz: file} otherwise")
                )
            in_order = [modes.cases[case][number] for number in sorted(modes.cases[case])]
            cases.append((float(at), modes, in_order))
    counts = {len(in_order) for _, _, in_order in cases}
    if len(counts) != 1:
        raise DamagedFile(
            cases[0][1].path.name,
            f"{sorted(counts)} modes at different speeds",
            "export as many at each speed",
        )
    damping = _damping(cases[0][2], damping_ratio)
    first = cases[0][1]
    title = name or first.name or first.path.stem
    if tip is None:
        return _at_own_nodes(title, cases, units, damping, rotation_axis, mass_normalised, findings)
    nodal = [_nodal(at, modes, rows, units, mass_normalised, findings) for at, modes, rows in cases]
    places: Positions = {
        node: (x * units.metres, y * units.metres, z * units.metres)
        for node, (x, y, z) in first.places.items()
    }
    return blade_at_tip(title, nodal, tip, places, rotation_axis, damping)


def _damping(modes: list[Mode], given: float | None) -> float | list[float]:
    if given is not None:
        return given
    ratios = [mode.damping_ratio for mode in modes]
    if not any(ratios):
        raise InvalidInput("damping_ratio", "0 in the file", "give damping_ratio: the file has none")
    return ratios


def _nodal(
    speed: float,
    modes: UniversalModes,
    rows: list[Mode],
    units: Units,
    assume: bool,
    findings: list[Finding],
) -> NodalModes:
    scale = [normalised(modes, mode, assume, findings) * units.mode_shape for mode in rows]
    nodes = set.intersection(*(set(mode.vector) for mode in rows))
    return NodalModes(
        speed,
        np.array([mode.frequency_hz for mode in rows]),
        np.array([mode.damping_ratio for mode in rows]),
        {
            node: np.array([mode.vector[node] * s for mode, s in zip(rows, scale, strict=True)])
            for node in nodes
        },
    )


def _at_own_nodes(
    title: str,
    cases: list[tuple[float, UniversalModes, list[Mode]]],
    units: Units,
    damping: float | list[float],
    rotation_axis: tuple[float, float, float],
    assume: bool,
    findings: list[Finding],
) -> Blade:
    """A blade from amplitudes in the contact direction, one value a node, as `write_universal` writes."""
    first = cases[0][1]
    nodes = sorted(set.intersection(*(set(mode.scalar) for _, _, rows in cases for mode in rows)))
    if not nodes:
        raise InvalidInput(
            "tip",
            "missing",
            f"{first.path.name} holds displacements x, y, z: give the tip nodes and their contact directions",
        )
    frames = None
    radius = z = theta = None
    axis = np.array(rotation_axis)
    if all(node in first.places for node in nodes):
        place = np.array([first.places[node] for node in nodes]) * units.metres
        frames = cylindrical_frames(place, axis)
        radius = np.einsum("rx,rx->r", place, frames[:, 0]).tolist()
        z = (place @ axis).tolist()
        reference = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
        reference = reference - axis * (reference @ axis)
        reference /= np.linalg.norm(reference)
        across = np.cross(axis, reference)
        theta = np.arctan2(frames[:, 0] @ across, frames[:, 0] @ reference).tolist()
    states = []
    for speed, modes, rows in cases:
        scale = np.array([normalised(modes, mode, assume, findings) * units.mode_shape for mode in rows])
        main = np.array([[mode.scalar[node] for node in nodes] for mode in rows]) * scale[:, None]
        further: dict[str, Any] = {}
        if frames is not None and all(node in mode.vector for mode in rows for node in nodes):
            vector = np.array([[mode.vector[node] for node in nodes] for mode in rows])
            along = np.einsum("nrx,rax->anr", vector * scale[:, None, None], frames)
            further = dict(zip(FURTHER_SHAPES, along, strict=True))
        states.append(ModalState(speed, np.array([mode.frequency_hz for mode in rows]), main, **further))
    names = [first.node_names.get(node, f"N{node}") for node in nodes]
    direction = first.direction
    if direction not in DIRECTIONS:
        findings.append(note("direction", "not said by the file: amplitudes are taken as given"))
        direction = "given"
    return Blade(
        title,
        names,
        damping,
        states,
        direction,
        tip_radius_m=radius,
        tip_z_m=z,
        tip_theta_rad=theta,
    )

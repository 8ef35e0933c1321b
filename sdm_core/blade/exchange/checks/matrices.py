"""What an imported matrix model is checked for, and what is said about it.

Errors are for what would make the blade wrong or unusable; the rest are warnings and notes.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from sdm_core.blade.exchange.checks.definiteness import check_mass, entries, spectrum
from sdm_core.blade.exchange.checks.findings import Finding, Findings, note, warning
from sdm_core.blade.exchange.checks.plausibility import (
    suspicious_frequency,
    suspicious_mass,
    suspicious_places,
)
from sdm_core.blade.matrix_model import MODAL, TRANSLATIONS, DofMap, Matrix, MatrixModel
from sdm_core.errors import InvalidInput
from sdm_core.validation import SPEED_LIMITS_HZ, number

# The first frequency of a real blade rises with speed, or falls a little where spin softening wins.
LARGEST_FALL = 0.05


def check_model(model: MatrixModel, *, units: str, tip_nodes: Sequence[int] = ()) -> Findings:
    """Check a model whose matrices are symmetric and of one size.

    Parameters
    ----------
    model
        In SI.
    units
        Unit system it was read in, for the cause of suspicious figures.
    tip_nodes
        Nodes that will meet the casing, where known already.

    Raises
    ------
    InvalidInput
        For a mass that is not positive definite, an unstable blade, two states at one speed, or tip nodes
        that the model does not hold.
    """
    size = len(model.dofs)
    names = row_names(model.dofs)
    check_mass("mass", model.mass, names)
    found: list[Finding] = []
    figures: dict[str, float | int | str | tuple[float, ...]] = {
        "size": size,
        "nonzeros_mass": int(np.count_nonzero(entries(model.mass))),
        "nonzeros_stiffness": int(np.count_nonzero(entries(model.states[0].stiffness))),
        "modal_coordinates": int((model.dofs.component == MODAL).sum()),
        "nodes": len(np.unique(model.dofs.node[model.dofs.component != MODAL])),
    }
    speeds(model, found)
    first: list[float] = []
    for i, state in enumerate(model.states):
        low = spectrum(f"states[{i}].stiffness", state.stiffness, model.mass)
        if low.unstable:
            raise InvalidInput(
                f"states[{i}].stiffness",
                f"{low.unstable} modes with negative ω² at {state.speed_hz:g} Hz",
                "a blade that stands is positive definite: check signs, the load, or the file",
            )
        if low.rigid:
            found.append(
                warning(
                    f"states[{i}].stiffness",
                    f"{low.rigid} rigid-body modes at {state.speed_hz:g} Hz",
                    "clamp the root before modes are asked for",
                )
            )
        figures[f"rigid_body_modes_at_{state.speed_hz:g}_hz"] = low.rigid
        figures[f"frequency_hz_at_{state.speed_hz:g}_hz"] = tuple(low.frequency_hz.tolist())
        if len(low.frequency_hz):
            first.append(float(low.frequency_hz[0]))
    moved = moved_mass(model.mass, model.dofs)
    figures["mass_moved_kg"] = moved
    if figures["modal_coordinates"] == 0 and min(moved) > 0 and max(moved) > 1.01 * min(moved):
        found.append(
            warning(
                "mass",
                f"translation along x, y, z moves {moved[0]:.4g}, {moved[1]:.4g}, {moved[2]:.4g} kg",
                "rows of some components are missing, or the map of degrees of freedom is mixed up",
            )
        )
    if first:
        found += suspicious_frequency(first[0], max(moved))
    for (before, f0), (after, f1) in pairwise(zip([s.speed_hz for s in model.states], first, strict=False)):
        if f1 < (1 - LARGEST_FALL) * f0:
            found.append(
                warning(
                    "states",
                    f"the first frequency falls from {f0:.5g} Hz to {f1:.5g} Hz "
                    f"as the speed goes from {before:g} Hz to {after:g} Hz",
                    "rotation stiffens a blade: are the speeds exchanged, or stress stiffening left out?",
                )
            )
    found += suspicious_mass(max(moved), units)
    found += suspicious_places(model, units)
    check_dofs(model, found)
    check_tip(model, tip_nodes, found)
    return Findings(tuple(found), figures)


def row_names(dofs: DofMap) -> list[str]:
    """Each row in words: ``node 12, component 3``."""
    pairs = zip(dofs.node.tolist(), dofs.component.tolist(), strict=True)
    return [
        f"row {i + 1} (modal)" if c == MODAL else f"row {i + 1} (node {n}, component {c})"
        for i, (n, c) in enumerate(pairs)
    ]


def speeds(model: MatrixModel, found: list[Finding]) -> None:
    """Speeds are numbers, each once."""
    values = [
        number(f"states[{i}].speed_hz", s.speed_hz, 0.0, SPEED_LIMITS_HZ[1], "Hz")
        for i, s in enumerate(model.states)
    ]
    if len(set(values)) != len(values):
        raise InvalidInput("states", f"speeds {values}", "give one stiffness a rotor speed")
    if values[0] > 0:
        found.append(note("states", f"no stiffness at rest: the slowest is at {values[0]:g} Hz"))


def moved_mass(mass: Matrix, dofs: DofMap) -> tuple[float, float, float]:
    """Mass that a rigid translation along x, y, z moves, kg: rᵀMr.

    Without modal coordinates and clamped nodes it is the whole mass; clamped nodes take theirs away.
    """
    masses = []
    for component in TRANSLATIONS:
        r = (dofs.component == component).astype(float)
        masses.append(float(r @ (mass @ r)))
    return masses[0], masses[1], masses[2]


def check_dofs(model: MatrixModel, found: list[Finding]) -> None:
    """Nodes with some of their translations missing, and nodes without a place."""
    physical = model.dofs.component != MODAL
    nodes = model.dofs.node[physical]
    at_node = {int(n): 0 for n in nodes}
    for node, component in zip(nodes.tolist(), model.dofs.component[physical].tolist(), strict=True):
        at_node[node] += component in TRANSLATIONS
    partial = [node for node, count in at_node.items() if 0 < count < 3]
    if partial:
        found.append(
            note("dofs", f"{len(partial)} nodes lack translations, the first is {partial[0]}: no tip nodes")
        )
    if at_node and model.node_position_m:
        without = [node for node in at_node if node not in model.node_position_m]
        if without:
            found.append(
                note("node_position_m", f"{len(without)} nodes without a place, the first is {without[0]}")
            )
    elif at_node:
        found.append(
            warning(
                "node_position_m",
                "no places of nodes",
                "add a table node,x_m,y_m,z_m, at least for the tip nodes: contact directions need them",
            )
        )


def check_tip(model: MatrixModel, tip_nodes: Sequence[int], found: list[Finding]) -> None:
    """Tip nodes have three translations, a place off the axis, and a radius above that of most nodes.

    Raises
    ------
    InvalidInput
        Naming the tip node that does not.
    """
    axis = np.array(model.rotation_axis)
    nodes = list(model.node_position_m)
    if nodes:
        place = model.positions(nodes)
        radius = np.linalg.norm(place - np.outer(place @ axis, axis), axis=1)
        on_axis = radius <= 1e-9 * (1 + float(np.abs(place).max()))
        if on_axis.any():
            found.append(
                warning(
                    "rotation_axis",
                    f"{int(on_axis.sum())} nodes lie on it, the first is {nodes[int(np.argmax(on_axis))]}",
                    "a blade keeps clear of the axis: check its direction, and that it passes the origin",
                )
            )
    if not len(tip_nodes):
        return
    model.dofs.rows(list(tip_nodes))
    place = model.positions(list(tip_nodes))
    tip = np.linalg.norm(place - np.outer(place @ axis, axis), axis=1)
    if (tip <= 1e-9 * (1 + float(np.abs(place).max()))).any():
        i = int(np.argmin(tip))
        raise InvalidInput(f"tip.nodes[{i}]", tip_nodes[i], "it lies on the rotation axis: check the axis")
    # A reduced model may hold tip nodes only: those lie within the slope of the casing of each other.
    if tip.min() < min(float(np.median(radius)), 0.95 * float(radius.max())):
        i = int(np.argmin(tip))
        found.append(
            warning(
                f"tip.nodes[{i}]",
                f"node {tip_nodes[i]} is at a radius of {tip[i]:.4g} m, half of all nodes are beyond "
                f"{float(np.median(radius)):.4g} m",
                "the tip is farthest from the axis: check nodes and rotation axis",
            )
        )

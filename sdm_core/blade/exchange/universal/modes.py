"""Normal modes from universal files: datasets 55, and 58 where a file keeps more digits there."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sdm_core.blade.exchange.checks.findings import Finding, note, warning
from sdm_core.blade.exchange.content import Positions
from sdm_core.blade.exchange.parsing.fortran_fields import integer, real
from sdm_core.blade.exchange.universal.datasets import CUT_OFF, Dataset, datasets, length_factor, node_places
from sdm_core.errors import DamagedFile, InvalidInput

NORMAL_MODE, REAL, DOUBLE = 2, 2, 4
SCALAR, TRANSLATIONS, WITH_ROTATIONS = 1, 2, 3
EIGENVECTOR = 23
# Digits of E13.5: what dataset 58 repeats must agree this well.
SIX_DIGITS = 2e-5


@dataclass
class Mode:
    """One mode as the file has it: values by node, one (scalar) or x, y, z."""

    number: int
    frequency_hz: float
    modal_mass: float
    damping_ratio: float
    scalar: dict[int, float] = field(default_factory=dict)
    vector: dict[int, np.ndarray] = field(default_factory=dict)


@dataclass
class UniversalModes:
    """What a universal file says about normal modes.

    Modes are by load case, then mode number; a load case is a rotor speed.
    """

    path: Path
    cases: dict[int, dict[int, Mode]] = field(default_factory=dict)
    speed_hz: dict[int, float] = field(default_factory=dict)
    places: Positions = field(default_factory=dict)
    node_names: dict[int, str] = field(default_factory=dict)
    name: str | None = None
    direction: str | None = None
    length_per_metre: float | None = None
    findings: list[Finding] = field(default_factory=list)


def read_universal_modes(path: Path) -> UniversalModes:
    """All normal modes of a universal file.

    Raises
    ------
    DamagedFile
        For a file cut off, damaged, or without normal modes.
    """
    out = UniversalModes(path)
    functions: list[Dataset] = []
    skipped: dict[int, int] = {}
    for dataset in datasets(path):
        if dataset.number in (15, 2411):
            out.places |= node_places(dataset)
        elif dataset.number == 55:
            _data_at_nodes(out, dataset)
        elif dataset.number == 58:
            functions.append(dataset)
        elif dataset.number == 164:
            out.length_per_metre = length_factor(dataset)
        elif dataset.number == 151:
            _header(out, dataset)
        else:
            skipped[dataset.number] = skipped.get(dataset.number, 0) + 1
    names = ", ".join(map(str, sorted(skipped)))
    if not out.cases:
        have = names + (" and 58" if functions else "") or "nodes only"
        raise DamagedFile(
            path.name,
            f"no normal modes (datasets {have})",
            "export the modes as dataset 55, data at nodes, analysis type 2",
        )
    if skipped:
        out.findings.append(note(path.name, f"datasets {names} were passed over"))
    for function in functions:
        _eigenvector(out, function)
    return out


def _header(out: UniversalModes, dataset: Dataset) -> None:
    out.name = dataset.line(0).strip() or None
    match = re.search(r"CONTACT_DIRECTION (\w+)", " ".join(dataset.lines[1:2]))
    out.direction = match[1] if match else None


def _data_at_nodes(out: UniversalModes, dataset: Dataset) -> None:
    where = dataset.where
    _, analysis, character, kind, data_type, width = dataset.integers(5, *[10] * 6)
    if analysis in (3, 7):
        raise DamagedFile(where, "complex modes", "give real normal modes: without damping in the analysis")
    if analysis != NORMAL_MODE:
        out.findings.append(note(where, f"analysis type {analysis}, no normal mode: passed over"))
        return
    if data_type not in (REAL, DOUBLE):
        raise DamagedFile(where, f"data type {data_type}", "give real normal modes")
    if kind in (11, 12):
        raise DamagedFile(where, f"data kind {kind}, velocity or acceleration", "export displacements")
    values_of = {SCALAR: 1, TRANSLATIONS: 3, WITH_ROTATIONS: 6}
    if values_of.get(character) != width:
        raise DamagedFile(
            where,
            f"{width} values of characteristic {character} a node",
            "give displacements x, y, z (or with rotations): characteristic 2 or 3",
        )
    integers, reals, case, number = dataset.integers(6, 10, 10, 10, 10)
    if integers < 2 or reals < 2 or number < 1:
        raise DamagedFile(where, f"mode {number} with {reals} reals", CUT_OFF)
    frequency, mass, *damping = dataset.reals(7, 13, min(reals, 4))
    ids = dataset.id_values()
    if "FREQUENCY_HZ" in ids:
        frequency = _repeated(where, "frequency", frequency, ids["FREQUENCY_HZ"])
    xi = damping[0] if damping else 0.0
    if "DAMPING_RATIO" in ids:
        xi = _repeated(where, "damping", xi, ids["DAMPING_RATIO"])
    if "SPEED_HZ" in ids:
        speed = real(where, ids["SPEED_HZ"])
        if out.speed_hz.setdefault(case, speed) != speed:
            raise DamagedFile(where, f"load case {case} at two speeds", "give each speed its own load case")
    modes = out.cases.setdefault(case, {})
    mode = modes.setdefault(number, Mode(number, frequency, mass, xi))
    if (mode.frequency_hz, mode.modal_mass) != (frequency, mass):
        raise DamagedFile(where, f"mode {number} of load case {case} twice", "give each mode once")
    _node_values(mode, dataset, width, 20 if data_type == DOUBLE else 13)


def _node_values(mode: Mode, dataset: Dataset, width: int, field_width: int) -> None:
    at = 8
    if at >= len(dataset.lines):
        raise DamagedFile(dataset.where, "no node", CUT_OFF)
    while at < len(dataset.lines):
        (node,) = dataset.integers(at, 10)
        # Writers of double precision use wider fields, or keep the standard ones.
        size = field_width if len(dataset.line(at + 1).rstrip()) > 13 * width else 13
        per_line = 80 // size
        values: list[float] = []
        while len(values) < width:
            at += 1
            values += dataset.reals(at, size, min(per_line, width - len(values)))
        at += 1
        target: Mapping[int, object] = mode.scalar if width == 1 else mode.vector
        if node < 1 or node in target:
            raise DamagedFile(dataset.where, f"node {node} in mode {mode.number}", "give every node once")
        if width == 1:
            mode.scalar[node] = values[0]
        else:
            mode.vector[node] = np.array(values[:3])


def _repeated(where: str, what: str, short: float, text: str) -> float:
    """The figure with all its digits, which must be the one that the standard field rounds."""
    value = real(where, text)
    if abs(value - short) > SIX_DIGITS * max(abs(value), abs(short)):
        raise DamagedFile(where, f"{what} {short:g} and {text}", "the two differ: the file is damaged")
    return value


def _eigenvector(out: UniversalModes, dataset: Dataset) -> None:
    """Dataset 58 of function type 23: one component at one node over the mode numbers, 13 digits."""
    head = dataset.line(5)
    if integer(dataset.where, head[:5] or "0") != EIGENVECTOR:
        return
    case = integer(dataset.where, head[20:30])
    node, direction = integer(dataset.where, head[41:51]), integer(dataset.where, head[51:55])
    kind, count, spacing = dataset.integers(6, 10, 10, 10)
    modes = out.cases.get(case, {})
    # Foreign eigenvectors in other forms repeat what dataset 55 says.
    if kind != DOUBLE or spacing != 1 or count != len(modes) or not 0 <= direction <= 3:
        out.findings.append(note(dataset.where, "an eigenvector in a form that is not used: passed over"))
        return
    if dataset.line(1).startswith("NODE "):
        out.node_names[node] = dataset.line(1)[5:].strip()
    values: list[float] = []
    at = 11
    while len(values) < count:
        values += dataset.reals(at, 20, min(4, count - len(values)))
        at += 1
    for number, value in zip(sorted(modes), values, strict=True):
        mode = modes[number]
        if direction == 0:
            short = mode.scalar.get(node)
        else:
            short = float(mode.vector[node][direction - 1]) if node in mode.vector else None
        if short is None or abs(short - value) > SIX_DIGITS * max(abs(short), abs(value)):
            raise DamagedFile(
                dataset.where,
                f"node {node}, mode {number}: {value:g} against {short} in dataset 55",
                "the two differ: the file is damaged",
            )
        if direction == 0:
            mode.scalar[node] = value
        else:
            mode.vector[node][direction - 1] = value


def checked_units(modes: UniversalModes, units: str, metres: float) -> None:
    """The units the file declares are the ones it is read in.

    Raises
    ------
    InvalidInput
        When dataset 164 says otherwise.
    """
    if modes.length_per_metre is None:
        return
    if abs(modes.length_per_metre * metres - 1) > 1e-6:
        raise InvalidInput(
            "units",
            units,
            f"{modes.path.name} declares {modes.length_per_metre:g} lengths a metre (dataset 164): "
            'give units="mm-t-s" for millimetres, "SI" for metres',
        )


def normalised(modes: UniversalModes, mode: Mode, assume: bool, findings: list[Finding]) -> float:
    """Factor that makes a mode mass-normalised in the file's units: 1/√(modal mass).

    Raises
    ------
    InvalidInput
        When the file gives no modal mass and nothing was said about the normalisation.
    """
    where = f"mode {mode.number}"
    if mode.modal_mass > 0:
        values = [abs(v) for v in mode.scalar.values()] + [
            float(np.abs(v).max()) for v in mode.vector.values()
        ]
        largest = max(values, default=0.0)
        if mode.modal_mass == 1.0 and abs(largest - 1.0) < 1e-4:
            findings.append(
                warning(
                    where,
                    "its largest amplitude is 1 and its modal mass is 1",
                    "shapes scaled to unit amplitude need their own modal mass: check the export",
                )
            )
        return float(mode.modal_mass**-0.5)
    if assume:
        return 1.0
    raise InvalidInput(
        f"{modes.path.name}: {where}",
        f"modal mass {mode.modal_mass:g}",
        "the file does not say how shapes are scaled: export modal masses, or give mass_normalised=True",
    )

"""What is typed to `rubscreen blade import` and `check`, turned into a blade and findings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sdm_core.blade import EXAMPLES, Blade, example_blade
from sdm_core.blade.exchange import Findings, read_matrix_model, read_modal
from sdm_core.blade.exchange.checks.modal import check_blade
from sdm_core.blade.matrix_model import MatrixModel
from sdm_core.blade.tip_line import Direction, TipLine
from sdm_core.errors import InvalidInput

MODAL_SUFFIXES = (".json", ".uff", ".unv", ".unf")
# These hold either: they are tried as modal data first.
_EITHER = (".npz", ".mat")
# A CSV table of modal data has this column, under its comments; one of matrices has not.
_MODAL_COLUMN = "frequency_hz"


@dataclass(frozen=True)
class ImportChoices:
    """How files are to be understood; texts as typed."""

    format: str | None = None
    modal: bool | None = None
    stiffness: str | None = None
    mass: str | None = None
    units: str = "SI"
    axis: str | None = None
    tip: str | None = None
    names: str | None = None
    direction: str = "casing_normal"
    casing_slope: float | None = None
    modes: int = 5
    damping: float | None = None
    design_speed_hz: float | None = None
    name: str | None = None
    mass_normalised: bool = False


@dataclass(frozen=True)
class Imported:
    """A blade (None: matrices that were only checked), the matrices it came from, and the findings."""

    blade: Blade | None
    model: MatrixModel | None
    findings: Findings


def imported(files: Sequence[str], choices: ImportChoices, *, blade_wanted: bool) -> Imported:
    """Read files, as modal data or as matrices.

    Raises
    ------
    InvalidInput
        Naming the option, its value and the remedy.
    """
    if len(files) == 1 and files[0] in EXAMPLES and not Path(files[0]).exists():
        blade = example_blade(files[0])
        return Imported(blade, None, check_blade(blade, units="SI"))
    if is_modal(files, choices):
        return _from_modal(files, choices)
    if choices.modal is None and Path(files[0]).suffix.lower() in _EITHER:
        try:
            return _from_modal(files, choices)
        except InvalidInput:
            # Modal data need no tip nodes: without them, what is wrong with the modal data is the answer.
            if blade_wanted and choices.tip is None and not _holds_matrices(files, choices):
                raise
    nodes = _numbers("--tip", choices.tip, int) if choices.tip else []
    read = read_matrix_model(
        list(files),
        format=choices.format,
        stiffness=_by_speed(choices.stiffness),
        mass=choices.mass,
        units=choices.units,
        rotation_axis=_axis(choices.axis),
        name=choices.name,
        tip_nodes=nodes,
    )
    if not blade_wanted:
        return Imported(None, read.model, read.findings)
    if not nodes:
        raise InvalidInput(
            "--tip", "missing", "name the contact nodes, leading to trailing edge, e.g. 101,105,109"
        )
    if choices.damping is None:
        raise InvalidInput(
            "--damping", "missing", "matrices hold no damping: give the modal damping ratio, e.g. 1e-3"
        )
    tip = _tip_line(read.model, nodes, choices)
    blade = read.model.to_blade(
        tip,
        damping_ratio=choices.damping,
        modes=choices.modes,
        name=choices.name,
        design_speed_hz=choices.design_speed_hz,
    )
    return Imported(blade, read.model, read.findings)


def is_modal(files: Sequence[str], choices: ImportChoices) -> bool:
    """Whether the files hold modal data: as told, else by suffix or the table's first line."""
    if choices.modal is not None:
        return choices.modal
    first = Path(files[0])
    if first.suffix.lower() in MODAL_SUFFIXES:
        return True
    if first.suffix.lower() in (".csv", ".tsv", ".txt") and first.is_file():
        with first.open("rb") as file:
            return _MODAL_COLUMN.encode() in file.read(65_536)
    return False


def _holds_matrices(files: Sequence[str], choices: ImportChoices) -> bool:
    try:
        read_matrix_model(list(files), format=choices.format, units=choices.units)
    except InvalidInput:
        return False
    return True


def _from_modal(files: Sequence[str], choices: ImportChoices) -> Imported:
    sources: dict[float, str | Path] | str = files[0]
    if len(files) > 1 or "=" in files[0]:
        sources = {}
        for text in files:
            speed, equals, path = text.partition("=")
            if not equals:
                raise InvalidInput("FILES", text, "with several files of modal data give SPEED_HZ=FILE each")
            sources[_number("FILES", speed)] = path
    read = read_modal(
        sources,
        format=choices.format,
        damping_ratio=choices.damping,
        units=choices.units,
        rotation_axis=_axis(choices.axis) or (0.0, 0.0, 1.0),
        mass_normalised=choices.mass_normalised,
        name=choices.name,
    )
    return Imported(read.blade, None, read.findings)


def _tip_line(model: MatrixModel, nodes: list[int], choices: ImportChoices) -> TipLine:
    names = choices.names.split(",") if choices.names else _names(len(nodes))
    return TipLine.along(
        [name.strip() for name in names],
        nodes,
        model.positions(nodes),
        _direction(choices.direction),
        casing_slope=choices.casing_slope,
        rotation_axis=model.rotation_axis,
    )


def _names(count: int) -> list[str]:
    return ["LE"] if count == 1 else ["LE", *(f"N{i}" for i in range(2, count)), "TE"]


def _direction(text: str) -> Direction:
    if "," not in text:
        return text
    parts = _numbers("--direction", text, float)
    if len(parts) != 3:
        raise InvalidInput("--direction", text, "give RADIAL,TANGENTIAL,AXIAL")
    return parts[0], parts[1], parts[2]


def _axis(text: str | None) -> tuple[float, float, float] | None:
    if text is None:
        return None
    parts = _numbers("--axis", text, float)
    length = float(np.linalg.norm(parts))
    if len(parts) != 3 or not np.isfinite(length) or length == 0:
        raise InvalidInput("--axis", text, "give X,Y,Z of the rotation axis, e.g. 0,0,1")
    return parts[0] / length, parts[1] / length, parts[2] / length


def _by_speed(text: str | None) -> str | dict[float, str] | None:
    if text is None or "=" not in text:
        return text
    out = {}
    for part in text.split(","):
        speed, equals, name = part.partition("=")
        if not equals:
            raise InvalidInput("--stiffness", text, "give SPEED_HZ=NAME each, e.g. 0=K0,200=K200")
        out[_number("--stiffness", speed)] = name.strip()
    return out


def _numbers(option: str, text: str, kind: type) -> list:
    try:
        return [kind(part) for part in text.split(",")]
    except ValueError:
        raise InvalidInput(option, text, "give numbers separated by commas") from None


def _number(option: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InvalidInput(option, text, "give a rotor speed in Hz before the =") from None

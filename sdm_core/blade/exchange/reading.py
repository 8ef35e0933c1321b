"""The front doors in: matrices to a `MatrixModel`, modal data to a `Blade`, each with what was found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sdm_core.blade.blade_file import read_blade
from sdm_core.blade.exchange.assembly import Wanted, assembled
from sdm_core.blade.exchange.checks.findings import Finding, Findings, note
from sdm_core.blade.exchange.checks.modal import check_blade
from sdm_core.blade.exchange.content import FileContent
from sdm_core.blade.exchange.formats import MATRICES, MODAL, format_of
from sdm_core.blade.exchange.named_arrays.mat import read_mat_matrices, read_mat_modal
from sdm_core.blade.exchange.named_arrays.npz import read_npz_blade, read_npz_model
from sdm_core.blade.exchange.nastran.dmig import read_dmig
from sdm_core.blade.exchange.nastran.op4 import read_op4
from sdm_core.blade.exchange.parsing.file_bytes import file_size, named_damage
from sdm_core.blade.exchange.tables.matrices import read_csv_matrices
from sdm_core.blade.exchange.tables.modal import read_csv_modal
from sdm_core.blade.exchange.triplets.calculix import companions, read_calculix
from sdm_core.blade.exchange.triplets.matrix_market import read_matrix_market
from sdm_core.blade.exchange.units import SI, Units, units_of
from sdm_core.blade.exchange.universal.blade import read_universal
from sdm_core.blade.matrix_model import MatrixModel
from sdm_core.blade.modal import Blade, ModalState
from sdm_core.blade.tip_line import TipLine
from sdm_core.blade.tracking import FURTHER_SHAPES
from sdm_core.errors import InvalidInput

Source = str | Path

_MATRIX_READERS: Mapping[str, Callable[[Path], FileContent]] = {
    "op4": read_op4,
    "dmig": read_dmig,
    "mat": read_mat_matrices,
    "mtx": read_matrix_market,
    "calculix": read_calculix,
    "npz": read_npz_model,
}
_MODAL_READERS: Mapping[str, Callable[[Path], Blade]] = {
    "json": read_blade,
    "mat": read_mat_modal,
    "npz": read_npz_blade,
}


@dataclass(frozen=True)
class MatrixImport:
    """An imported model, and what the import found."""

    model: MatrixModel
    findings: Findings


@dataclass(frozen=True)
class ModalImport:
    """An imported blade, and what the import found."""

    blade: Blade
    findings: Findings


def read_matrix_model(
    sources: Source | Sequence[Source],
    *,
    format: str | None = None,
    stiffness: str | Mapping[float, str] | None = None,
    mass: str | None = None,
    units: str = "SI",
    rotation_axis: Sequence[float] | None = None,
    name: str | None = None,
    tip_nodes: Sequence[int] = (),
) -> MatrixImport:
    """Read mass, stiffness at one or more rotor speeds, and what each row is.

    Parameters
    ----------
    sources
        The files: matrices, and companion tables where the format has no place for the map of degrees of
        freedom (CSV ``node,component``), places of nodes (``node,x_m,y_m,z_m``) or speeds
        (``speed_hz,stiffness``). A file of a CalculiX job brings those beside it
        whose kind is not among the files.
    format
        Of all files but companion tables; by their suffixes where left out.
    stiffness
        Name of the stiffness, or a name for each rotor speed in Hz. A name is that of a matrix, of a file
        with one matrix, or ``file:matrix``. Found by usual names (K, KAAX, ...) where left out.
    mass
        Name of the mass; found by usual names where left out.
    units
        ``SI`` or ``mm-t-s`` (mm, t, s, N: K in N/mm, M in t), converted to SI. Never guessed: suspicious
        figures are named.
    rotation_axis
        Direction, through the origin; what the file says, else z, where left out.
    name
        Of the model.
    tip_nodes
        Nodes that will meet the casing, to be checked.

    Raises
    ------
    InvalidInput
        For files that do not make a blade: naming what and the remedy.
    DamagedFile
        For a file cut off, damaged or of another kind.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> tables = {"K": "4e6,0,0\\n0,9e6,0\\n0,0,9e6\\n", "M": "0.1,0,0\\n0,0.1,0\\n0,0,0.1\\n"}
    >>> tables["map"] = "node,component\\n7,1\\n7,2\\n7,3\\n"
    >>> files = [folder / f"{name}.csv" for name in tables]
    >>> for file, table in zip(files, tables.values()):
    ...     _ = file.write_text(table)
    >>> found = read_matrix_model(files, stiffness={120.0: "K"})
    >>> found.model.states[0].speed_hz, round(found.findings.figures["frequency_hz_at_120_hz"][0], 2)
    (120.0, 1006.58)
    """
    system = units_of(units)
    paths = _paths(sources)
    found = []
    jobs = [path for path in paths if path.suffix.lower() in (".sti", ".mas")]
    if jobs:
        # Of several jobs on one mesh, one mass and one map are enough: those given come first.
        given = {path.suffix.lower() for path in paths}
        beside = [other for other in companions(jobs[0]) if other.suffix.lower() not in given]
        paths += beside
        if beside:
            found.append(note("files", "read with " + ", ".join(path.name for path in beside)))
    contents = [_content(path, format, system) for path in paths]
    wanted = Wanted(stiffness, mass, system, rotation_axis, name, tip_nodes)
    # Arithmetic on absurd but finite numbers may overflow: what comes out is checked instead.
    with np.errstate(all="ignore"), named_damage(paths[0], "a model of matrices"):
        model, findings = assembled(contents, wanted)
    return MatrixImport(model, Findings(tuple(found)) + findings)


def _paths(sources: Source | Sequence[Source]) -> list[Path]:
    listed = [sources] if isinstance(sources, str | Path) else list(sources)
    if not listed:
        raise InvalidInput("files", "none", "name at least one file")
    paths = [Path(source) for source in listed]
    if len(set(paths)) != len(paths):
        raise InvalidInput("files", ", ".join(map(str, paths)), "name every file once")
    return paths


def _content(path: Path, given: str | None, units: Units) -> FileContent:
    file_size(path)
    companion = path.suffix.lower() == ".csv" and given != "csv"
    chosen = format_of(path, None if companion else given, what=MATRICES)
    with np.errstate(all="ignore"), named_damage(path, chosen.title):
        if chosen.name == "csv":
            return read_csv_matrices(path, metres=units.metres)
        return _MATRIX_READERS[chosen.name](path)


def read_modal(
    sources: Source | Mapping[float, Source],
    *,
    format: str | None = None,
    damping_ratio: float | None = None,
    units: str = "SI",
    tip: TipLine | None = None,
    rotation_axis: Sequence[float] = (0.0, 0.0, 1.0),
    mass_normalised: bool = False,
    name: str | None = None,
) -> ModalImport:
    """Read modal data at the tip of a blade.

    Parameters
    ----------
    sources
        A file, or a universal file for each rotor speed in Hz.
    format
        By the suffix where left out.
    damping_ratio
        Replaces that of the file; needed where it has none.
    units
        Of amplitudes (mass^-1/2) and places: ``SI`` or ``mm-t-s``.
    tip
        Tip nodes and contact directions, for universal files with displacements x, y, z.
    rotation_axis
        Through the origin, for the same.
    mass_normalised
        Say so where a universal file gives no modal masses.
    name
        Of the blade.

    Raises
    ------
    InvalidInput
        For data that make no blade.
    DamagedFile
        For a file cut off, damaged or of another kind.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "blade.csv"
    >>> _ = file.write_text("mode;frequency_hz;node;amplitude\\n1;400;LE;9.5\\n1;400;TE;8.1\\n")
    >>> read_modal(file, damping_ratio=1e-3).blade.tip_nodes
    ('LE', 'TE')
    """
    system = units_of(units)
    if isinstance(sources, Mapping):
        files = {float(speed): Path(source) for speed, source in sources.items()}
        if not files:
            raise InvalidInput("files", "none", "name at least one file")
    else:
        files = {}
    paths = list(files.values()) or [Path(sources)]  # type: ignore[arg-type]
    for path in paths:
        file_size(path)
    chosen = format_of(paths[0], format, what=MODAL)
    found: list[Finding] = []
    with np.errstate(all="ignore"), named_damage(paths[0], chosen.title):
        if chosen.name == "uff":
            blade = read_universal(
                files or paths[0],
                tip=tip,
                units=system,
                rotation_axis=_unit(rotation_axis),
                damping_ratio=damping_ratio,
                mass_normalised=mass_normalised,
                name=name,
                findings=found,
            )
        else:
            if len(paths) > 1:
                raise InvalidInput(
                    "files", f"{len(paths)} files", f"{chosen.title}: all speeds are in one file"
                )
            if chosen.name == "csv":
                blade = read_csv_modal(paths[0], damping_ratio=damping_ratio)
            else:
                blade = _MODAL_READERS[chosen.name](paths[0])
            blade = _converted(blade, system, damping_ratio, name)
        report = check_blade(blade, units=units)
    return ModalImport(blade, Findings(tuple(found)) + report)


def _unit(axis: Sequence[float]) -> tuple[float, float, float]:
    direction = np.array(axis, dtype=float)
    if direction.shape != (3,) or not np.isfinite(direction).all() or not direction.any():
        raise InvalidInput("rotation_axis", list(axis), "give x, y, z of a direction")
    x, y, z = (direction / np.linalg.norm(direction)).tolist()
    return x, y, z


def _converted(blade: Blade, units: Units, damping_ratio: float | None, name: str | None) -> Blade:
    if units is SI and damping_ratio is None and name is None:
        return blade
    states: Sequence[ModalState] = blade.states
    if units is not SI:
        states = [
            ModalState(
                state.speed_hz,
                state.frequency_hz,
                state.mode_shape * units.mode_shape,
                **{
                    key: getattr(state, key) * units.mode_shape
                    for key in FURTHER_SHAPES
                    if getattr(state, key) is not None
                },
                # Names of the other fields carry their unit: they are in SI already.
                tip_growth_m=state.tip_growth_m,
                untwist_rad=state.untwist_rad,
            )
            for state in blade.states
        ]
    return Blade(
        name or blade.name,
        blade.tip_nodes,
        blade.damping_ratio if damping_ratio is None else damping_ratio,
        states,
        blade.direction,
        blade.design_speed_hz,
        blade.mass_kg,
        blade.tip_radius_m,
        blade.tip_z_m,
        blade.material,
        blade.tip_theta_rad,
    )

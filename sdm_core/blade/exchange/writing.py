"""The front doors out: a `MatrixModel` or a `Blade` to a file of any format that holds it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sdm_core.blade.blade_file import write_blade
from sdm_core.blade.exchange.content import arrays_of_model
from sdm_core.blade.exchange.formats import MATRICES, MODAL, format_of
from sdm_core.blade.exchange.named_arrays.mat import write_mat
from sdm_core.blade.exchange.named_arrays.modal import arrays_of_blade
from sdm_core.blade.exchange.named_arrays.npz import write_npz_blade, write_npz_model
from sdm_core.blade.exchange.nastran.dmig import write_dmig
from sdm_core.blade.exchange.nastran.op4_write import write_op4
from sdm_core.blade.exchange.tables.matrices import NODES_M, SPEEDS, write_csv_matrix, write_dofs
from sdm_core.blade.exchange.tables.modal import write_csv_modal
from sdm_core.blade.exchange.tables.table import write_table
from sdm_core.blade.exchange.triplets.calculix import write_calculix
from sdm_core.blade.exchange.triplets.matrix_market import write_matrix_market
from sdm_core.blade.exchange.universal.write import write_universal
from sdm_core.blade.matrix_model import MatrixModel
from sdm_core.blade.modal import Blade
from sdm_core.whole_files import staged


@dataclass(frozen=True)
class Written:
    """What an export wrote.

    Parameters
    ----------
    paths
        The files, all of which reading them back needs.
    left_out
        What the format has no place for.
    digits
        Significant decimal digits of its numbers; 17 keep every bit.
    """

    paths: tuple[Path, ...]
    left_out: tuple[str, ...]
    digits: int


def write_model(model: MatrixModel, path: str | Path, *, format: str | None = None) -> Written:
    """Write a model in SI, in the format of the suffix or the given one.

    Formats of one matrix a file (``mtx``, ``csv``) give ``name.M.mtx``, ``name.K1.mtx``, ... and the
    companion tables ``name.dofs.csv``, ``name.nodes.csv``, ``name.speeds.csv``; CalculiX gives the files of
    its jobs. `reading.read_matrix_model` reads the paths back.

    Raises
    ------
    InvalidInput
        For a format that cannot hold the model, or a place that cannot be written.
    """
    path = Path(path)
    chosen = format_of(path, format, what=MATRICES, to_write=True)
    with staged(path) as beside:
        written, left_out = _write_model(model, beside, chosen.name)
    return Written(tuple(path.with_name(made.name) for made in written), left_out, chosen.digits)


def _write_model(model: MatrixModel, path: Path, name: str) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """The files of one format, and what they leave out."""
    moved = ("static_displacement",) if any(s.static_displacement is not None for s in model.states) else ()
    if name in ("op4", "op4-ascii"):
        write_op4(model, path, binary=name == "op4")
        return (path,), ("name",)
    if name in ("mat", "mat7.3"):
        write_mat(arrays_of_model(model), path, version="5" if name == "mat" else "7.3")
        return (path,), ("name",)
    if name == "npz":
        write_npz_model(model, path)
        return (path,), ()
    if name == "dmig":
        write_dmig(model, path)
        return (path,), ("name", *moved)
    left_out = ("name", *moved, "rotation_axis")
    if name != "calculix":
        return _one_matrix_a_file(model, path, name), left_out
    paths = write_calculix(model, path)
    table = path.with_suffix(".speeds.csv")
    files = [written.name for written in paths if written.suffix == ".sti"]
    speeds = [float(state.speed_hz) for state in model.states]
    write_table(table, SPEEDS, list(zip(speeds, files, strict=True)))
    return (*paths, table), left_out


def _one_matrix_a_file(model: MatrixModel, path: Path, name: str) -> tuple[Path, ...]:
    suffix = ".mtx" if name == "mtx" else ".csv"
    named = {"M": model.mass} | {f"K{i}": state.stiffness for i, state in enumerate(model.states, 1)}
    paths = []
    for key, matrix in named.items():
        target = path.with_suffix(f".{key}{suffix}")
        if name == "mtx":
            write_matrix_market(matrix, target, f"{key} of a blade, m, kg, s, N")
        else:
            write_csv_matrix(matrix, target)
        paths.append(target)
    dofs, nodes, speeds = (path.with_suffix(f".{what}.csv") for what in ("dofs", "nodes", "speeds"))
    write_dofs(model.dofs, dofs)
    write_table(speeds, SPEEDS, [(float(state.speed_hz), f"K{i}") for i, state in enumerate(model.states, 1)])
    paths += [dofs, speeds]
    if model.node_position_m:
        rows = [(node, *map(float, place)) for node, place in sorted(model.node_position_m.items())]
        write_table(nodes, NODES_M, rows)
        paths.append(nodes)
    return tuple(paths)


def export_blade(blade: Blade, path: str | Path, *, format: str | None = None) -> Written:
    """Write a blade's modal data, in the format of the suffix or the given one.

    Raises
    ------
    InvalidInput
        For a format that cannot hold it, or a place that cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from sdm_core.blade import example_blade
    >>> export_blade(example_blade("nasa_rotor_37"), Path(tempfile.mkdtemp()) / "r37.unv").digits
    13
    """
    path = Path(path)
    chosen = format_of(path, format, what=MODAL, to_write=True)
    left_out: tuple[str, ...] = ()
    with staged(path) as beside:
        if chosen.name == "json":
            write_blade(blade, beside)
        elif chosen.name == "npz":
            write_npz_blade(blade, beside)
        elif chosen.name in ("mat", "mat7.3"):
            version = "5" if chosen.name == "mat" else "7.3"
            write_mat({"blade": arrays_of_blade(blade)}, beside, version=version)
        elif chosen.name == "csv":
            write_csv_modal(blade, beside)
        else:
            left_out = write_universal(blade, beside)
    return Written((path,), left_out, chosen.digits)

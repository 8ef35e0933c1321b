"""NASA rotor 37 from its sections: mesh convergence, CalculiX on the same meshes, the whole chain's cost."""

from __future__ import annotations

import multiprocessing
import os
import re
import resource
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from rich.console import Group
from rich.progress import track
from rich.table import Table

from sdm_core.blade.build import BladeBuild, build_blade, solid_model
from sdm_core.blade.finite_elements import SolidModel, equilibrium
from sdm_core.blade.finite_elements.calculix_deck import calculix_deck
from sdm_core.blade.matrix_model import lowest_modes
from sdm_core.blade.profile import BladeProfile, read_sections
from sdm_core.blade.solid_mesh import Subdivision

# The sections are NASA's (TP 1659), and not part of this repository.
SECTIONS = Path(
    os.environ.get(
        "RUBSCREEN_ROTOR_37_SECTIONS", Path(__file__).parents[2] / "shared/data/nasa_rotor_37_sections.csv"
    )
)
FIGURE = Path("out/bench/rotor_37_mesh.png")
SPEED_HZ = 17_189 / 60
MESHES = ((6, 8, 1), (8, 12, 1), (12, 16, 1), (16, 22, 2), (24, 32, 2), (32, 44, 2))
REFERENCE = (24, 32, 2)  # 8,901 nodes, as the known figures
MODES = 5
KNOWN_HZ = {0.0: (906.0, 2563.0, 3270.0, 4941.0, 6051.0), SPEED_HZ: (1134.6, 2608.0, 3519.0, 5006.0, 6153.0)}


def table() -> Group:
    """Run everything and draw `FIGURE`."""
    sections = read_sections(SECTIONS)
    nodes, found = [], []
    theirs: dict[tuple[int, int, int], np.ndarray] = {}
    for mesh in track(MESHES, "meshes"):
        model = solid_model(_profile(sections, mesh))
        nodes.append(model.mesh.node_count)
        found.append([_frequencies(model, speed) for speed in KNOWN_HZ])
        if mesh == REFERENCE and shutil.which("ccx"):
            theirs[mesh] = np.array([_calculix(model, speed) for speed in KNOWN_HZ])
    ours = np.array(found)
    _draw(np.array(nodes), ours)
    parts = [_mesh_table(nodes, ours), _known_table(ours[MESHES.index(REFERENCE)], theirs.get(REFERENCE))]
    return Group(*parts, _chain_table())


def _profile(sections, mesh: tuple[int, int, int]) -> BladeProfile:
    return BladeProfile("nasa-rotor-37", sections, 17_188.7 / 60, subdivision=Subdivision(*mesh))


def _frequencies(model: SolidModel, speed_hz: float) -> np.ndarray:
    omega2, _ = lowest_modes(equilibrium(model, speed_hz).stiffness, model.mass, MODES)
    return np.sqrt(omega2) / (2 * np.pi)


def _calculix(model: SolidModel, speed_hz: float) -> np.ndarray:
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "blade.inp").write_text(calculix_deck(model, speed_hz, MODES))
        subprocess.run(["ccx", "blade"], cwd=folder, check=True, capture_output=True)
        text = Path(folder, "blade.dat").read_text()
    rows = re.findall(r"^ +\d+((?: +-?\d\.\d+E[+-]\d+){4})$", text, re.M)
    return np.array([float(row.split()[2]) for row in rows[:MODES]])


def _mesh_table(nodes: list[int], ours: np.ndarray) -> Table:
    out = Table(title="Rotor 37: frequencies against the finest mesh, %", title_justify="left")
    for heading in (
        "mesh",
        "nodes",
        *(f"{j + 1} rest" for j in range(MODES)),
        *(f"{j + 1} speed" for j in range(MODES)),
    ):
        out.add_column(heading, justify="right")
    for mesh, count, rows in zip(MESHES, nodes, ours, strict=True):
        off = 100 * (rows / ours[-1] - 1).ravel()
        out.add_row("×".join(map(str, mesh)), f"{count:,}", *(f"{value:+.3f}" for value in off))
    return out


def _known_table(ours: np.ndarray, theirs: np.ndarray | None) -> Table:
    out = Table(title=f"Mesh {REFERENCE}: against the known figures and CalculiX", title_justify="left")
    for heading in ("rpm", "mode", "Hz", "known", "off by", "CalculiX", "off by"):
        out.add_column(heading, justify="right")
    for i, (speed, known) in enumerate(KNOWN_HZ.items()):
        for j in range(MODES):
            beside = (
                ("not installed", "")
                if theirs is None
                else (f"{theirs[i, j]:.3f}", f"{100 * (ours[i, j] / theirs[i, j] - 1):+.6f} %")
            )
            out.add_row(
                f"{60 * speed:,.0f}",
                str(j + 1),
                f"{ours[i, j]:.3f}",
                f"{known[j]:g}",
                f"{100 * (ours[i, j] / known[j] - 1):+.2f} %",
                *beside,
            )
    return out


@dataclass(frozen=True)
class _Cost:
    build: BladeBuild
    seconds: float
    peak_gb: float


def _chain(mesh: tuple[int, int, int]) -> _Cost:
    started = time.perf_counter()
    made = build_blade(_profile(read_sections(SECTIONS), mesh))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return _Cost(made, time.perf_counter() - started, peak)


def _chain_table() -> Table:
    # In a process of its own, so that the peak of memory is the chain's.
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        cost = pool.apply(_chain, (REFERENCE,))
    build, check = cost.build, cost.build.check
    assert check is not None
    out = Table(title="Whole chain, sections to blade file", title_justify="left")
    for heading in (
        "nodes",
        "full",
        "reduced",
        "seconds",
        "peak GiB",
        "checked at Hz",
        "ω off by",
        "shapes off by",
    ):
        out.add_column(heading, justify="right")
    out.add_row(
        f"{build.mesh_nodes:,}",
        f"{build.full_size:,}",
        str(build.reduced_size),
        f"{cost.seconds:.1f}",
        f"{cost.peak_gb:.2f}",
        f"{check.speed_hz:.1f}",
        f"{100 * np.abs(check.frequency_error).max():.1g} %",
        f"{100 * check.shape_error.max():.1g} %",
    )
    return out


def _draw(nodes: np.ndarray, ours: np.ndarray) -> None:
    figure = Figure(figsize=(7.2, 4.4), dpi=200, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    marks = "os^Dv"
    for j in range(MODES):
        for i, style in enumerate(("-", "--")):
            off = 100 * np.abs(ours[:-1, i, j] / ours[-1, i, j] - 1)
            axes.loglog(
                nodes[:-1],
                off,
                style,
                marker=marks[j],
                ms=5,
                color=str(0.12 * j),
                lw=1,
                label=f"mode {j + 1}" + (" at 17,189 rpm" if i else " at rest"),
            )
    axes.set_xlabel("nodes of the mesh")
    axes.set_ylabel(f"frequency above that of {nodes[-1]:,} nodes [%]")
    axes.set_title("NASA rotor 37: mesh convergence", fontsize=11)
    axes.grid(True, which="both", lw=0.3, color="0.85")
    axes.legend(fontsize=8, ncols=2)
    FIGURE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(FIGURE)

"""The abradable liner in time: compiled beside plain numpy, threads beside processes, and the wear maps of [SBL] 5.1.

`make bench ARGS=liner`. The maps are kept as npz in `out/bench/liner`.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Group
from rich.table import Table

from sdm_core.blade import Blade, example_blade
from sdm_core.boundary import BoundarySolution, boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.parallel import available_cores, shared
from sdm_core.time_domain.liner import plain_revolution
from sdm_core.time_domain.liner.abradable_liner import AbradableLiner
from sdm_core.time_domain.liner.casing import Casing
from sdm_core.time_domain.liner.central_differences import CentralDifferences
from sdm_core.time_domain.liner.rub_history import RubHistory
from sdm_core.time_domain.liner.simulation import LinerRub, run_revolutions
from sdm_core.time_domain.liner.spectrum_map import SpectrumMap
from sdm_core.time_domain.liner.speed_sweep import SpeedSweep, sweep_speeds
from sdm_core.time_domain.liner.wear_map import WearMap

FOLDER = Path("out/bench/liner")
BLADES, EDGES = ("nasa_rotor_37", "generic_compressor_blade"), ("LE", "TE")
RATIOS = (0.05, 0.45)
SPEEDS, REVOLUTIONS, PLAIN_REVOLUTIONS = 200, 50, 2
# Assumed: E and σ_Y of the order of sprayed abradables, as [SBL]'s reference 3 has them in mind; the paper gives none.
YOUNGS_MODULUS_PA, YIELD_STRESS_PA, THICKNESS_M = 1.8e9, 15e6, 5e-3
# Assumed: a tip 1 mm thick whose edge node bears on a ninth of a chord of 30 mm.
CONTACT_LENGTH_M, AXIAL_WIDTH_M = 1e-3, 3.4e-3
# Assumed: casing that grows oval by 0.2 mm over five revolutions, 0.1 mm beyond what clearance there is.
OVALISATION_M, CLEARANCE_M, OVALISATION_REVOLUTIONS = 2e-4, 1e-4, 5.0
KE = (1.0e4, 2.5e4)
"""Middle and end of the paper's range; the plastic modulus follows from it."""


def liner(ke: float) -> AbradableLiner:
    """The assumed liner, cut with a given K_e."""
    section = CONTACT_LENGTH_M * AXIAL_WIDTH_M
    tangent = ke * THICKNESS_M / section
    plastic = tangent / (1 - tangent / YOUNGS_MODULUS_PA)
    return AbradableLiner(
        YOUNGS_MODULUS_PA, YIELD_STRESS_PA, plastic, THICKNESS_M, AXIAL_WIDTH_M, CONTACT_LENGTH_M
    )


def rub(blade: Blade, nodes: tuple[str, ...], ke: float) -> LinerRub:
    """One blade in the oval casing."""
    assert blade.tip_radius_m is not None
    casing = Casing(
        max(blade.tip_radius_m) + CLEARANCE_M,
        CLEARANCE_M,
        OVALISATION_M,
        2,
        OVALISATION_REVOLUTIONS,
    )
    return LinerRub(blade, nodes, liner(ke), casing)


def seconds_of_one_speed(nodes: tuple[str, ...]) -> tuple[float, float, RubHistory]:
    """50 revolutions compiled, and in plain numpy (from fewer of them), s, in one run."""
    problem, method = rub(example_blade("nasa_rotor_37"), nodes, KE[0]), CentralDifferences()
    speed = 0.3 * problem.blade.first_frequency_hz
    run_revolutions(problem, speed, 1, method)  # compiled and read from its cache
    fast = min(
        (run_revolutions(problem, speed, REVOLUTIONS, method) for _ in range(3)), key=lambda h: h.cost_s
    )
    slow = run_revolutions(problem, speed, PLAIN_REVOLUTIONS, method, kernel=plain_revolution.one_revolution)
    return fast.cost_s, slow.cost_s * REVOLUTIONS / PLAIN_REVOLUTIONS, fast


def _alone(speed: float, problem: LinerRub) -> np.ndarray:
    return run_revolutions(problem, speed, REVOLUTIONS, extrapolate=True).worn_m


def seconds_of_a_sweep(speeds: int = 24) -> dict[str, float]:
    """The same speeds in one thread, in threads and in processes (started before), s."""
    problem, cores = rub(example_blade("nasa_rotor_37"), ("LE",), KE[0]), available_cores()
    at = np.linspace(*RATIOS, speeds) * problem.blade.first_frequency_hz
    spent = {}
    for name, workers in (("one thread", 1), (f"{cores} threads", cores)):
        begun = time.perf_counter()
        sweep_speeds(problem, at, REVOLUTIONS, extrapolate=True, workers=workers)
        spent[name] = time.perf_counter() - begun
    work = partial(_alone, problem=problem)
    for name in (f"{cores} processes, started by it", f"{cores} processes, there already"):
        begun = time.perf_counter()
        for _ in shared(work, at.tolist(), cores):
            pass
        spent[name] = time.perf_counter() - begun
    return spent


@dataclass(frozen=True)
class EdgeMap:
    """Wear map of one edge of one blade, with what the delay equation says of it."""

    blade: str
    node: str
    ke: float
    sweep: SpeedSweep
    wear: WearMap
    exact: BoundarySolution

    @property
    def keep_under(self) -> str:
        return f"{self.blade}_{self.node}_{self.ke:g}"


def edge_map(name: str, node: str, ke: float, method: CentralDifferences | None = None) -> EdgeMap:
    """200 speeds, 50 revolutions each; the files are written too."""
    blade = example_blade(name)
    speed = np.linspace(*RATIOS, SPEEDS) * blade.first_frequency_hz
    method = CentralDifferences() if method is None else method
    # Modal data end at a speed ratio of 0.33 and 0.36; the paper's range goes on to 0.45.
    lines = np.linspace(0.0, 5.0 * blade.first_frequency_hz, 501)
    found = sweep_speeds(
        rub(blade, (node,), ke), speed, REVOLUTIONS, method, frequency_hz=lines, extrapolate=True
    )
    exact = boundary(blade, ContactConfiguration.at(node), speed, 1e6, extrapolate=True, truncation=False)
    made = EdgeMap(name, node, ke, found, WearMap.of_sweep(found), exact)
    FOLDER.mkdir(parents=True, exist_ok=True)
    made.wear.save(FOLDER / f"wear_{made.keep_under}.npz")
    SpectrumMap.of_sweep(found).save(FOLDER / f"spectrum_{made.keep_under}.npz")
    return made


def table() -> Group:
    """What `make bench ARGS=liner` prints."""
    return Group(_speed_table(), _sweep_table(), _map_table())


def _speed_table() -> Table:
    out = Table(
        title=f"{REVOLUTIONS} revolutions of NASA rotor 37 at one speed, {CentralDifferences().cells} cells"
    )
    for column in (
        "contact nodes",
        "steps a revolution",
        "compiled, s",
        "ns a step",
        "plain numpy, s",
        "ratio",
    ):
        out.add_column(column, justify="right")
    for nodes in (("LE",), example_blade("nasa_rotor_37").tip_nodes):
        fast, slow, found = seconds_of_one_speed(nodes)
        steps = found.steps_per_revolution
        each = fast / (steps * REVOLUTIONS) * 1e9
        out.add_row(
            str(len(nodes)), f"{steps}", f"{fast:.3f}", f"{each:.0f}", f"{slow:.1f}", f"{slow / fast:.0f}"
        )
    return out


def _sweep_table() -> Table:
    out = Table(title=f"24 speeds, {REVOLUTIONS} revolutions each")
    out.add_column("how")
    out.add_column("s", justify="right")
    for name, spent in seconds_of_a_sweep().items():
        out.add_row(name, f"{spent:.2f}")
    return out


def _map_table() -> Table:
    out = Table(
        title=f"Wear maps, {SPEEDS} speeds from {RATIOS[0]} to {RATIOS[1]} f1, {REVOLUTIONS} revolutions"
    )
    for column in (
        "blade",
        "edge",
        "K_e, N/m",
        "s",
        "deepest, µm: median",
        "largest",
        "at Ω/f1, lobes",
        "unevenness",
        "largest tip motion, µm",
        "delay equation: least K_e",
        "unstable speeds",
    ):
        out.add_column(column, justify="right")
    for name in BLADES:
        for ke in KE:
            for node in EDGES:
                made = edge_map(name, node, ke)
                deepest, critical = made.wear.deepest_m * 1e6, made.exact.critical_ke
                where = int(deepest.argmax())
                motion = max(float(r.peak_m.max()) for r in made.sweep.results)
                out.add_row(
                    name,
                    node,
                    f"{ke:g}",
                    f"{made.sweep.cost_s:.1f}",
                    f"{np.median(deepest):.0f}",
                    f"{deepest[where]:.0f}",
                    f"{made.wear.speed_ratio[where]:.3f}, {made.wear.lobes[where]}",
                    f"{made.wear.unevenness:.2f}",
                    f"{motion * 1e6:.0f}",
                    f"{np.nanmin(critical):.0f}",
                    f"{(critical < ke).mean():.0%}",
                )
    return out

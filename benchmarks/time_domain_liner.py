"""The abradable liner in time: compiled beside plain numpy, threads beside processes, wear maps ([SBL] 5.1).

`make bench ARGS=liner`. The maps are kept as npz in `out/bench/liner`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
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
from sdm_core.time_domain.liner import liner_kernel, plain_revolution
from sdm_core.time_domain.liner.abradable_liner import AbradableLiner
from sdm_core.time_domain.liner.casing import Casing
from sdm_core.time_domain.liner.central_differences import CentralDifferences
from sdm_core.time_domain.liner.liner_rub import LinerRub
from sdm_core.time_domain.liner.simulation import Kernel, run_revolutions
from sdm_core.time_domain.liner.spectrum_map import SpectrumMap
from sdm_core.time_domain.liner.speed_sweep import SpeedSweep, sweep_speeds
from sdm_core.time_domain.liner.wear_map import WearMap

FOLDER = Path("out/bench/liner")
BLADES = ("nasa_rotor_37", "generic_compressor_blade")
CONTACTS = (("LE",), ("TE",), ("LE", "TE"))
RATIOS = (0.05, 0.45)
SPEEDS, REVOLUTIONS, PLAIN_REVOLUTIONS = 200, 50, 2
# All assumed, since [SBL] gives none: E and σ_Y of the order of a sprayed metal abradable,
YOUNGS_MODULUS_PA, YIELD_STRESS_PA, THICKNESS_M = 1.8e9, 15e6, 5e-3
# a tip 1 mm thick whose edge node bears on a ninth of a chord of 30 mm.
CONTACT_LENGTH_M, AXIAL_WIDTH_M = 1e-3, 3.4e-3
# and a casing that grows oval by 0.2 mm in five revolutions, 0.1 mm beyond the clearance.
OVALISATION_M, CLEARANCE_M, OVALISATION_REVOLUTIONS = 2e-4, 1e-4, 5.0
MAP_CELLS, MAP_ANGLES, REPEATS = 4000, 1000, 3
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


def seconds_of_one_speed(nodes: tuple[str, ...]) -> tuple[float, float, int]:
    """50 revolutions compiled, and in plain numpy (from fewer of them), in one run; steps a revolution.

    Seconds of processor time, which a busy machine changes little.
    """
    problem, method = rub(example_blade("nasa_rotor_37"), nodes, KE[0]), CentralDifferences()
    speed = 0.3 * problem.blade.first_frequency_hz
    steps = run_revolutions(
        problem, speed, 1, method
    ).steps_per_revolution  # compiled, or read from its cache

    def spent(revolutions: int, kernel: Kernel) -> float:
        begun = time.process_time()
        run_revolutions(problem, speed, revolutions, method, kernel=kernel)
        return time.process_time() - begun

    fast = min(spent(REVOLUTIONS, liner_kernel.one_revolution) for _ in range(REPEATS))
    slow = spent(PLAIN_REVOLUTIONS, plain_revolution.one_revolution)
    return fast, slow * REVOLUTIONS / PLAIN_REVOLUTIONS, steps


def _alone(speed: float, problem: LinerRub) -> np.ndarray:
    return run_revolutions(problem, speed, REVOLUTIONS, extrapolate=True).worn_m


def seconds_of_a_sweep(speeds: int = 24) -> dict[str, float]:
    """The same speeds in one thread, in threads and in processes (started before), s."""
    problem, cores = rub(example_blade("nasa_rotor_37"), ("LE",), KE[0]), available_cores()
    at = np.linspace(*RATIOS, speeds) * problem.blade.first_frequency_hz
    work = partial(_alone, problem=problem)

    def threads(workers: int) -> None:
        sweep_speeds(problem, at, REVOLUTIONS, extrapolate=True, workers=workers)

    def processes() -> None:
        for _ in shared(work, at.tolist(), cores):
            pass

    spent = {f"{cores} processes, started by it": _best(processes, 1)}
    spent[f"{cores} processes, there already"] = _best(processes)
    spent["one thread"] = _best(partial(threads, 1))
    spent[f"{cores} threads"] = _best(partial(threads, cores))
    return spent


def _best(work: Callable[[], None], repeats: int = REPEATS) -> float:
    spent = np.inf
    for _ in range(repeats):
        begun = time.perf_counter()
        work()
        spent = min(spent, time.perf_counter() - begun)
    return float(spent)


@dataclass(frozen=True)
class EdgeMap:
    """Wear map under the first contact node of one blade, with what the delay equation says of it."""

    blade: str
    nodes: tuple[str, ...]
    ke: float
    sweep: SpeedSweep
    wear: WearMap
    exact: BoundarySolution
    processor_s: float

    @property
    def keep_under(self) -> str:
        return f"{self.blade}_{'+'.join(self.nodes)}_{self.ke:g}"


def edge_map(name: str, nodes: tuple[str, ...], ke: float) -> EdgeMap:
    """200 speeds, 50 revolutions each; the files are written too."""
    blade = example_blade(name)
    speed = np.linspace(*RATIOS, SPEEDS) * blade.first_frequency_hz
    lines = np.linspace(0.0, 5.0 * blade.first_frequency_hz, 501)
    begun = time.process_time()
    # Modal data end at a speed ratio of 0.33 and 0.36; the paper's range goes on to 0.45.
    found = sweep_speeds(
        rub(blade, nodes, ke),
        speed,
        REVOLUTIONS,
        CentralDifferences(MAP_CELLS),
        frequency_hz=lines,
        extrapolate=True,
    )
    processor_s = time.process_time() - begun
    contact = ContactConfiguration.at(*nodes)
    exact = boundary(blade, contact, speed, 1e6, extrapolate=True, truncation=False)
    made = EdgeMap(name, nodes, ke, found, WearMap.of_sweep(found, angles=MAP_ANGLES), exact, processor_s)
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
        fast, slow, steps = seconds_of_one_speed(nodes)
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
        "of processors",
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
            for nodes in CONTACTS:
                made = edge_map(name, nodes, ke)
                deepest, critical = made.wear.deepest_m * 1e6, made.exact.critical_ke
                where = int(deepest.argmax())
                motion = max(float(r.peak_m.max()) for r in made.sweep.results)
                out.add_row(
                    name,
                    "+".join(nodes),
                    f"{ke:g}",
                    f"{made.sweep.cost_s:.1f}",
                    f"{made.processor_s:.1f}",
                    f"{np.median(deepest):.0f}",
                    f"{deepest[where]:.0f}",
                    f"{made.wear.speed_ratio[where]:.3f}, {made.wear.lobes[where]}",
                    f"{made.wear.unevenness:.2f}",
                    f"{motion * 1e6:.0f}",
                    f"{np.nanmin(critical):.0f}",
                    f"{(critical < ke).mean():.0%}",
                )
    return out

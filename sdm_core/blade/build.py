"""From a profile to the blade file: mesh, equilibrium at speed, reduction, modes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sdm_core.blade.component_modes import CraigBampton
from sdm_core.blade.finite_elements.equilibrium import Equilibrium, equilibrium
from sdm_core.blade.finite_elements.solid_model import SolidModel
from sdm_core.blade.matrix_model import MatrixModel, lowest_modes
from sdm_core.blade.modal import Blade
from sdm_core.blade.profile.blade_profile import MOST_STATES, BladeProfile
from sdm_core.blade.profile.sections import SectionTable
from sdm_core.blade.solid_mesh import SolidMesh
from sdm_core.blade.tip_line import TipLine
from sdm_core.errors import ModesNotTracked
from sdm_core.interruption import checkpoint

# Share of the work done, 0 to 1, and what is being done. An exception raised here stops the build.
Progress = Callable[[float, str], None]
# Free modes kept beyond those asked for: the last of a Lanczos run are needed for tracking, not kept.
_SPARE_MODES = 3
# Of the interpolated modes against the full model's: K_e goes with the square of the amplitudes.
FREQUENCY_TOLERANCE = 1e-3
SHAPE_TOLERANCE = 1e-2


@dataclass(frozen=True)
class ReductionCheck:
    """Reduced against full model at a speed between those of the states.

    Attributes
    ----------
    speed_hz
        Hz.
    full_frequency_hz, reduced_frequency_hz
        Natural frequencies, Hz, shape (n,).
    shape_error
        Largest difference of each mode's tip amplitudes over its largest, shape (n,).
    """

    speed_hz: float
    full_frequency_hz: np.ndarray
    reduced_frequency_hz: np.ndarray
    shape_error: np.ndarray

    @property
    def frequency_error(self) -> np.ndarray:
        """Relative, shape (n,)."""
        return self.reduced_frequency_hz / self.full_frequency_hz - 1.0

    @property
    def holds(self) -> bool:
        """True where frequencies and tip shapes are within `FREQUENCY_TOLERANCE` and `SHAPE_TOLERANCE`."""
        frequencies = np.abs(self.frequency_error).max() <= FREQUENCY_TOLERANCE
        return bool(frequencies and self.shape_error.max() <= SHAPE_TOLERANCE)


@dataclass(frozen=True)
class BladeBuild:
    """A blade built from its profile.

    Attributes
    ----------
    blade
        The blade file's content.
    reduced
        The reduced model its modes come from.
    tip
        The contact nodes, by their numbers in the reduced model, and their directions.
    check
        Reduced against full at a speed between; None where it was not asked for, or there is one state.
    mesh_nodes, full_size, reduced_size
        Nodes of the mesh; degrees of freedom of the full and the reduced model.
    seconds
        What it took.
    """

    blade: Blade
    reduced: MatrixModel
    tip: TipLine
    check: ReductionCheck | None
    mesh_nodes: int
    full_size: int
    reduced_size: int
    seconds: float


def build_blade(
    profile: BladeProfile, *, verify: bool = True, progress: Progress = lambda done, what: None
) -> BladeBuild:
    """Mesh a profile, find its equilibria, reduce it and take the modes at the tip.

    Where modes cannot be followed from one rotor speed to the next, or the interpolated ones are off
    the full model's by more than `FREQUENCY_TOLERANCE` or `SHAPE_TOLERANCE`, states are added between,
    up to `MOST_STATES`.

    Parameters
    ----------
    verify
        Compare the interpolated modes with the full model's at a speed between the states': costs
        about a third more.
    progress
        Told what is going on.

    Raises
    ------
    InvalidInput
        For a shape that cannot be meshed (`InvertedElements`, naming the place), a blade without
        equilibrium at its speed (`NoEquilibrium`), or modes that cannot be followed.
    """
    started = time.perf_counter()
    steps = _Steps(progress, 3 * len(profile.state_speeds_hz) + 2 + 2 * verify)
    steps.next("sections and mesh")
    model = solid_model(profile)
    on_mesh = profile.tip.on(model.mesh, _suction_side(profile.sections()), profile.casing_slope)
    tip = TipLine(
        on_mesh.names, [n + 1 for n in on_mesh.nodes], on_mesh.contact_directions, on_mesh.direction
    )
    reduction = CraigBampton(free_modes=profile.modes + _SPARE_MODES)
    known: dict[float, Equilibrium] = {}
    speeds, check = list(profile.state_speeds_hz), None
    while True:
        equilibria = _equilibria(model, speeds, known, steps)
        reduced = reduction.reduce(profile.name, model, on_mesh.nodes, equilibria, steps.next)
        steps.next("modes at the tip")
        try:
            blade = reduced.to_blade(
                tip,
                damping_ratio=profile.damping_ratio,
                modes=profile.modes,
                design_speed_hz=profile.design_speed_hz,
                mass_kg=model.total_mass_kg,
                material=profile.material.to_dict(),
            )
        except ModesNotTracked as error:
            if 2 * len(speeds) - 1 > MOST_STATES:
                raise ModesNotTracked(
                    "speeds_hz",
                    error.value,
                    f"{error.remedy} (speeds_hz of the profile), or ask for fewer modes",
                ) from None
            speeds = sorted({*speeds, *(_between(a, b) for a, b in pairwise(speeds))})
            steps.add(3 * (len(speeds) - len(equilibria)))
            continue
        if not verify or len(speeds) < 2:
            break
        check, between = _check(model, blade, on_mesh, equilibria, steps)
        if check.holds or len(speeds) == MOST_STATES:
            break
        known[between.speed_hz] = between
        speeds = sorted({*speeds, between.speed_hz})
        steps.add(3 * len(speeds))
    progress(1.0, "done")
    return BladeBuild(
        blade,
        reduced,
        tip,
        check,
        model.mesh.node_count,
        model.size,
        len(reduced.dofs),
        time.perf_counter() - started,
    )


def _equilibria(
    model: SolidModel, speeds: list[float], known: dict[float, Equilibrium], steps: _Steps
) -> list[Equilibrium]:
    """At every speed, those found before taken from `known` and the others added to it."""
    for speed in speeds:
        if speed not in known:
            steps.next(f"equilibrium at {speed:.4g} Hz")
            slower = [known[s] for s in sorted(known) if s < speed]
            known[speed] = equilibrium(model, speed, slower[-1] if slower else None, steps.say)
    return [known[speed] for speed in speeds]


def solid_model(profile: BladeProfile) -> SolidModel:
    """The finite-element model of a profile.

    Raises
    ------
    InvertedElements
        Naming the place.
    """
    solid = profile.sections().solid(profile.cut)
    return SolidModel(SolidMesh.of(solid.positions, profile.subdivision), profile.material)


def _check(
    model: SolidModel, blade: Blade, tip: TipLine, equilibria: list[Equilibrium], steps: _Steps
) -> tuple[ReductionCheck, Equilibrium]:
    widest = int(np.argmax(np.diff([each.speed_hz**2 for each in equilibria])))
    speed = _between(equilibria[widest].speed_hz, equilibria[widest + 1].speed_hz)
    steps.next(f"full model at {speed:.4g} Hz, to check the reduced one")
    between = equilibrium(model, speed, equilibria[widest + 1], steps.say)
    steps.next(f"modes of the full model at {speed:.4g} Hz")
    omega2, shape = lowest_modes(between.stiffness, model.mass, blade.mode_count + _SPARE_MODES)
    at_tip = np.einsum(
        "rxn,rx->nr", shape[model.rows(np.array(tip.nodes))], np.asarray(tip.contact_directions)
    )
    reduced = blade.at_speed(speed)
    frequency = np.sqrt(omega2) / (2 * np.pi)
    # The blade's modes are in the order of the first state: each is compared with the nearest here.
    nearest = np.argmin(np.abs(frequency[None, :] / reduced.frequency_hz[:, None] - 1.0), axis=1)
    full = at_tip[nearest]
    sign = np.sign(np.einsum("nr,nr->n", full, reduced.mode_shape))
    error = np.abs(full * sign[:, None] - reduced.mode_shape).max(axis=1) / np.abs(full).max(axis=1)
    return ReductionCheck(speed, frequency[nearest], reduced.frequency_hz, error), between


def _between(low_hz: float, high_hz: float) -> float:
    """The middle in Ω², where an interpolant in Ω² errs most."""
    return float(np.sqrt(0.5 * (low_hz**2 + high_hz**2)))


def _suction_side(table: SectionTable) -> int:
    """+1 where the camber bulges towards the second side, −1 where towards the first."""
    bulge = 0.0
    for side in table.sides:
        middle = side.mean(axis=0)
        fraction = (middle[:, 0] - middle[0, 0]) / (middle[-1, 0] - middle[0, 0] or 1.0)
        chord = middle[0, 2] + fraction * (middle[-1, 2] - middle[0, 2])
        bulge += float((middle[:, 2] - chord).mean() * (side[1, :, 2] - side[0, :, 2]).mean())
    return -1 if bulge < 0 else 1


class _Steps:
    """Counts the steps of a build and says which one it is at."""

    def __init__(self, progress: Progress, total: int) -> None:
        self._progress, self._total, self._done, self._what = progress, total, -1, ""
        self._shown = 0.0

    def add(self, steps: int) -> None:
        """More is to be done than was thought."""
        self._total += steps

    def next(self, what: str) -> None:
        checkpoint()
        self._done, self._what = self._done + 1, what
        self._tell(what)

    def say(self, detail: str) -> None:
        checkpoint()
        self._tell(f"{self._what}: {detail}")

    def _tell(self, what: str) -> None:
        self._shown = max(self._shown, min(self._done / self._total, 0.99))
        self._progress(self._shown, what)

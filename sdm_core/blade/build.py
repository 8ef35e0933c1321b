"""From a profile to the blade file: mesh, equilibrium at speed, reduction, modes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sdm_core.blade.component_modes import CraigBampton
from sdm_core.blade.finite_elements.equilibrium import Equilibrium, equilibrium
from sdm_core.blade.finite_elements.solid_model import SolidModel
from sdm_core.blade.matrix_model import MatrixModel, lowest_modes
from sdm_core.blade.modal import Blade
from sdm_core.blade.profile.blade_profile import BladeProfile
from sdm_core.blade.profile.sections import SectionTable
from sdm_core.blade.solid_mesh import SolidMesh
from sdm_core.blade.tip_line import TipLine

# Share of the work done, 0 to 1, and what is being done. An exception raised here stops the build.
Progress = Callable[[float, str], None]
# Free modes kept beyond those asked for: the last of a Lanczos run are needed for tracking, not kept.
_SPARE_MODES = 3


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
    speeds = profile.state_speeds_hz
    steps = _Steps(progress, len(speeds) + len(speeds) + len(speeds) + 2 + 2 * verify)
    steps.next("sections and mesh")
    table = profile.sections()
    mesh = SolidMesh.of(table.solid(profile.cut).positions, profile.subdivision)
    model = SolidModel(mesh, profile.material)
    on_mesh = profile.tip.on(mesh, _suction_side(table), profile.casing_slope)
    equilibria: list[Equilibrium] = []
    for speed in speeds:
        steps.next(f"equilibrium at {speed:.4g} Hz")
        equilibria.append(equilibrium(model, speed, equilibria[-1] if equilibria else None, steps.say))
    reduction = CraigBampton(free_modes=profile.modes + _SPARE_MODES)
    reduced = reduction.reduce(profile.name, model, on_mesh.nodes, equilibria, steps.next)
    tip = TipLine(
        on_mesh.names, [n + 1 for n in on_mesh.nodes], on_mesh.contact_directions, on_mesh.direction
    )
    steps.next("modes at the tip")
    blade = reduced.to_blade(
        tip,
        damping_ratio=profile.damping_ratio,
        modes=profile.modes,
        design_speed_hz=profile.design_speed_hz,
        mass_kg=model.total_mass_kg,
        material=profile.material.to_dict(),
    )
    check = _check(model, blade, on_mesh, equilibria, steps) if verify and len(speeds) > 1 else None
    progress(1.0, "done")
    return BladeBuild(
        blade,
        reduced,
        tip,
        check,
        mesh.node_count,
        model.size,
        len(reduced.dofs),
        time.perf_counter() - started,
    )


def _check(
    model: SolidModel, blade: Blade, tip: TipLine, equilibria: list[Equilibrium], steps: _Steps
) -> ReductionCheck:
    squares = np.array([each.speed_hz**2 for each in equilibria])
    widest = int(np.argmax(np.diff(squares)))
    # In the middle of the widest gap in Ω², where an interpolant in Ω² errs most.
    speed = float(np.sqrt(0.5 * (squares[widest] + squares[widest + 1])))
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
    return ReductionCheck(speed, frequency[nearest], reduced.frequency_hz, error)


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

    def next(self, what: str) -> None:
        self._done, self._what = self._done + 1, what
        self._progress(min(self._done / self._total, 1.0), what)

    def say(self, detail: str) -> None:
        self._progress(min(self._done / self._total, 1.0), f"{self._what}: {detail}")

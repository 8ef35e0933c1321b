"""The front door: a blade that rubs its liner at one rotor speed, revolution by revolution."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sdm_core.blade import Blade
from sdm_core.errors import InvalidInput, LinerWornThrough, NotConverged
from sdm_core.interruption import checkpoint
from sdm_core.time_domain.liner import liner_kernel
from sdm_core.time_domain.liner.abradable_liner import AbradableLiner, Bars, Friction
from sdm_core.time_domain.liner.casing import Casing
from sdm_core.time_domain.liner.central_differences import CentralDifferences, Scheme
from sdm_core.time_domain.liner.energy import EnergyAccount, scheme_energy
from sdm_core.time_domain.liner.liner_kernel import Motion, Samples, Tip
from sdm_core.time_domain.liner.rub_history import RubHistory
from sdm_core.time_domain.liner.tip_modes import TipModes
from sdm_core.validation import SPEED_LIMITS_HZ, number, vector

MOST_REVOLUTIONS = 1_000_000

Progress = Callable[[int, int], None]
Kernel = Callable[[Motion, np.ndarray, Tip, Bars, bool, Scheme, Samples], tuple[int, int, int, int]]


@dataclass(frozen=True)
class LinerRub:
    """The problem: a blade whose tip may touch an abradable liner.

        ẍ + 2ξΛẋ + Λ²x = −V_c F − V_t F_t,    u = V_cᵀx,

    with the forces F ≥ 0 of the liner's bars on the contact nodes, which push the tip inwards, and friction
    F_t = ±μF against the direction in which the tip slides.

    Parameters
    ----------
    blade
        Modal data; its direction of contact is the one that counts.
    nodes
        Names of the tip nodes that can touch.
    liner, casing
        What they touch.
    friction
        None leaves it out.

    Raises
    ------
    InvalidInput
        For a node the blade has not got, and for clearances or widths of another number than nodes.
    """

    blade: Blade
    nodes: tuple[str, ...]
    liner: AbradableLiner
    casing: Casing
    friction: Friction | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.blade, Blade):
            raise InvalidInput("blade", type(self.blade).__name__, "give a Blade, e.g. read_blade(path)")
        if not isinstance(self.nodes, list | tuple) or len(self.nodes) == 0:
            raise InvalidInput("nodes", self.nodes, "name at least one tip node that can touch")
        object.__setattr__(self, "nodes", tuple(self.nodes))
        for i, node in enumerate(self.nodes):
            if node not in self.blade.tip_nodes or node in self.nodes[:i]:
                known = ", ".join(self.blade.tip_nodes)
                raise InvalidInput(f"nodes[{i}]", node, f"name each tip node once, of {known}")
        self.casing.clearances(len(self.nodes))
        self.liner.widths(len(self.nodes))
        if self.friction is not None and any(s.mode_shape_tangential is None for s in self.blade.states):
            TipModes.of_blade(self.blade, self.nodes, self.blade.states[0].speed_hz, tangential=True)

    def modes(self, speed_hz: float, *, extrapolate: bool = False) -> TipModes:
        """The blade's modal data at a rotor speed."""
        number("speed_hz", speed_hz, *SPEED_LIMITS_HZ, "Hz")
        return TipModes.of_blade(
            self.blade,
            self.nodes,
            speed_hz,
            tangential=self.friction is not None,
            extrapolate=extrapolate,
        )

    def bars(self, cells: int) -> Bars:
        """The bars under the contact nodes."""
        return self.liner.bars(len(self.nodes), 2 * np.pi * self.casing.radius_m / cells)

    def cutting_stiffness(self, cells: int) -> np.ndarray:
        """K_e of each contact node, N/m, shape (r,)."""
        return self.liner.cutting_stiffness(self.bars(cells))


@dataclass(frozen=True)
class InitialMotion:
    """Modal displacement (kg^½ m) and velocity (kg^½ m/s) at t = 0, each of shape (n,)."""

    displacement: np.ndarray
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def checked(self, modes: int) -> tuple[np.ndarray, np.ndarray]:
        """Both, of `modes` numbers; an empty velocity is zero."""
        put = vector("initial.displacement", self.displacement, -1e6, 1e6, "kg^1/2 m")
        moving: Any = self.velocity if len(self.velocity) else np.zeros(modes)
        pushed = vector("initial.velocity", moving, -1e9, 1e9, "kg^1/2 m/s")
        for name, values in (("displacement", put), ("velocity", pushed)):
            if len(values) != modes:
                raise InvalidInput(
                    f"initial.{name}", f"{len(values)} numbers", f"give one number a mode: {modes}"
                )
        return put, pushed


def simulate_rub(
    rub: LinerRub,
    speed_hz: float,
    revolutions: int = 50,
    method: CentralDifferences | None = None,
    *,
    initial: InitialMotion | None = None,
    extrapolate: bool = False,
    progress: Progress | None = None,
) -> RubHistory:
    """Motion of the tip and wear of the liner over a number of revolutions.

    Parameters
    ----------
    speed_hz
        Ω, Hz.
    initial
        Motion at the start; at rest where left out.
    extrapolate
        Allow a speed outside the range of the blade's states.
    progress
        Called with revolutions done and their number.

    Raises
    ------
    InvalidInput
        For unusable numbers, among them steps too long to be stable.
    LinerWornThrough
        When the wear reaches the thickness of the liner.
    NotConverged
        When the forces of several nodes do not agree.
    Cancelled
        Or whatever the surrounding `interruptible` block raises, between two revolutions.

    Examples
    --------
    >>> from sdm_core.blade import example_blade
    >>> rub = LinerRub(
    ...     example_blade("nasa_rotor_37"),
    ...     ("LE",),
    ...     AbradableLiner.from_cutting_stiffness(1e4),
    ...     Casing(0.252, 1e-4, ovalisation_m=2e-4, ovalisation_revolutions=5),
    ... )
    >>> found = simulate_rub(rub, 250.0, 8, CentralDifferences(cells=500))
    >>> bool(found.worn_m.max() > 5e-5)
    True
    """
    history = run_revolutions(
        rub, speed_hz, revolutions, method, initial=initial, extrapolate=extrapolate, progress=progress
    )
    if history.worn_through is not None:
        node, angle = history.worn_through
        raise LinerWornThrough(
            "liner.thickness_m",
            rub.liner.thickness_m,
            f"worn through at {speed_hz:g} Hz under node {node} at {np.degrees(angle):.1f} degrees in "
            f"revolution {len(history.worn_volume_m3)}: take a thicker liner, or less feed or "
            "ovalisation, or fewer revolutions",
        )
    return history


def run_revolutions(
    rub: LinerRub,
    speed_hz: float,
    revolutions: int,
    method: CentralDifferences | None = None,
    *,
    initial: InitialMotion | None = None,
    extrapolate: bool = False,
    progress: Progress | None = None,
    kernel: Kernel = liner_kernel.one_revolution,
) -> RubHistory:
    """As `simulate_rub`, but a liner worn through is part of the answer, up to where it happened."""
    begun = time.perf_counter()
    if isinstance(revolutions, bool) or not isinstance(revolutions, int | np.integer):
        raise InvalidInput("revolutions", revolutions, "give a whole number")
    number("revolutions", int(revolutions), 1, MOST_REVOLUTIONS, "")
    method = CentralDifferences() if method is None else method
    modes = rub.modes(speed_hz, extrapolate=extrapolate)
    bars = rub.bars(method.cells)
    scheme = method.scheme(modes, bars, speed_hz)
    motion = _start(modes, scheme, initial, method.cells)
    tip = _tip(rub, modes, scheme, speed_hz)
    every = method.steps_per_sample(scheme)
    many = method.cells * scheme.steps_per_cell // every
    start_j = scheme_energy(motion.now, motion.before, modes.omega, scheme.step)
    strip = rub.liner.widths(len(rub.nodes)) * 2 * np.pi * rub.casing.radius_m / method.cells
    kept, energy, work, volume = [], [], [], []
    worn_through, most_rounds = None, 0
    for revolution in range(revolutions):
        checkpoint()
        gap = rub.casing.gap(len(rub.nodes), method.cells, revolution)
        samples = Samples(
            every,
            np.zeros((many, len(modes.omega))),
            np.zeros((many, len(modes.omega))),
            np.zeros((many, len(rub.nodes))),
        )
        ended, node, cell, rounds = kernel(
            motion, gap, tip, bars, rub.liner.hardening_restarts, scheme, samples
        )
        if ended == liner_kernel.NOT_CONVERGED:
            raise NotConverged(
                f"contact forces at {speed_hz:g} Hz did not agree in {rounds} rounds: take more "
                "steps_per_cell"
            )
        most_rounds = max(most_rounds, rounds)
        kept.append(samples)
        energy.append(scheme_energy(motion.now, motion.before, modes.omega, scheme.step))
        work.append(motion.work.copy())
        volume.append(float(strip @ motion.worn.sum(axis=1)))
        if progress is not None:
            progress(revolution + 1, revolutions)
        if ended == liner_kernel.WORN_THROUGH:
            worn_through = (rub.nodes[node], 2 * np.pi * cell / method.cells)
            break
    position = np.concatenate([s.position for s in kept])
    velocity = np.concatenate([s.velocity for s in kept])
    damping, contact, friction = np.array(work).T
    return RubHistory(
        speed_hz=float(speed_hz),
        tip_nodes=rub.blade.tip_nodes,
        contact_nodes=rub.nodes,
        time_s=np.arange(len(position)) * every * scheme.step,
        position=position,
        velocity=velocity,
        omega=modes.omega,
        shape=modes.observed,
        force_n=np.concatenate([s.force for s in kept]),
        peak_m=motion.peak,
        worn_m=motion.worn,
        worn_volume_m3=np.array(volume),
        energy=EnergyAccount(start_j, np.array(energy), damping, contact, friction),
        feed_per_revolution_m=rub.casing.feed_per_revolution_m,
        ovalisation=rub.casing.lobes if rub.casing.ovalisation_m > 0 else 0,
        cutting_stiffness=rub.liner.cutting_stiffness(bars),
        cell_damping_ratio=method.cell_damping_ratio(modes, bars, scheme),
        steps_per_revolution=method.cells * scheme.steps_per_cell,
        samples_per_revolution=many,
        correction_rounds=most_rounds,
        worn_through=worn_through,
        cost_s=time.perf_counter() - begun,
    )


def _start(modes: TipModes, scheme: Scheme, initial: InitialMotion | None, cells: int) -> Motion:
    many, nodes = len(modes.omega), modes.contact.shape[1]
    now, before = np.zeros(many), np.zeros(many)
    if initial is not None:
        put, pushed = initial.checked(many)
        pull = -2 * modes.damping_ratio * modes.omega * pushed - modes.omega**2 * put
        now, before = np.array(put), put - scheme.step * pushed + 0.5 * scheme.step**2 * pull
    return Motion(
        now,
        before,
        np.zeros((nodes, cells)),
        np.zeros((2, nodes)),
        np.zeros((2, nodes)),
        np.zeros(nodes),
        np.zeros(3),
        np.abs(now @ modes.observed),
    )


def _tip(rub: LinerRub, modes: TipModes, scheme: Scheme, speed_hz: float) -> Tip:
    mu = 0.0 if rub.friction is None else rub.friction.coefficient
    turn = 1 if rub.friction is None else rub.friction.rotation
    pushed = modes.contact.T * scheme.push / 2
    return Tip(
        modes.observed,
        modes.contact,
        modes.tangential,
        pushed @ modes.contact,
        mu * (pushed @ modes.tangential),
        mu,
        turn * 2 * np.pi * speed_hz * rub.casing.radius_m,
    )

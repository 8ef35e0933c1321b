"""The front door: a blade that rubs its liner at one rotor speed, revolution by revolution."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from sdm_core.errors import InvalidInput, LinerWornThrough, NotConverged
from sdm_core.interruption import checkpoint
from sdm_core.time_domain.liner import liner_kernel
from sdm_core.time_domain.liner.abradable_liner import Bars
from sdm_core.time_domain.liner.central_differences import CentralDifferences, Scheme
from sdm_core.time_domain.liner.energy import EnergyAccount, scheme_energy
from sdm_core.time_domain.liner.liner_kernel import Motion, Samples, Tip
from sdm_core.time_domain.liner.liner_rub import InitialMotion, LinerRub
from sdm_core.time_domain.liner.rub_history import RubHistory
from sdm_core.time_domain.liner.tip_modes import TipModes
from sdm_core.validation import number

MOST_REVOLUTIONS = 1_000_000

Progress = Callable[[int, int], None]
Kernel = Callable[[Motion, np.ndarray, Tip, Bars, bool, Scheme, Samples], tuple[int, int, int, int]]


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
    >>> from sdm_core.time_domain.liner.abradable_liner import AbradableLiner
    >>> from sdm_core.time_domain.liner.casing import Casing
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

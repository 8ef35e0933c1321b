"""One revolution of a blade that rubs a liner of plastic bars, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sdm_core.time_domain.compiled import compiled
from sdm_core.time_domain.liner.abradable_liner import Bars
from sdm_core.time_domain.liner.central_differences import Scheme

DONE, WORN_THROUGH, NOT_CONVERGED = 0, 1, 2
MOST_ROUNDS = 500
CORRECTION_ACCURACY = 1e-13
"""Change of the forces in the last round of the correction, relative to the largest."""


class Motion(NamedTuple):
    """The state, changed in place.

    Attributes
    ----------
    now, before
        Modal coordinates at the last two instants, kg^½ m, each of shape (n,).
    worn
        Depth removed under each contact node in each cell, m, shape (r, cells).
    force, sliding
        Contact and friction forces (towards negative tangential) at the last instant and, in the second row,
        the one before, N, each of shape (2, r).
    impulse
        Sum of the contact forces of all steps since the last sample, N, shape (r,).
    work
        Done on the blade so far by damping, contact and friction, J, shape (3,).
    peak
        Largest |displacement| of each tip node, m, shape (R,).
    """

    now: np.ndarray
    before: np.ndarray
    worn: np.ndarray
    force: np.ndarray
    sliding: np.ndarray
    impulse: np.ndarray
    work: np.ndarray
    peak: np.ndarray


class Tip(NamedTuple):
    """The blade's tip and what it slides on.

    Attributes
    ----------
    observed, contact, tangential
        As in `TipModes`.
    compliance, sideways
        V_cᵀ diag(push) V_c / 2 and μ V_cᵀ diag(push) V_t / 2: displacement in a step per force at its end,
        m/N, each of shape (r, r).
    friction
        μ.
    rim_speed
        Towards positive tangential, m/s.
    """

    observed: np.ndarray
    contact: np.ndarray
    tangential: np.ndarray
    compliance: np.ndarray
    sideways: np.ndarray
    friction: float
    rim_speed: float


class Samples(NamedTuple):
    """What is kept of a revolution: a row every `every` steps.

    Attributes
    ----------
    every
        Steps from sample to sample.
    position, velocity
        Modal, shape (samples, n).
    force
        Contact force, the mean since the sample before, N, shape (samples, r).
    """

    every: int
    position: np.ndarray
    velocity: np.ndarray
    force: np.ndarray


@compiled
def bar_force(
    shortening: float,
    compliance: float,
    worn: float,
    fresh: float,
    elastic: float,
    plastic: float,
    yield_force: float,
) -> tuple[float, bool]:
    """Force of one bar that is shortened by `shortening` − `compliance` · force, and whether it yields.

    The law of `AbradableLiner` with p = `worn`, p₀ = `fresh`: three straight pieces, each solved with the
    line of the blade's own compliance.
    """
    force = elastic * (shortening - worn) / (1.0 + elastic * compliance)
    if force <= 0.0:
        return 0.0, False
    if force <= yield_force + plastic * (worn - fresh):
        return force, False
    force = (elastic * plastic * (shortening - fresh) + elastic * yield_force) / (
        elastic + plastic * (1.0 + elastic * compliance)
    )
    return force, True


@compiled
def one_revolution(
    motion: Motion,
    gap: np.ndarray,
    tip: Tip,
    bars: Bars,
    restarts: bool,
    scheme: Scheme,
    samples: Samples,
) -> tuple[int, int, int, int]:
    """Integrate.

    Parameters
    ----------
    gap
        To the new liner in each cell, m, shape (r, cells).
    restarts
        Whether hardening restarts with each pass.

    Returns
    -------
    How it ended (`DONE`, `WORN_THROUGH`, `NOT_CONVERGED`), at which contact node and cell, and the most
    rounds that a correction took.
    """
    now, before, worn = motion.now, motion.before, motion.worn
    modes, nodes, tips = len(now), len(worn), tip.observed.shape[1]
    free, force = np.empty(modes), np.empty(nodes)
    inside, h, every = scheme.steps_per_cell, scheme.step, samples.every
    fresh, shortening, slides = np.zeros(nodes), np.empty(nodes), np.ones(nodes)
    yields = np.zeros(nodes, dtype=np.bool_)
    most_rounds = 0
    for cell in range(gap.shape[1]):
        if restarts:
            for i in range(nodes):
                fresh[i] = worn[i, cell]
        for part in range(inside):
            k = cell * inside + part
            if k % every == 0:
                for i in range(nodes):
                    samples.force[k // every, i] = motion.impulse[i] / every
                    motion.impulse[i] = 0.0
            # Prediction: where the tip would be if no contact were left at the end of the step.
            for i in range(nodes):
                force[i] = motion.force[0, i]
                shortening[i] = -gap[i, cell]
                slip = tip.rim_speed
                if tip.friction > 0.0:
                    for j in range(modes):
                        slip += tip.tangential[j, i] * (now[j] - before[j]) / h
                    slides[i] = 1.0 if slip >= 0.0 else -1.0
            for j in range(modes):
                free[j] = scheme.carry[j] * now[j] - scheme.drag[j] * before[j]
                for i in range(nodes):
                    held = (
                        tip.contact[j, i] * motion.force[1, i] + tip.tangential[j, i] * motion.sliding[1, i]
                    )
                    free[j] -= 0.5 * scheme.push[j] * held
                for i in range(nodes):
                    shortening[i] += tip.contact[j, i] * free[j]
            # Correction: round the nodes until their forces agree. One node needs one round.
            touched = False
            for i in range(nodes):
                if shortening[i] > worn[i, cell]:
                    touched = True
            if not touched:
                for i in range(nodes):
                    force[i], yields[i] = 0.0, False
            else:
                rounds = 0
                while True:
                    rounds += 1
                    change, largest = 0.0, 0.0
                    for i in range(nodes):
                        reach = shortening[i]
                        for other in range(nodes):
                            if other != i:
                                give = tip.compliance[i, other] + slides[other] * tip.sideways[i, other]
                                reach -= give * force[other]
                        own = tip.compliance[i, i] + slides[i] * tip.sideways[i, i]
                        found, yields[i] = bar_force(
                            reach,
                            own,
                            worn[i, cell],
                            fresh[i],
                            bars.elastic[i],
                            bars.plastic[i],
                            bars.yield_force[i],
                        )
                        change = max(change, abs(found - force[i]))
                        largest = max(largest, found)
                        force[i] = found
                    if nodes == 1 or change <= CORRECTION_ACCURACY * largest:
                        break
                    if rounds == MOST_ROUNDS:
                        return NOT_CONVERGED, 0, cell, rounds
                most_rounds = max(most_rounds, rounds)
            for j in range(modes):
                after, inward, against = free[j], 0.0, 0.0
                for i in range(nodes):
                    sliding = tip.friction * slides[i] * force[i]
                    after -= (
                        0.5 * scheme.push[j] * (tip.contact[j, i] * force[i] + tip.tangential[j, i] * sliding)
                    )
                    inward += 0.5 * tip.contact[j, i] * (force[i] + motion.force[1, i])
                    against += 0.5 * tip.tangential[j, i] * (sliding + motion.sliding[1, i])
                moved = after - before[j]
                motion.work[0] -= scheme.loss[j] * moved * moved / (4.0 * h)
                motion.work[1] -= 0.5 * inward * moved
                motion.work[2] -= 0.5 * against * moved
                if k % every == 0:
                    samples.position[k // every, j] = now[j]
                    samples.velocity[k // every, j] = moved / (2.0 * h)
                before[j] = now[j]
                now[j] = after
            for i in range(nodes):
                motion.force[1, i], motion.force[0, i] = motion.force[0, i], force[i]
                motion.sliding[1, i] = motion.sliding[0, i]
                motion.sliding[0, i] = tip.friction * slides[i] * force[i]
                motion.impulse[i] += force[i]
                if yields[i]:
                    reached = -gap[i, cell] - force[i] / bars.elastic[i]
                    for j in range(modes):
                        reached += tip.contact[j, i] * now[j]
                    if reached > worn[i, cell]:
                        worn[i, cell] = reached
                        if reached >= bars.thickness[i]:
                            return WORN_THROUGH, i, cell, most_rounds
            for i in range(tips):
                moved = 0.0
                for j in range(modes):
                    moved += tip.observed[j, i] * now[j]
                if abs(moved) > motion.peak[i]:
                    motion.peak[i] = abs(moved)
    return DONE, 0, 0, most_rounds

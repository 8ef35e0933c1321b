"""The slow twin of `liner_kernel`: the same revolution in plain numpy, written from the equations."""

from __future__ import annotations

import numpy as np

from sdm_core.time_domain.liner.abradable_liner import Bars
from sdm_core.time_domain.liner.central_differences import Scheme
from sdm_core.time_domain.liner.liner_kernel import (
    CORRECTION_ACCURACY,
    DONE,
    MOST_ROUNDS,
    NOT_CONVERGED,
    WORN_THROUGH,
    Motion,
    Samples,
    Tip,
)


def bar_forces(
    shortening: np.ndarray,
    compliance: np.ndarray,
    worn: np.ndarray,
    fresh: np.ndarray,
    bars: Bars,
) -> tuple[np.ndarray, np.ndarray]:
    """Forces of bars shortened by `shortening` − `compliance` · force, and whether each yields; all (r,)."""
    held = bars.elastic * (shortening - worn) / (1 + bars.elastic * compliance)
    bound = bars.yield_force + bars.plastic * (worn - fresh)
    cut = (bars.elastic * bars.plastic * (shortening - fresh) + bars.elastic * bars.yield_force) / (
        bars.elastic + bars.plastic * (1 + bars.elastic * compliance)
    )
    yields = (held > 0) & (held > bound)
    return np.where(yields, cut, np.maximum(held, 0.0)), yields


def one_revolution(
    motion: Motion,
    gap: np.ndarray,
    tip: Tip,
    bars: Bars,
    restarts: bool,
    scheme: Scheme,
    samples: Samples,
) -> tuple[int, int, int, int]:
    """As `liner_kernel.one_revolution`; forces of all nodes change together until they agree."""
    h, every, most_rounds = scheme.step, samples.every, 0
    cells = gap.shape[1]
    for k in range(cells * scheme.steps_per_cell):
        cell = k // scheme.steps_per_cell
        if k % scheme.steps_per_cell == 0:
            fresh = motion.worn[:, cell].copy() if restarts else np.zeros(len(gap))
        if k % every == 0:
            samples.force[k // every] = motion.impulse / every
            motion.impulse[:] = 0.0
        held = tip.contact @ motion.force[1] + tip.tangential @ motion.sliding[1]
        free = scheme.carry * motion.now - scheme.drag * motion.before - scheme.push * held / 2
        slip = tip.rim_speed + (motion.now - motion.before) @ tip.tangential / h
        slides = np.where(slip >= 0, 1.0, -1.0)
        give = tip.compliance + slides * tip.sideways
        shortening = free @ tip.contact - gap[:, cell]
        worn = motion.worn[:, cell]
        force, yields, rounds = _corrected(shortening, give, worn, fresh, bars, motion.force[0])
        if rounds > MOST_ROUNDS:
            return NOT_CONVERGED, 0, cell, rounds
        most_rounds = max(most_rounds, rounds)
        sliding = tip.friction * slides * force
        after = free - scheme.push * (tip.contact @ force + tip.tangential @ sliding) / 2
        inward = tip.contact @ (force + motion.force[1]) / 2
        against = tip.tangential @ (sliding + motion.sliding[1]) / 2
        moved = after - motion.before
        motion.work[0] -= (scheme.loss * moved**2).sum() / (4 * h)
        motion.work[1] -= inward @ moved / 2
        motion.work[2] -= against @ moved / 2
        if k % every == 0:
            samples.position[k // every] = motion.now
            samples.velocity[k // every] = moved / (2 * h)
        motion.before[:], motion.now[:] = motion.now, after
        motion.force[:] = force, motion.force[0].copy()
        motion.sliding[:] = sliding, motion.sliding[0].copy()
        motion.impulse[:] += force
        reached = after @ tip.contact - gap[:, cell] - force / bars.elastic
        motion.worn[:, cell] = np.where(yields, np.maximum(worn, reached), worn)
        through = motion.worn[:, cell] >= bars.thickness
        if through.any():
            return WORN_THROUGH, int(np.argmax(through)), cell, most_rounds
        np.maximum(motion.peak, np.abs(after @ tip.observed), out=motion.peak)
    return DONE, 0, 0, most_rounds


def _corrected(
    shortening: np.ndarray,
    give: np.ndarray,
    worn: np.ndarray,
    fresh: np.ndarray,
    bars: Bars,
    start: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, int]:
    own, force = np.diag(give), start
    across = give - np.diag(own)
    for rounds in range(1, MOST_ROUNDS + 1):
        found, yields = bar_forces(shortening - across @ force, own, worn, fresh, bars)
        change = np.abs(found - force).max()
        force = found
        if len(force) == 1 or change <= CORRECTION_ACCURACY * found.max():
            return force, yields, rounds
    return force, yields, MOST_ROUNDS + 1

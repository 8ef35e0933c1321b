"""Rubbing blades drawn at random over the space that real blades span, 1 to 5 modes, 1 to 4 arcs."""

from __future__ import annotations

import numpy as np

from sdm_core.rubbing_blade import RubbingBlade, single_state_problem

NODES = (1, 2, 3, 9)


def random_rubbing_blade(
    rng: np.random.Generator, modes: int | None = None, nodes: int | None = None, *, arcs: bool = True
) -> RubbingBlade:
    """One point: frequency ratios 1.05–4.5, ξ 2e-4–1e-2, κ 1e-4–1, Ω/f1 0.05–0.8, 5–80 % engaged.

    κ is the largest K_e G_jj/ω_j² of a mode, and is drawn evenly on a logarithmic scale, as Ω/f1 and ξ.
    """
    n = int(rng.integers(1, 6)) if modes is None else modes
    r = int(rng.choice(NODES)) if nodes is None else nodes
    ratio = np.r_[1.0, rng.uniform(1.8, 4.5), rng.uniform(1.05, 2.2, max(0, n - 2))][:n]
    frequency = 200.0 * np.cumprod(ratio)
    damping = 10 ** rng.uniform(np.log10(2e-4), -2) * np.exp(rng.uniform(-0.3, 0.3, n))
    along = np.linspace(-1, 1, r) if r > 1 else np.zeros(1)
    shape = rng.normal(size=(n, 3)) @ np.array([np.ones(r), along, along**2])
    shape *= 1 + 0.1 * rng.normal(size=shape.shape)
    shape *= (10 ** rng.uniform(0, np.log10(30), n) / np.abs(shape).max(axis=1))[:, None]
    weight = rng.uniform(0.3, 1, r)
    omega = 2 * np.pi * frequency
    ke = 10 ** rng.uniform(-4, 0) / ((shape**2 * weight).sum(axis=1) / omega**2).max()
    speed = frequency[0] * 10 ** rng.uniform(np.log10(0.05), np.log10(0.8))
    engaged: list[list[float]] = []
    if arcs:
        count, share = int(rng.integers(1, 5)), rng.uniform(0.05, 0.8)
        lengths, gaps = rng.dirichlet(np.ones(count)) * share, rng.dirichlet(np.ones(count)) * (1 - share)
        start = np.cumsum(np.r_[0.0, (lengths + gaps)[:-1]])
        engaged = [[float(a), float(a + length)] for a, length in zip(start, lengths, strict=True)]
    return single_state_problem(frequency, damping, shape, weight, float(speed), float(ke), engaged or None)

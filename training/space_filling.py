"""Space-filling samples of a design space: what the surrogate is trained on at first."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from sdm_core.errors import InvalidInput
from training.cases import ARCS, MODES, CaseBatch
from training.contact_class import PERMANENT
from training.design_space import DesignSpace


def space_filling(
    space: DesignSpace, designs: int, speeds_each: int, seed: int, contact: str = PERMANENT
) -> CaseBatch:
    """`designs` blades (scrambled Sobol points), each at several speeds, in one class of contact.

    Half the mode shapes are quadratics along the chord at 1 to 12 nodes, as real blades have them, half are
    of any rank, so that every correlation G_jk/√(G_jj G_kk) occurs. Each speed has arcs of its own.

    Raises
    ------
    InvalidInput
        For no designs or no speeds.
    """
    if designs < 1 or speeds_each < 1:
        raise InvalidInput("designs", designs, "give at least one design and one speed")
    sobol = qmc.Sobol(_Columns.total + 3 * speeds_each, rng=np.random.default_rng(seed))
    points = sobol.random(1 << int(np.ceil(np.log2(designs))))[:designs]
    points = np.clip(points, 1e-9, 1 - 1e-9)
    rng = np.random.default_rng(seed + 1)
    return CaseBatch.concatenate([_design(space, u, speeds_each, rng, contact) for u in points])


def _design(
    space: DesignSpace, u: np.ndarray, speeds_each: int, rng: np.random.Generator, contact: str
) -> CaseBatch:
    n = 1 + int(u[_Columns.modes] * MODES)
    ratios = np.ones(n)
    if n > 1:
        ratios[1] = _between(u[_Columns.ratio], space.first_ratio)
        for j in range(2, n):
            ratios[j] = _between(u[_Columns.ratio + j - 1], space.next_ratio)
    omega = 2 * np.pi * np.cumprod(ratios)
    mean = np.exp(_between(u[_Columns.damping], tuple(np.log(space.damping_ratio))))
    spread = _between(u[_Columns.spread : _Columns.spread + n], (-0.5, 0.5))
    damping = np.clip(mean * np.exp(spread), *space.damping_ratio)
    size = np.exp(_between(u[_Columns.size : _Columns.size + n], (np.log(0.7), np.log(43.0))))
    # A node near a nodal line of a mode hardly feels it.
    size *= np.where(rng.random(n) < 0.15, 10.0 ** rng.uniform(-3.0, 0.0, n), 1.0)
    normal = ndtri(u[_Columns.shape : _Columns.shape + 3 * n]).reshape(n, 3)
    if u[_Columns.family] < 0.5:
        r = int(rng.choice([1, 1, 2, 3, 5, 9, 12]))
        chord = np.linspace(-1, 1, r) if r > 1 else np.zeros(1)
        shape = normal @ np.stack([chord**0, chord, chord**2]) * (1 + 0.1 * rng.normal(size=(n, r)))
        shape = shape * np.sqrt(rng.uniform(0.3, 1.0, r))
    else:
        rank = 1 + int(rng.integers(0, 5))
        shape = np.concatenate([normal, rng.normal(size=(n, 3))], axis=1)[:, :rank]
    shape = shape * (size / np.abs(shape).max(axis=1))[:, None]
    low, high = np.log(space.speed_ratio)
    speed, count, share = u[_Columns.total :].reshape(3, speeds_each)
    speed = np.exp(low + (high - low) * speed)
    arcs = None
    if contact != PERMANENT:
        fewest, most = space.arc_count
        counts = fewest + (count * (most - fewest + 1)).astype(int)
        engaged = _between(share, space.engaged_share)
        arcs = np.stack([random_arcs(rng, c, e) for c, e in zip(counts, engaged, strict=True)])
    m = speeds_each
    return CaseBatch.from_arrays(np.tile(omega, (m, 1)), damping, np.tile(shape.T, (m, 1, 1)), speed, arcs)


def random_arcs(rng: np.random.Generator, count: int, engaged: float, evenness: float = 1.0) -> np.ndarray:
    """`count` arcs of random lengths and places that add up to `engaged` revolutions, in order; NaN beyond.

    Parameters
    ----------
    evenness
        Of the Dirichlet distribution of the lengths: 1 takes every division as likely as any other.
    """
    lengths = rng.dirichlet(np.full(count, evenness)) * engaged
    gaps = rng.dirichlet(np.ones(count + 1)) * (1.0 - engaged)
    start = np.cumsum(gaps[:-1]) + np.r_[0.0, np.cumsum(lengths)[:-1]]
    out = np.full((ARCS, 2), np.nan)
    out[:count] = np.stack([start, start + lengths], axis=1)
    return out


class _Columns:
    """Which coordinate of a Sobol point means what; of each speed its place and arcs follow."""

    modes, family, damping, ratio = 0, 1, 2, 3
    spread = ratio + MODES - 1
    size = spread + MODES
    shape = size + MODES
    total = shape + 3 * MODES


def _between(u: Any, limits: Any) -> Any:
    return limits[0] + (limits[1] - limits[0]) * u

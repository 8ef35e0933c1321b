"""The reference design space (DESIGN, section 7), on which every figure of the surrogate is given."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sdm_core.blade import Blade, ModalState
from sdm_core.contact import ContactConfiguration
from training.cases import CaseBatch
from training.contact_class import PERMANENT
from training.space_filling import random_arcs

NAME = "reference/1"


@dataclass(frozen=True)
class ReferencePoint:
    """One random point: a blade of n modes and r tip nodes, its contact, speed and K_e.

    Attributes
    ----------
    frequency_hz, damping_ratio
        Shape (n,).
    mode_shape
        kg^-1/2, shape (n, r).
    weights
        Shape (r,).
    speed_hz, ke
        Hz, N/m.
    arcs
        Arcs of contact in revolutions, shape (a, 2); None is permanent contact.
    """

    frequency_hz: np.ndarray
    damping_ratio: np.ndarray
    mode_shape: np.ndarray
    weights: np.ndarray
    speed_hz: float
    ke: float
    arcs: np.ndarray | None = None

    def case(self) -> CaseBatch:
        """As the surrogate sees it."""
        shape = np.sqrt(self.weights)[:, None] * self.mode_shape.T
        omega = 2 * np.pi * self.frequency_hz
        speed, arcs = np.array([self.speed_hz]), None if self.arcs is None else self.arcs[None]
        return CaseBatch.from_arrays(omega[None], self.damping_ratio, shape[None], speed, arcs)

    def blade(self) -> Blade:
        """As a user would send it."""
        nodes = [f"N{i + 1}" for i in range(len(self.weights))]
        state = ModalState(0.0, self.frequency_hz, self.mode_shape)
        return Blade("reference", nodes, self.damping_ratio, [state])

    def contact(self) -> ContactConfiguration:
        """Contact with the weights and arcs."""
        weights = {f"N{i + 1}": float(w) for i, w in enumerate(self.weights)}
        return ContactConfiguration(weights, None if self.arcs is None else self.arcs.tolist())


@dataclass(frozen=True)
class ReferenceSample:
    """Independent random points: cases, and a K_e for each, N/m, shape (m,)."""

    cases: CaseBatch
    ke: np.ndarray


def reference_sample(count: int, seed: int, contact: str = PERMANENT) -> ReferenceSample:
    """`count` independent points of the reference design space in one class of contact."""
    points = list(reference_points(count, seed, contact))
    return ReferenceSample(
        CaseBatch.concatenate([p.case() for p in points]), np.array([p.ke for p in points])
    )


def reference_points(count: int, seed: int, contact: str = PERMANENT) -> Iterator[ReferencePoint]:
    """The same points one by one, as blades."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield _draw(rng, contact)


def _draw(rng: np.random.Generator, contact: str) -> ReferencePoint:
    n = int(rng.integers(1, 6))
    ratio = np.ones(n)
    ratio[1:2] = rng.uniform(1.8, 4.5, len(ratio[1:2]))
    ratio[2:] = rng.uniform(1.05, 2.2, len(ratio[2:]))
    frequency = np.cumprod(ratio) * rng.uniform(250.0, 1400.0)
    damping = np.exp(rng.uniform(np.log(2e-4), np.log(1e-2)) + rng.uniform(-0.3, 0.3, n))

    r = int(rng.choice([1, 2, 3, 9]))
    chord = np.linspace(-1.0, 1.0, r) if r > 1 else np.zeros(1)
    shape = rng.normal(size=(n, 3)) @ np.stack([chord**0, chord, chord**2])
    shape *= 1.0 + 0.1 * rng.normal(size=shape.shape)
    largest = np.exp(rng.uniform(0.0, np.log(30.0), (n, 1)))
    shape *= largest / np.abs(shape).max(axis=1, keepdims=True)
    weights = rng.uniform(0.3, 1.0, r)

    kappa = np.exp(rng.uniform(np.log(1e-4), 0.0))
    speed = frequency[0] * np.exp(rng.uniform(np.log(0.05), np.log(0.8)))
    compliance = (shape**2 @ weights) / (2 * np.pi * frequency) ** 2
    arcs = None
    if contact != PERMANENT:
        count = int(rng.integers(1, 5))
        arcs = random_arcs(rng, count, rng.uniform(0.05, 0.8), evenness=2.0)[:count]
    ke = float(kappa / compliance.max())
    return ReferencePoint(frequency, damping, shape, weights, float(speed), ke, arcs)

"""Receptance of the blade at its contact nodes, and its eigenvalues along the frequency axis."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from sdm_core.interruption import checkpoint


@dataclass(frozen=True)
class ContactReceptance:
    """H(s) = Fᵀ(Λ² + s² + 2ξΛs)⁻¹F, F Fᵀ = G: what the tip answers to a contact force.

    Its non-zero eigenvalues are those of W^½V_bᵀ(...)⁻¹V_bW^½ (DESIGN, fact 2), whatever the number
    of tip nodes.

    Attributes
    ----------
    omega
        Λ, rad/s, shape (n,).
    damping_ratio
        ξ, shape (n,).
    factor
        F, kg^-1/2, shape (n, p).
    """

    omega: np.ndarray
    damping_ratio: np.ndarray
    factor: np.ndarray

    @property
    def rank(self) -> int:
        """p."""
        return self.factor.shape[1]

    def modal(self, s: np.ndarray) -> np.ndarray:
        """(Λ² + s² + 2ξΛs)⁻¹, s²/rad², shape (m, n)."""
        s = np.asarray(s)[:, None]
        return 1.0 / (self.omega**2 + s**2 + 2 * self.damping_ratio * self.omega * s)

    def matrix(self, s: np.ndarray) -> np.ndarray:
        """H(s), m/N, shape (m, p, p)."""
        return (self.modal(s)[:, None, :] * self.factor.T) @ self.factor

    def eigenvalues(self, w: np.ndarray) -> np.ndarray:
        """λ(iω) in no order, shape (m, p)."""
        if self.rank == 1:
            return self.modal(1j * w) @ self.factor**2
        chunk = max(1, int(20_000 * (5 / self.rank) ** 3))
        pieces = []
        for i in range(0, len(w), chunk):
            checkpoint()
            pieces.append(np.linalg.eigvals(self.matrix(1j * w[i : i + chunk])))
        return np.concatenate(pieces)

    def eigenvalue_near(self, w: np.ndarray, guess: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The eigenvalue whose inverse is nearest to `guess` (m,), and its derivative in s.

        dλ/ds = uᵀ(dH/ds)u / uᵀu, u the eigenvector, since H is complex symmetric.
        """
        s = 1j * w
        modal = self.modal(s)
        slope = -(modal**2) * (2 * s[:, None] + 2 * self.damping_ratio * self.omega)
        if self.rank == 1:
            square = self.factor[:, 0] ** 2
            return modal @ square, slope @ square
        lam, u = np.linalg.eig((modal[:, None, :] * self.factor.T) @ self.factor)
        pick = np.argmin(np.abs(1.0 / lam - guess[:, None]), axis=1)
        rows = np.arange(len(w))
        u = u[rows, :, pick]
        moved = u @ self.factor.T
        return lam[rows, pick], (moved**2 * slope).sum(axis=1) / (u**2).sum(axis=1)


@dataclass(frozen=True)
class Sweep:
    """Dynamic stiffness 1/λ of every branch, piecewise linear between frequencies.

    1/λ rather than λ, because it is nearly a straight line through a resonance.

    Attributes
    ----------
    left, right
        Ends of the intervals, rad/s, shape (k,).
    z_left, z_right
        1/λ of each branch at the ends, the same branch in the same column, N/m, shape (k, p).
    """

    left: np.ndarray
    right: np.ndarray
    z_left: np.ndarray
    z_right: np.ndarray


def swept(receptance: ContactReceptance, ke_max: float, tolerance: float = 1e-2) -> Sweep:
    """Sweep of the frequencies at which K_e up to `ke_max` can have a root on the imaginary axis.

    Below ω₁ the real part of H is positive definite and no K_e has one; K_e ≥ |1/λ|/2 bounds the
    frequencies above. Intervals are halved until 1/λ at the middle is within `tolerance` of the
    straight line and the branches can be told apart, except where no K_e ≤ `ke_max` has a root.
    """
    w = _first_grid(receptance, ke_max)
    z = _dynamic_stiffness(receptance, w)
    left, right, z_left, z_right = w[:-1], w[1:], z[:-1], z[1:]
    done: list[tuple[np.ndarray, ...]] = []
    for _ in range(24):
        z_right, clear = _matched(z_left, z_right)
        middle = 0.5 * (left + right)
        z_middle = _dynamic_stiffness(receptance, middle)
        line = 0.5 * (z_left + z_right)
        z_middle, _ = _matched(line, z_middle)
        size = np.minimum(np.abs(z_left), np.abs(z_right))
        straight = np.abs(z_middle - line) <= tolerance * np.minimum(size, np.abs(z_middle))
        # A branch that stays stiffer than any root needs, or on the stable side, may stay coarse.
        stiff = size > 4 * ke_max
        positive = np.minimum(np.minimum(z_left.real, z_right.real), z_middle.real) > 0
        positive &= np.abs(z_middle - line) <= 0.3 * size
        settled = ((straight & clear[:, None]) | stiff | positive).all(axis=1)
        settled |= right - left < 1e-9 * right
        done.append((left[settled], right[settled], z_left[settled], z_right[settled]))
        if settled.all():
            break
        go = ~settled
        left, right = np.r_[left[go], middle[go]], np.r_[middle[go], right[go]]
        z_left, z_right = np.r_[z_left[go], z_middle[go]], np.r_[z_middle[go], z_right[go]]
    else:
        done.append((left, right, z_left, _matched(z_left, z_right)[0]))
    parts = [np.concatenate(column) for column in zip(*done, strict=True)]
    order = np.argsort(parts[0])
    return Sweep(*(part[order] for part in parts))


def _dynamic_stiffness(receptance: ContactReceptance, w: np.ndarray) -> np.ndarray:
    """1/λ(iω), bounded so that its square still fits a double; no K_e comes near the bound."""
    lam = receptance.eigenvalues(w)
    return 1.0 / np.where(np.abs(lam) < 1e-120, 1e-120, lam)


def _first_grid(receptance: ContactReceptance, ke_max: float) -> np.ndarray:
    """Frequencies from ω₁ up, close together near each natural frequency, rad/s."""
    touched = (receptance.factor**2).sum(axis=1) > 0
    omega = receptance.omega[touched]
    low = omega.min()
    high = np.sqrt(omega.max() ** 2 + 4 * ke_max * (receptance.factor**2).sum())
    grid = [np.array([low, high]), np.geomspace(low, high, 24)]
    for centre, damping in zip(omega, receptance.damping_ratio[touched], strict=True):
        width = max(damping, 1e-7)
        offset = (
            centre
            * width
            * np.r_[0.0, np.geomspace(0.5, max(1.0, 1.0 / width), 2 + int(3 * np.log(1 / width)))]
        )
        grid += [centre + offset, centre - offset]
    w = np.unique(np.concatenate(grid))
    w = w[(w >= low) & (w <= high)]
    return w[np.r_[True, np.diff(w) > 1e-12 * w[1:]]]


def _matched(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Columns of b permuted, row by row, to lie nearest to a; and whether no other order is near.

    Distances are relative, so that a soft branch is not lost among stiff ones.
    """
    k, p = a.shape
    if p == 1:
        return b, np.ones(k, dtype=bool)
    distance = np.abs(a[:, :, None] - b[:, None, :])
    distance /= np.abs(a)[:, :, None] + np.abs(b)[:, None, :]
    if p <= 5:
        orders = np.array(list(itertools.permutations(range(p))))
        cost = distance[:, np.arange(p), orders].sum(axis=2)
        best = np.argmin(cost, axis=1)
        rows = np.arange(k)
        least = cost[rows, best].copy()
        cost[rows, best] = np.inf
        clear = least < 0.5 * cost.min(axis=1)
        return b[rows[:, None], orders[best]], clear
    chosen = np.array([linear_sum_assignment(d)[1] for d in distance])
    own = np.take_along_axis(distance, chosen[:, :, None], axis=2)[:, :, 0]
    rival = distance.copy()
    np.put_along_axis(rival, chosen[:, :, None], np.inf, axis=2)
    clear = (own < 0.5 * rival.min(axis=2)).all(axis=1)
    return np.take_along_axis(b, chosen, axis=1), clear

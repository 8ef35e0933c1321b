"""The textbook method in one file: what an engineer writes from the paper, to be measured against.

Averaged semi-discretization ([SBL] Eqs. 7-14) with N = 60, dense numpy. Constant coefficients take the
eigenvalues of one step's matrix instead of a 60-fold product (DESIGN, section 7); with arcs of contact
γ is averaged over each step (Eq. 10) and the product is taken.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

STEPS = 60


def spectral_radius(
    omega: np.ndarray, damping_ratio: np.ndarray, contact_matrix: np.ndarray, speed_hz: float, ke: float
) -> float:
    """|μ| of the dominant multiplier in permanent contact.

    Parameters
    ----------
    omega, damping_ratio
        rad/s and ratio, shape (n,).
    contact_matrix
        G, kg^-1, shape (n, n).
    """
    d = step_matrix(omega, damping_ratio, ke * contact_matrix, 1.0 / (speed_hz * STEPS))
    return float(np.abs(np.linalg.eigvals(d)).max() ** STEPS)


def spectral_radius_with_arcs(
    omega: np.ndarray,
    damping_ratio: np.ndarray,
    contact_matrix: np.ndarray,
    speed_hz: float,
    ke: float,
    arcs: tuple[tuple[float, float], ...],
) -> float:
    """|μ| of the dominant multiplier; arcs (start, end) in revolutions, others as above."""
    monodromy = np.eye(len(omega) * (STEPS + 2))
    for i in range(STEPS):
        gamma = engaged_share(arcs, i / STEPS, (i + 1) / STEPS)
        d = step_matrix(omega, damping_ratio, gamma * ke * contact_matrix, 1.0 / (speed_hz * STEPS))
        monodromy = d @ monodromy
    return float(np.abs(np.linalg.eigvals(monodromy)).max())


def step_matrix(omega: np.ndarray, damping_ratio: np.ndarray, force: np.ndarray, dt: float) -> np.ndarray:
    """D_i of y_{i+1} = D_i y_i (Eqs. 12-13), `force` the mean of K_e γ G over the step of dt s."""
    n = len(omega)
    a = np.zeros((2 * n, 2 * n))
    a[:n, n:] = np.eye(n)
    a[n:, :n] = -np.diag(omega**2) - force
    a[n:, n:] = -np.diag(2 * damping_ratio * omega)
    b = np.zeros((2 * n, 2 * n))
    b[n:, :n] = force
    p = expm(a * dt)
    r = (p - np.eye(2 * n)) @ np.linalg.solve(a, b)

    size = n * (STEPS + 2)
    d = np.zeros((size, size))
    d[: 2 * n, : 2 * n] = p
    d[: 2 * n, -2 * n : -n] += 0.5 * r[:, :n]
    d[: 2 * n, -n:] += 0.5 * r[:, :n]
    d[2 * n : 3 * n, :n] = np.eye(n)
    for i in range(3, STEPS + 2):
        d[i * n : (i + 1) * n, (i - 1) * n : i * n] = np.eye(n)
    return d


def engaged_share(arcs: tuple[tuple[float, float], ...], start: float, end: float) -> float:
    """Mean of γ over [start, end], revolutions within [0, 1]."""
    overlap = sum(max(0.0, min(end, b - turn) - max(start, a - turn)) for a, b in arcs for turn in (0.0, 1.0))
    return overlap / (end - start)

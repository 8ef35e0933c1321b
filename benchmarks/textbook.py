"""The textbook method in one file: what an engineer writes from the paper, to be measured against.

Averaged semi-discretization ([SBL] Eqs. 7-14) with N = 60, dense numpy. Constant coefficients take the
eigenvalues of one step's matrix instead of a 60-fold product (DESIGN, section 7).
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
    n = len(omega)
    a = np.zeros((2 * n, 2 * n))
    a[:n, n:] = np.eye(n)
    a[n:, :n] = -np.diag(omega**2) - ke * contact_matrix
    a[n:, n:] = -np.diag(2 * damping_ratio * omega)
    b = np.zeros((2 * n, 2 * n))
    b[n:, :n] = ke * contact_matrix
    p = expm(a / (speed_hz * STEPS))
    r = (p - np.eye(2 * n)) @ np.linalg.solve(a, b)

    size = n * (STEPS + 2)
    d = np.zeros((size, size))
    d[: 2 * n, : 2 * n] = p
    d[: 2 * n, -2 * n : -n] += 0.5 * r[:, :n]
    d[: 2 * n, -n:] += 0.5 * r[:, :n]
    d[2 * n : 3 * n, :n] = np.eye(n)
    for i in range(3, STEPS + 2):
        d[i * n : (i + 1) * n, (i - 1) * n : i * n] = np.eye(n)
    return float(np.abs(np.linalg.eigvals(d)).max() ** STEPS)

"""Real power series from values on the upper half of a circle."""

from __future__ import annotations

from functools import cache

import numpy as np


@cache
def half_circle(terms: int) -> np.ndarray:
    """e^{iθ}, θ = π/m, 3π/m, … below π: the upper half of m points, none on the real axis, shape (m/2,).

    That takes one value less than points on the axis would (m even).
    """
    return np.exp(1j * np.pi * (2 * np.arange(terms // 2) + 1) / terms)


def real_series(values: np.ndarray) -> np.ndarray:
    """C_k of f(t) = Σ C_k t^k, k < m, real, shape (b, m, d), from f at `half_circle`, shape (b, m/2, d).

    C_k = (2/m) Re Σ_j f(t_j) t_j^{−k}: the trapezoidal rule for Cauchy's integral (Fornberg 1981), in one
    product of real matrices; what is missed of C_k is C_{k+m}, with changed sign.
    """
    return _transform(2 * values.shape[1]) @ np.concatenate([values.real, values.imag], axis=1)


@cache
def _transform(terms: int) -> np.ndarray:
    turn = np.outer(np.arange(terms), np.angle(half_circle(terms)))
    return np.concatenate([np.cos(turn), np.sin(turn)], axis=1) * (2 / terms)

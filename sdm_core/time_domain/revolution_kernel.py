"""One revolution of ż = A(t)z + B(t)z(t − τ) over given steps, compiled."""

from __future__ import annotations

import numpy as np

from sdm_core.time_domain.compiled import compiled
from sdm_core.time_domain.runge_kutta import ALL_STAGES, DENSE, ERROR_3, ERROR_5, STAGES, TABLE, TERMS

_LAST_SLOPE = STAGES  # taken at the end of the step


@compiled
def one_revolution(
    steps: np.ndarray,
    start: np.ndarray,
    past: np.ndarray,
    modulation: np.ndarray,
    a: np.ndarray,
    b: np.ndarray,
    memory: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integrate.

    Parameters
    ----------
    steps
        s, shape (m,).
    start
        State at the beginning, shape (d,).
    past
        The coordinates `memory` a revolution before, at every stage of every step, shape (m, 16, q).
    modulation
        Factors of the terms of A and B there, that of the constant term first, shape (k, m, 16).
    a, b
        Those terms, each (k, d, d).
    memory
        Coordinates whose past matters, shape (q,).

    Returns
    -------
    States at the ends of the steps, (m + 1, d); terms of the dense output, (m, 7, d); estimated error of each
    step, (m, d).
    """
    many, size, terms = len(steps), len(start), len(a)
    ends = np.empty((many + 1, size))
    dense = np.empty((many, TERMS, size))
    error = np.empty((many, size))
    slope = np.zeros((ALL_STAGES, size))
    state = np.empty(size)
    ends[0] = start
    for k in range(many):
        h, before = steps[k], ends[k]
        for s in range(ALL_STAGES):
            for i in range(size):
                total = 0.0
                for j in range(s):
                    total += TABLE[s, j] * slope[j, i]
                state[i] = before[i] + h * total
            if s == _LAST_SLOPE:
                ends[k + 1] = state
            slope[s] = 0.0
            for term in range(terms):
                factor = modulation[term, k, s]
                if factor == 0.0:
                    continue
                for i in range(size):
                    total = 0.0
                    for j in range(size):
                        total += a[term, i, j] * state[j]
                    for j in range(len(memory)):
                        total += b[term, i, memory[j]] * past[k, s, j]
                    slope[s, i] += factor * total
        for i in range(size):
            fifth, third = 0.0, 0.0
            for s in range(STAGES + 1):
                fifth += ERROR_5[s] * slope[s, i]
                third += ERROR_3[s] * slope[s, i]
            # The two embedded errors together fall as the eighth power (Hairer, Nørsett, Wanner, II.10).
            below = fifth * fifth + 0.01 * third * third
            error[k, i] = 0.0 if below == 0.0 else h * fifth * fifth / np.sqrt(below)
            change = ends[k + 1, i] - before[i]
            dense[k, 0, i] = change
            dense[k, 1, i] = h * slope[0, i] - change
            dense[k, 2, i] = 2 * change - h * (slope[_LAST_SLOPE, i] + slope[0, i])
            for row in range(len(DENSE)):
                total = 0.0
                for s in range(ALL_STAGES):
                    total += DENSE[row, s] * slope[s, i]
                dense[k, 3 + row, i] = h * total
    return ends, dense, error

"""The explicit Runge-Kutta pair of order 8(5, 3) with dense output of order 7.

Hairer, Nørsett, Wanner: Solving Ordinary Differential Equations I, 2nd ed. (1993), sections II.5, II.6.
The coefficients are those of `scipy.integrate.DOP853`.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import DOP853

STAGES = int(DOP853.n_stages)  # 12
FURTHER = len(DOP853.C_EXTRA)  # 3, for the dense output alone
ALL_STAGES = STAGES + 1 + FURTHER
"""Stages, the slope at the end of the step, further stages."""

NODES = np.concatenate([DOP853.C[:STAGES], [1.0], DOP853.C_EXTRA])
"""Where in the step each slope is taken, shape (16,)."""

TABLE = np.zeros((ALL_STAGES, ALL_STAGES))
"""Row i: the state of stage i from the slopes before it; row 12 is the step itself."""
TABLE[:STAGES, :STAGES] = DOP853.A[:STAGES, :STAGES]
TABLE[STAGES, :STAGES] = DOP853.B
TABLE[STAGES + 1 :, :] = DOP853.A_EXTRA

ERROR_5 = np.array(DOP853.E5)
"""Weights of the slopes in the error against the embedded method of order 5, shape (13,)."""
ERROR_3 = np.array(DOP853.E3)
ERROR_ORDER = 8
"""The error estimate falls with this power of the step."""

DENSE = np.array(DOP853.D)
"""Weights of the slopes in the last four terms of the dense output, shape (4, 16)."""
TERMS = 3 + len(DENSE)


def dense_basis(place: np.ndarray) -> np.ndarray:
    """Values of the dense output's terms at places in a step (0 to 1), shape (places, 7).

    The state is that at the beginning of the step plus their sum with the step's terms.
    """
    x = np.asarray(place, dtype=float)
    out = np.empty((*x.shape, TERMS))
    value = np.ones_like(x)
    for i in range(TERMS):
        value = value * (x if i % 2 == 0 else 1 - x)
        out[..., i] = value
    return out


AT_NODES = dense_basis(NODES)
"""`dense_basis` where the next revolution's slopes are taken, shape (16, 7)."""

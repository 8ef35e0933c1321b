"""Semi-discretization as written in the paper ([SBL] Eqs. 7-14): averaged delayed state, dense."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from sdm_core.delay_equation import DelayEquation
from sdm_core.errors import InvalidInput

LARGEST_STATE = 4000


@dataclass(frozen=True)
class Averaged:
    """Semi-discretization with a fixed number of steps per revolution.

    Over each step the coefficients are replaced by their means (Eq. 10) and the delayed state by
    the average of its values at the ends (Eq. 8), which gives (Eq. 11)

        z_{i+1} = P_i z_i + ½ R_i (u_{i−N+1} + u_{i−N}),

    u the coordinates that have memory. The state of the discrete map is
    y_i = (z_i, u_{i−1}, ..., u_{i−N}) (Eq. 12): n(N + 2) entries for n displacements.

    Its answer carries the error of N: second order, and on the unsafe side at low speed
    (DESIGN, fact 1). `Converged` chooses N.

    Parameters
    ----------
    steps
        N, at least 2.
    """

    steps: int = 60

    def __post_init__(self) -> None:
        if not isinstance(self.steps, int) or isinstance(self.steps, bool) or self.steps < 2:
            raise InvalidInput("steps", self.steps, "give a whole number of steps from 2 up")

    def state_size(self, equation: DelayEquation) -> int:
        """Length of y."""
        return equation.size + len(equation.memory) * self.steps

    def monodromy(self, equation: DelayEquation) -> np.ndarray:
        """Φ = D_{N−1} ... D_0 (Eq. 14), shape (S, S), S = `state_size`.

        Raises
        ------
        InvalidInput
            When Φ would be larger than `LARGEST_STATE` square.
        """
        steps, d, memory = self.steps, equation.size, equation.memory
        m, size = len(memory), self.state_size(equation)
        if size > LARGEST_STATE:
            raise InvalidInput(
                "steps",
                steps,
                f"take fewer: the monodromy matrix would have {size} rows, {LARGEST_STATE} is the most",
            )
        p, r = self._step_matrices(equation)

        # Every row of y_i as a combination of y_0; D_i only adds one block of rows and shifts.
        now = np.eye(d, size)
        past = [np.eye(m, size, k=d + m * j) for j in range(steps)]  # u_{i−1}, ..., u_{i−N}
        past.reverse()  # oldest first
        for i in range(steps):
            p_i, r_i = (p[0], r[0]) if len(p) == 1 else (p[i], r[i])
            u_now = now[memory]
            newer = past[i + 1] if i + 1 < len(past) else u_now
            now = p_i @ now + 0.5 * r_i @ (newer + past[i])
            past.append(u_now)
        return np.vstack([now, *reversed(past[steps:])])

    def multipliers(self, equation: DelayEquation) -> np.ndarray:
        """Eigenvalues of Φ, largest modulus first."""
        mu = np.linalg.eigvals(self.monodromy(equation))
        return mu[np.argsort(-np.abs(mu), kind="stable")]

    def _step_matrices(self, equation: DelayEquation) -> tuple[np.ndarray, np.ndarray]:
        """P_i and R_i (Eq. 11), shapes (N or 1, d, d) and (N or 1, d, m).

        R_i = ∫₀^Δt exp(A_i s) ds B_i comes from one exponential of a bordered matrix, which needs
        no inverse of A_i and so also holds where A_i is singular.
        """
        d, memory = equation.size, equation.memory
        dt = equation.tau / self.steps
        start = dt * np.arange(1 if equation.is_constant else self.steps)
        a, b = equation.means(start, start + dt)
        bordered = np.zeros((len(start), d + len(memory), d + len(memory)))
        bordered[:, :d, :d] = a
        bordered[:, :d, d:] = b[:, :, memory]
        grown = expm(bordered * dt)
        return grown[:, :d, :d], grown[:, :d, d:]

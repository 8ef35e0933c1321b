"""The motion of a rubbing blade from a given displacement on: [SBL] section 4.1, Eq. 21."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sdm_core.errors import InvalidInput
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.time_domain.method_of_steps import RTOL, MethodOfSteps
from sdm_core.time_domain.revolution import Revolution

Progress = Callable[[int, int], None]
MOST_REVOLUTIONS = 100_000


@dataclass(frozen=True)
class Motion:
    """Modal coordinates of a blade over whole revolutions, known at every instant.

    Attributes
    ----------
    problem
        Blade, contact, speed and K_e.
    revolutions
        From t = 0 on.
    rtol
        Error of a step, relative to the largest state about.
    """

    problem: RubbingBlade
    revolutions: tuple[Revolution, ...]
    rtol: float

    @property
    def duration(self) -> float:
        """s."""
        return len(self.revolutions) * self.problem.tau

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Modal displacements and velocities at times in [0, duration], s, shape (m,); each (m, n).

        Raises
        ------
        InvalidInput
            For a time outside.
        """
        times = np.atleast_1d(np.asarray(times, dtype=float))
        slack = 1e-9 * self.problem.tau
        outside = ~((times >= -slack) & (times <= self.duration + slack))
        if outside.any():
            i = int(np.argmax(outside))
            remedy = f"give times from 0 to {self.duration:g} s, the end of the last revolution"
            raise InvalidInput(f"times[{i}]", float(times[i]), remedy)
        tau, n = self.problem.tau, len(self.problem.omega)
        turn = np.clip(np.floor(times / tau).astype(int), 0, len(self.revolutions) - 1)
        states = np.empty((len(times), 2 * n))
        for k in np.unique(turn):
            inside = turn == k
            states[inside] = self.revolutions[k].at(np.clip(times[inside] - k * tau, 0.0, tau))
        return states[:, :n], states[:, n:]

    def displacement(self, times: np.ndarray, mode_shape: np.ndarray) -> np.ndarray:
        """Displacement at nodes, m, shape (m, r), from their mode shapes V_b, kg^-1/2, shape (n, r)."""
        return self.at(times)[0] @ mode_shape


def integrated(
    problem: RubbingBlade,
    history: np.ndarray,
    revolutions: int,
    *,
    rtol: float = RTOL,
    progress: Progress = lambda done, total: None,
) -> Motion:
    """The motion after a constant displacement without velocity was held for one revolution.

    Parameters
    ----------
    history
        Modal displacements before t = 0, kg^1/2 m, shape (n,); see `held_node`.
    revolutions
        How many.
    rtol
        Error of each step, relative to the largest state of its revolution and the one before, in
        displacements times natural angular frequencies beside velocities.
    progress
        Told the revolutions done and their number.

    Raises
    ------
    InvalidInput
        When the history is not n finite numbers, or the count or the tolerance is out of range.
    TooMuchWork
        When the tolerance takes too many steps.

    Examples
    --------
    >>> from sdm_core.rubbing_blade import single_state_problem
    >>> problem = single_state_problem([100.0], 0.002, [[1.0]], [1.0], speed_hz=30.0, ke=0.0)
    >>> motion = integrated(problem, [1.0], 2)
    >>> float(abs(motion.at([0.01])[0][0, 0] - np.exp(-0.002 * 2 * np.pi))) < 1e-5
    True
    """
    n = len(problem.omega)
    held = np.asarray(history, dtype=float)
    if held.shape != (n,) or not np.isfinite(held).all():
        raise InvalidInput("history", history, f"give {n} finite numbers, one a mode")
    if isinstance(revolutions, bool) or not isinstance(revolutions, int | np.integer):
        raise InvalidInput("revolutions", revolutions, "give a whole number")
    if not 1 <= revolutions <= MOST_REVOLUTIONS:
        raise InvalidInput("revolutions", revolutions, f"give 1 to {MOST_REVOLUTIONS:,}")
    method = MethodOfSteps(problem.delay_equation(), state_weights(problem), rtol)
    before = Revolution.constant(method.first_mesh(), np.concatenate([held, np.zeros(n)]))
    found = []
    for count in range(revolutions):
        before = method.next_revolution(before)
        found.append(before)
        progress(count + 1, revolutions)
    return Motion(problem, tuple(found), rtol)


def held_node(omega: np.ndarray, mode_shape: np.ndarray, displacement: float) -> np.ndarray:
    """Modal displacements of a blade that a force at one node holds displaced there, shape (n,).

    Of all displacements with this one at the node it has the least strain energy: x = Λ⁻²v d/(vᵀΛ⁻²v). In the
    coordinates of [SBL] Eq. 15 it is the static mode of that node.

    Parameters
    ----------
    omega
        Λ, rad/s, shape (n,).
    mode_shape
        v of that node, kg^-1/2, shape (n,).
    displacement
        d, m.

    Raises
    ------
    InvalidInput
        When no mode moves the node.
    """
    pushed = np.asarray(mode_shape, dtype=float) / np.asarray(omega, dtype=float) ** 2
    give = float(pushed @ mode_shape)
    if give == 0.0:
        raise InvalidInput("mode_shape", "all zero", "choose a node that the modes move")
    return pushed * (displacement / give)


def state_weights(problem: RubbingBlade) -> np.ndarray:
    """What makes a displacement comparable with a velocity: ω beside 1, shape (2n,)."""
    return np.concatenate([problem.omega, np.ones(len(problem.omega))])

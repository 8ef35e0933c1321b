"""The motion of a rubbing blade from a given displacement on: [SBL] section 4.1, Eq. 21."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdm_core.errors import InvalidInput
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.time_domain.method_of_steps import RTOL, MethodOfSteps
from sdm_core.time_domain.revolution import Revolution
from sdm_core.validation import AMPLITUDE_LIMIT, FREQUENCY_LIMITS_HZ, matrix, number, vector, whole

Progress = Callable[[int, int], None]
MOST_REVOLUTIONS = 100_000
_LARGEST_HISTORY = 1e6  # kg^1/2 m: no blade is a tenth as far out


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
            For a time outside, or what is none.
        """
        slack = 1e-9 * self.problem.tau
        times = vector("times", times, -slack, self.duration + slack, "s, the end of the last revolution")
        tau, n = self.problem.tau, len(self.problem.omega)
        turn = np.clip(np.floor(times / tau).astype(int), 0, len(self.revolutions) - 1)
        states = np.empty((len(times), 2 * n))
        for k in np.unique(turn):
            inside = turn == k
            states[inside] = self.revolutions[k].at(np.clip(times[inside] - k * tau, 0.0, tau))
        return states[:, :n], states[:, n:]

    def displacement(self, times: np.ndarray, mode_shape: np.ndarray) -> np.ndarray:
        """Displacement at nodes, m, shape (m, r), from their mode shapes V_b, kg^-1/2, shape (n, r)."""
        modes = len(self.problem.omega)
        shape = matrix("mode_shape", mode_shape, None, -AMPLITUDE_LIMIT, AMPLITUDE_LIMIT, "kg^-1/2")
        if len(shape) != modes:
            raise InvalidInput("mode_shape", f"{len(shape)} rows", f"give one row a mode: {modes}")
        return self.at(times)[0] @ shape


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
        When the history is not n finite numbers, the count or the tolerance is out of range, or the motion
        grows beyond all numbers.
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
    check_problem(problem)
    n = len(problem.omega)
    held = vector("history", history, -_LARGEST_HISTORY, _LARGEST_HISTORY, "kg^1/2 m")
    if len(held) != n:
        raise InvalidInput("history", f"{len(held)} numbers", f"give one number a mode: {n}")
    revolutions = whole("revolutions", revolutions, 1, MOST_REVOLUTIONS)
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
        When no mode moves the node, or numbers are missing or out of range.
    """
    natural = vector("omega", omega, 0.0, 2 * np.pi * FREQUENCY_LIMITS_HZ[1], "rad/s", open_low=True)
    shape = vector("mode_shape", mode_shape, -AMPLITUDE_LIMIT, AMPLITUDE_LIMIT, "kg^-1/2")
    if len(shape) != len(natural):
        raise InvalidInput("mode_shape", f"{len(shape)} numbers", f"give one a mode: {len(natural)}")
    displacement = number("displacement", displacement, -1e3, 1e3, "m")
    pushed = shape / natural**2
    give = float(pushed @ shape)
    if give == 0.0:
        raise InvalidInput("mode_shape", "all zero", "choose a node that the modes move")
    return pushed * (displacement / give)


def check_problem(problem: Any) -> None:
    """Refuse what is no rubbing blade.

    Raises
    ------
    InvalidInput
    """
    if not isinstance(problem, RubbingBlade):
        remedy = "give a RubbingBlade, e.g. RubbingBlade.from_blade(blade, contact, speed_hz, ke)"
        raise InvalidInput("problem", type(problem).__name__, remedy)


def state_weights(problem: RubbingBlade) -> np.ndarray:
    """What makes a displacement comparable with a velocity: ω beside 1, shape (2n,)."""
    return np.concatenate([problem.omega, np.ones(len(problem.omega))])

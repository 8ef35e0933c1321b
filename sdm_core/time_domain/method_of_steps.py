"""The delay equation integrated revolution by revolution, with a bound on the error of every step.

Over one revolution the delayed state is known from the one before, so that the equation is an ordinary one
there. Steps end at multiples of τ, across which a derivative of the solution jumps (the first at t = 0, and
one order higher each revolution), and where the coefficients jump: at the edges of arcs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sdm_core.delay_equation import DelayEquation, Modulation
from sdm_core.errors import InvalidInput, TooMuchWork
from sdm_core.interruption import checkpoint
from sdm_core.time_domain.revolution import Revolution
from sdm_core.time_domain.revolution_kernel import one_revolution
from sdm_core.time_domain.revolution_mesh import RevolutionMesh
from sdm_core.time_domain.runge_kutta import ERROR_ORDER
from sdm_core.validation import number, vector

RTOL = 1e-10
"""Error of a step that is let pass, relative to the largest state of its revolution and the one before."""
TIGHTEST, LOOSEST = 1e-13, 1e-2
MOST_STEPS = 400_000
_FIRST_STEP = 1.0  # radians of the fastest free motion
_MOST_PARTS, _SAFETY, _MOST_TRIES = 8, 1.2, 30


@dataclass(frozen=True)
class MethodOfSteps:
    """Integrates one delay equation.

    Parameters
    ----------
    equation
        ż = A(t)z + B(t)z(t − τ).
    weights
        What makes coordinates comparable, such as natural angular frequencies for displacements beside
        velocities, shape (d,); ones where left out. Errors are held to the largest weighted state.
    rtol
        Error of a step, relative to that.

    Raises
    ------
    InvalidInput
        When `rtol` cannot be met in double precision, or equation, weights or tolerance are none.
    """

    equation: DelayEquation
    weights: np.ndarray | None = None
    rtol: float = RTOL

    def __post_init__(self) -> None:
        if not isinstance(self.equation, DelayEquation):
            remedy = "give a DelayEquation, e.g. problem.delay_equation()"
            raise InvalidInput("equation", type(self.equation).__name__, remedy)
        number("rtol", self.rtol, TIGHTEST, LOOSEST, "")
        if self.weights is not None:
            size = self.equation.size
            given = vector("weights", self.weights, 0.0, 1e300, "", open_low=True)
            if len(given) != size:
                raise InvalidInput("weights", f"{len(given)} numbers", f"give one a coordinate: {size}")
            object.__setattr__(self, "weights", given)

    def first_mesh(self) -> RevolutionMesh:
        """Steps as long as they can possibly be."""
        coefficients = self.equation.a
        size = np.abs(np.linalg.eigvals(coefficients.constant)).max()
        for modulation, matrix in coefficients.terms:
            reach = np.abs(modulation.at(np.linspace(0.0, self.equation.tau, 256))).max()
            size = max(size, np.abs(np.linalg.eigvals(coefficients.constant + reach * matrix)).max())
        longest = self.equation.tau if size == 0 else min(self.equation.tau, _FIRST_STEP / size)
        return self._within_reason(RevolutionMesh.uniform(self.equation.pieces, longest))

    def next_revolution(self, before: Revolution, start: np.ndarray | None = None) -> Revolution:
        """The revolution after `before`, on its steps or, where the error asks for it, on shorter ones.

        Parameters
        ----------
        start
            State at its beginning, shape (d,); that at the end of `before` where left out.

        Raises
        ------
        TooMuchWork
            When the tolerance takes more than `MOST_STEPS` steps.
        InvalidInput
            When the motion grows beyond all numbers.
        """
        mesh, beginning = before.mesh, before.ends[-1] if start is None else start
        weights = np.ones(self.equation.size) if self.weights is None else self.weights
        for _ in range(_MOST_TRIES):
            checkpoint()
            found, error = self.over(mesh, before, beginning)
            if not (np.isfinite(found.ends).all() and np.isfinite(error).all()):
                remedy = "the motion grows beyond all numbers: ask for fewer revolutions or a smaller ke"
                raise InvalidInput("revolutions", "overflow", remedy)
            allowed = self.rtol * max((weights * found.largest).max(), (weights * before.largest).max())
            excess = 0.0 if allowed == 0 else (weights * error).max(axis=1) / allowed
            if np.all(excess <= 1.0):
                return found
            parts = np.ceil(_SAFETY * np.maximum(excess, 1e-30) ** (1 / ERROR_ORDER))
            parts = np.where(excess <= 1.0, 1, np.clip(parts, 2, _MOST_PARTS)).astype(int)
            mesh = self._within_reason(mesh.cut(parts))
        raise TooMuchWork("rtol", self.rtol, "the steps do not get short enough: give a larger tolerance")

    def over(
        self, mesh: RevolutionMesh, before: Revolution, start: np.ndarray
    ) -> tuple[Revolution, np.ndarray]:
        """A revolution over given steps, and the estimated error of each, shape (steps, d)."""
        past = before.at_stages(mesh, self.memory)
        ends, dense, error = self.kernel(mesh, start, past)
        return Revolution(mesh, ends, dense), np.abs(error)

    def kernel(
        self, mesh: RevolutionMesh, start: np.ndarray, past: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`one_revolution` of this equation; `past` holds its coordinates `memory`, shape (steps, 16, q)."""
        a, b = self._coefficients
        return one_revolution(
            mesh.steps,
            np.ascontiguousarray(start, dtype=float),
            np.ascontiguousarray(past),
            self._modulation(mesh),
            a,
            b,
            self.memory,
        )

    @cached_property
    def memory(self) -> np.ndarray:
        """Coordinates whose past matters, shape (q,)."""
        return self.equation.memory

    @cached_property
    def _terms(self) -> list[tuple[Modulation, np.ndarray, np.ndarray]]:
        """Each factor that varies, with what it multiplies in A and in B."""
        zero = np.zeros_like(self.equation.a.constant)
        found: list[tuple[Modulation, np.ndarray, np.ndarray]] = []
        for factor, matrix in self.equation.a.terms:
            found.append((factor, matrix, zero))
        for factor, matrix in self.equation.b.terms:
            same = next((i for i, term in enumerate(found) if term[0] is factor), None)
            if same is None:
                found.append((factor, zero, matrix))
            else:
                found[same] = (factor, found[same][1], found[same][2] + matrix)
        return found

    @cached_property
    def _coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        """Matrices of the constant term and of every one that varies, of A and of B, each (k, d, d)."""
        a, b = self.equation.a.constant, self.equation.b.constant
        return np.array([a, *(t[1] for t in self._terms)]), np.array([b, *(t[2] for t in self._terms)])

    def _modulation(self, mesh: RevolutionMesh) -> np.ndarray:
        times = mesh.inner_times
        kept = self.__dict__.setdefault("_kept_modulation", {})
        if kept.get("mesh") is not mesh:
            kept["values"] = np.array(
                [np.ones_like(times), *(factor.at(times) for factor, *_ in self._terms)]
            )
            kept["mesh"] = mesh
        return kept["values"]

    @staticmethod
    def _within_reason(mesh: RevolutionMesh) -> RevolutionMesh:
        if len(mesh.steps) > MOST_STEPS:
            found = f"{len(mesh.steps)} steps a revolution"
            remedy = f"at most {MOST_STEPS} are taken: raise the speed, leave out high modes, or loosen rtol"
            raise TooMuchWork("rtol", found, remedy)
        return mesh

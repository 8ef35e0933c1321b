"""Floquet multipliers as the eigenvalues of the map that integration over one revolution is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from sdm_core.delay_equation import DelayEquation
from sdm_core.errors import TooMuchWork
from sdm_core.interruption import checkpoint
from sdm_core.time_domain.method_of_steps import RTOL, MethodOfSteps
from sdm_core.time_domain.revolution import Revolution
from sdm_core.time_domain.revolution_mesh import RevolutionMesh
from sdm_core.time_domain.runge_kutta import ALL_STAGES, AT_NODES
from sdm_core.validation import whole

_SETTLING = 3  # revolutions whose errors choose the steps
_SUBSPACE = 40
_SMALL = 64  # below, the map is a matrix
MOST_MODES = 100
_RESTARTS = 400
_ACCURACY = 1e-10  # of Arnoldi's method, relative


@dataclass(frozen=True)
class FloquetMode:
    """A motion that is multiplied by μ each revolution.

    Attributes
    ----------
    multiplier
        μ.
    error_estimate
        |Δμ| when every step is cut in two.
    real, imaginary
        The motion over one revolution; after it, both are multiplied by μ.
    """

    multiplier: complex
    error_estimate: float
    real: Revolution
    imaginary: Revolution

    @property
    def growth_per_revolution(self) -> float:
        """ln |μ|."""
        return float(np.log(abs(self.multiplier)))

    def at(self, times: np.ndarray) -> np.ndarray:
        """Complex states at times in [0, τ], s, shape (m,); (m, d)."""
        return self.real.at(times) + 1j * self.imaginary.at(times)


def leading_floquet_modes(
    equation: DelayEquation,
    count: int = 4,
    *,
    weights: np.ndarray | None = None,
    rtol: float = RTOL,
    seed: int = 0,
) -> list[FloquetMode]:
    """The Floquet modes with the largest |μ|, largest first; of a complex pair the one with Im μ > 0.

    The map takes the state and the remembered coordinates at the stages of one revolution to those of the
    next. Its leading eigenvalues come from Arnoldi's method (ARPACK), which only asks for revolutions to be
    integrated. Once more on steps half as long they give the error.

    Raises
    ------
    InvalidInput
        When `count` is out of range, or `rtol`, `weights` or `equation` are none.
    TooMuchWork
        When the method does not converge, or the tolerance takes too many steps.
    """
    count, seed = whole("count", count, 1, MOST_MODES), whole("seed", seed, 0, 2**63)
    method = MethodOfSteps(equation, weights, rtol)
    coarse_map = RevolutionMap(method, _settled_mesh(method, seed))
    fine_map = RevolutionMap(method, coarse_map.mesh.cut(np.full(len(coarse_map.mesh.steps), 2)))
    coarse, _ = coarse_map.leading(count, seed)
    multipliers, vectors = fine_map.leading(count, seed)
    found = []
    for multiplier, vector in zip(multipliers, vectors, strict=True):
        if multiplier.imag < -1e-10 * abs(multiplier):
            continue
        error = float(np.abs(coarse - multiplier).min())
        motion = (fine_map.revolution_after(part) for part in (vector.real, vector.imag))
        found.append(FloquetMode(complex(multiplier), error, *motion))
    return sorted(found, key=lambda mode: -abs(mode.multiplier))[:count]


class RevolutionMap:
    """The linear map over one revolution, on fixed steps.

    A vector is the state at the end of a revolution, (d,), then the remembered coordinates at the stages of
    all of its steps, (steps, 16, q).
    """

    def __init__(self, method: MethodOfSteps, mesh: RevolutionMesh) -> None:
        self.method, self.mesh = method, mesh
        self._size = method.equation.size
        self._past = (len(mesh.steps), ALL_STAGES, len(method.memory))
        self.length = self._size + int(np.prod(self._past))

    def __call__(self, vector: np.ndarray) -> np.ndarray:
        """The vector a revolution later."""
        checkpoint()
        ends, dense = self._integrated(vector)
        memory = self.method.memory
        past = np.einsum("st,ktd->ksd", AT_NODES, dense[:, :, memory]) + ends[:-1, None, memory]
        return np.concatenate([ends[-1], past.ravel()])

    def leading(self, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues of largest modulus, and their vectors as rows."""
        if self.length <= _SMALL:
            matrix = np.array([self(unit) for unit in np.eye(self.length)]).T
            values, vectors = np.linalg.eig(matrix)
            order = np.argsort(-np.abs(values))[: 2 * count + 2]
            return values[order], vectors.T[order]
        wanted = min(2 * count + 2, self.length - 2)
        operator = LinearOperator((self.length, self.length), matvec=self, dtype=float)
        begin = np.random.default_rng(seed).normal(size=self.length)
        # Twice through the map: what no motion can be is gone from the start.
        begin = self(self(begin))
        try:
            values, vectors = eigs(
                operator,
                wanted,
                v0=begin,
                ncv=min(self.length, max(_SUBSPACE, 2 * wanted)),
                maxiter=_RESTARTS,
                tol=_ACCURACY,
            )
        except ArpackNoConvergence as error:
            found = f"{len(error.eigenvalues)} of {wanted} multipliers after {_RESTARTS} restarts"
            raise TooMuchWork("count", found, "ask for fewer multipliers") from None
        order = np.argsort(-np.abs(values))
        return values[order], vectors.T[order]

    def revolution_after(self, vector: np.ndarray) -> Revolution:
        """The revolution after a vector."""
        return Revolution(self.mesh, *self._integrated(vector))

    def _integrated(self, vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        past = vector[self._size :].reshape(self._past)
        ends, dense, _ = self.method.kernel(self.mesh, vector[: self._size], past)
        return ends, dense


def _settled_mesh(method: MethodOfSteps, seed: int) -> RevolutionMesh:
    """Steps short enough for the tolerance, after a few revolutions in which every mode takes part."""
    weights = np.ones(method.equation.size) if method.weights is None else method.weights
    state = np.random.default_rng(seed).normal(size=method.equation.size) / weights
    revolution = Revolution.constant(method.first_mesh(), state)
    for _ in range(_SETTLING):
        revolution = method.next_revolution(revolution)
    return revolution.mesh

"""Semi-discretization of high order: the delayed state interpolated through Gauss points of a step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import factorial

import numpy as np

from sdm_core.delay_equation import DelayEquation
from sdm_core.errors import InvalidInput
from sdm_core.floquet.arc_propagation import exponentials
from sdm_core.semi_discretization.step_grid import StepGrid
from sdm_core.semi_discretization.step_maps import StepMaps
from sdm_core.semi_discretization.structured import Structured

NODES = (1, 6)
_EXTRA = 2  # collocation points beyond the nodes: their error is two orders h² below that of the history
_AT_ONCE = 2_000_000  # entries of the collocation matrices solved at once


@dataclass(frozen=True)
class Gauss(Structured):
    """Order 2q from q Gauss points a step, on steps that no break of the coefficients cuts.

    Over a step the delayed contact displacement is the polynomial of degree q − 1 through its values
    at the Gauss points c_1, ..., c_q, which are what the step keeps; the motion itself is solved
    exactly (constant coefficients) or by collocation of order 2q + 4. What the polynomial misses
    is orthogonal to polynomials of degree q − 1, so that the error at the ends of steps, and with
    it that of the multipliers, is of order h^{2q} (superconvergence: de Boor and Swartz,
    SIAM J. Numer. Anal. 10, 1973; eigenvalues of such projections: Osborn, Math. Comp. 29, 1975).

    Parameters
    ----------
    steps
        N a revolution, 2 to 1,000,000; each smooth piece has its share, and one at least.
    nodes
        q, 1 to 6.

    Examples
    --------
    >>> from sdm_core.delay_equation import delayed_mathieu
    >>> mu = Gauss(20).multipliers(delayed_mathieu(3.0, 2.0, -0.15, 0.1))
    >>> round(float(abs(mu[0])), 6)
    0.512052
    """

    nodes: int = 3

    def __post_init__(self) -> None:
        super().__post_init__()
        whole = isinstance(self.nodes, int) and not isinstance(self.nodes, bool)
        if not whole or not NODES[0] <= self.nodes <= NODES[1]:
            raise InvalidInput("nodes", self.nodes, f"give a whole number from {NODES[0]} to {NODES[1]}")

    @property
    def order(self) -> int:
        return 2 * self.nodes

    @property
    def values_a_step(self) -> int:
        return self.nodes

    def grid(self, equation: DelayEquation) -> StepGrid:
        return StepGrid.aligned(equation, self.steps)

    def coefficients(self, equation: DelayEquation, grid: StepGrid) -> tuple[np.ndarray, np.ndarray]:
        if equation.is_constant:
            return equation.a.constant[None, None], equation.b.constant[None, None]
        times = grid.start[:, None] + grid.length[:, None] * _gauss(self.nodes + _EXTRA)
        shape = (*times.shape, equation.size, equation.size)
        return equation.a.at(times.ravel()).reshape(shape), equation.b.at(times.ravel()).reshape(shape)

    def step_maps(self, a: np.ndarray, b: np.ndarray, length: np.ndarray, contact: np.ndarray) -> StepMaps:
        constant = (a == a[:, :1]).all(axis=(1, 2, 3)) & (b == b[:, :1]).all(axis=(1, 2, 3))
        d, r = b.shape[-2:]
        at = np.empty((len(a), self.nodes + 1, d, d + self.nodes * r))  # of (z_0, v at the nodes)
        if constant.any():
            at[constant] = self._exact(a[constant, 0], b[constant, 0], length[constant])
        varying = np.flatnonzero(~constant)
        chunk = max(1, _AT_ONCE // ((self.nodes + _EXTRA) * (d + r)) ** 2)
        for i in range(0, len(varying), chunk):
            rows = varying[i : i + chunk]
            at[rows] = self._collocated(a[rows], b[rows], length[rows])
        stages = (contact @ at[:, :-1]).reshape(len(a), self.nodes * r, d + self.nodes * r)
        return StepMaps(at[:, -1, :, :d], at[:, -1, :, d:], stages[:, :, :d], stages[:, :, d:])

    def _exact(self, a: np.ndarray, b: np.ndarray, length: np.ndarray) -> np.ndarray:
        """z at the nodes and the end, (K, q + 1, d, d + qr): z driven by v and the derivatives of v."""
        q, (d, r) = self.nodes, b.shape[-2:]
        bordered = np.zeros((len(a), d + q * r, d + q * r))
        bordered[:, :d, :d], bordered[:, :d, d : d + r] = a, b
        bordered *= length[:, None, None]
        bordered[:, d : d + (q - 1) * r, d + r :] = np.eye((q - 1) * r)
        ends = np.append(_gauss(q), 1.0)
        grown = exponentials((bordered[:, None] * ends[:, None, None]).reshape(-1, d + q * r, d + q * r))
        grown = grown.reshape(len(a), q + 1, d + q * r, d + q * r)[:, :, :d]
        jets = np.kron(_jets(q), np.eye(r))
        return np.concatenate([grown[..., :d], grown[..., d:] @ jets], axis=-1)

    def _collocated(self, a: np.ndarray, b: np.ndarray, length: np.ndarray) -> np.ndarray:
        """The same with varying coefficients: ż a polynomial through m = q + 2 Gauss points."""
        k, m, d, r = b.shape
        q = self.nodes
        to_points, to_ends, interpolated = _collocation(m, q)
        # ż_j = A_j (z_0 + h Σ_l Q_jl ż_l) + B̂_j Σ_i ℓ_i(c_j) v_i, solved for ż.
        implicit = np.eye(m * d) - (
            length[:, None, None, None, None] * to_points[:, None, :, None] * a[:, :, :, None, :]
        ).reshape(k, m * d, m * d)
        forced = (b[:, :, :, None, :] * interpolated[:, None, :, None]).reshape(k, m * d, q * r)
        given = np.concatenate([a.reshape(k, m * d, d), forced], axis=-1)
        slope = np.linalg.solve(implicit, given).reshape(k, m, -1)
        out = length[:, None, None] * (to_ends @ slope)
        out = out.reshape(k, q + 1, d, d + q * r)
        out[..., :d] += np.eye(d)
        return out


@cache
def _gauss(points: int) -> np.ndarray:
    """Gauss points of [0, 1]."""
    return (np.polynomial.legendre.leggauss(points)[0] + 1) / 2


@cache
def _jets(points: int) -> np.ndarray:
    """Derivatives 0 ... q − 1 at the start of a step from values at its Gauss points, shape (q, q)."""
    powers = np.array([1.0 / factorial(j) for j in range(points)])
    return np.linalg.inv(_gauss(points)[:, None] ** np.arange(points) * powers)


@cache
def _collocation(points: int, nodes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integrals of the Lagrange polynomials of m points to the points, and to the nodes and the end; and

    the Lagrange polynomials of the nodes at the points: shapes (m, m), (q + 1, m), (m, q).
    """
    at = 2 * _gauss(points) - 1
    legendre = np.polynomial.legendre
    to_coefficients = np.linalg.inv(legendre.legvander(at, points - 1))
    integrals = legendre.legint(np.eye(points), lbnd=-1) @ to_coefficients / 2
    ends = np.append(2 * _gauss(nodes) - 1, 1.0)
    lagrange = legendre.legvander(at, nodes - 1) @ np.linalg.inv(
        legendre.legvander(2 * _gauss(nodes) - 1, nodes - 1)
    )
    return legendre.legvander(at, points) @ integrals, legendre.legvander(ends, points) @ integrals, lagrange

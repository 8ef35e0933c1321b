"""Chebyshev collocation of the monodromy operator (DESIGN, facts 3 and 4).

It shares nothing with the characteristic equation, the closed form or semi-discretization, so that it
can bear witness for them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.linalg import expm, matrix_balance
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from sdm_core.delay_equation import DelayEquation
from sdm_core.errors import InvalidInput, TooMuchWork
from sdm_core.interruption import checkpoint
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.validation import number

LARGEST_DENSE = 4000  # rows: 128 MB, a minute or two
LARGEST_STATE = 200_000  # rows, where the operator is only applied
LARGEST_MAPS = 30_000_000  # entries of all panel maps: 240 MB
ORDERS = (4, 128)
_SMALL = 500  # rows up to which all eigenvalues cost less than the Krylov iteration for a few


@dataclass(frozen=True)
class Collocation:
    """Multipliers of ż = A(t)z(t) + B(t)z(t − τ), the coefficients smooth between breaks.

    Let the rows of C span the row spaces of all matrices of B, so that B(t) = B̂(t)C. A revolution is
    decided by z(0) and by the history u = Cz wherever B ≠ 0: the monodromy operator maps
    (z(0), u on [−τ, 0]) to the same of the next revolution. Each smooth interval is cut into
    panels; on a panel of length h, ż is a polynomial through the Chebyshev points t_1, ..., t_m,

        z_j = z_start + (h/2) Σ_k Q_jk f_k,    z_end = z_start + (h/2) Σ_k q_k f_k,
        f_k = A(t_k) z_k + B̂(t_k) u(t_k − τ),

    Q the integrals of the Lagrange polynomials from −1 to the points and q those to 1. An interval
    with B = 0 and constant A is one matrix exponential and has no history. The error falls
    faster than any power of 1/m (Bueler, SIAM J. Numer. Anal. 45, 2007, for one panel; fact 4).

    Parameters
    ----------
    order
        m, points a panel, 4 to 128.
    panel_rad
        Longest panel: phase in rad of the fastest oscillation of ż = (A ± B)z over it. Of e^{ikx},
        k half of that phase, m points miss about J_m(k): 1e-20 at the defaults.

    Examples
    --------
    >>> from sdm_core.delay_equation import delayed_mathieu
    >>> mu = Collocation().multipliers(delayed_mathieu(3.0, 2.0, -0.15, 0.1), 2)
    >>> round(float(abs(mu[0])), 6)
    0.512052
    """

    order: int = 32
    panel_rad: float = 12.0

    def __post_init__(self) -> None:
        low, high = ORDERS
        whole = isinstance(self.order, int) and not isinstance(self.order, bool)
        if not whole or not low <= self.order <= high:
            raise InvalidInput("order", self.order, f"give a whole number of points from {low} to {high}")
        number("panel_rad", self.panel_rad, 0.1, 100.0, "rad")

    def doubled(self) -> Collocation:
        """Twice the points a panel: the difference of the two answers estimates the error."""
        return replace(self, order=2 * self.order)

    def multipliers(self, problem: RubbingBlade | DelayEquation, count: int | None = None) -> np.ndarray:
        """Floquet multipliers, largest modulus first.

        Parameters
        ----------
        count
            How many; None means all that the discretized operator has, of which the small are not
            converged.

        Raises
        ------
        InvalidInput
            For an unusable count.
        TooMuchWork
            When a revolution has too many oscillations or overflows, or the eigenvalues do not converge.
        """
        equation = problem.delay_equation() if isinstance(problem, RubbingBlade) else problem
        if count is not None and not (isinstance(count, int | np.integer) and count >= 1):
            raise InvalidInput("count", count, "give a whole number from 1 up, or None for all")
        operator = _Monodromy(equation, self)
        few = count is not None and operator.size > max(_SMALL, 4 * count)
        found = operator.leading(int(count)) if few and count is not None else operator.eigenvalues()
        return found[np.argsort(-np.abs(found), kind="stable")][:count]


@dataclass(frozen=True)
class _Panel:
    """The map (z_start, u at the points a revolution ago) → (z_end, u at the points)."""

    matrix: np.ndarray
    nodes: int  # 0 for an interval without history


class _Monodromy:
    """The operator on (z(0), u at the points of every panel with B ≠ 0), applied panel by panel."""

    def __init__(self, equation: DelayEquation, method: Collocation) -> None:
        self._equation, self._method = equation, method
        # Displacements and velocities differ by powers of ten; powers of two even them out exactly.
        mean_a, mean_b = equation.means(np.zeros(1), np.full(1, equation.tau))
        _, (scale, _) = matrix_balance(np.abs(mean_a[0]) + np.abs(mean_b[0]), permute=False, separate=True)
        self._similar = scale[None, :] / scale[:, None]
        stacked = np.vstack([equation.b.constant, *(m for _, m in equation.b.terms)])
        _, strength, rows = np.linalg.svd(stacked * np.tile(self._similar, (len(stacked) // len(scale), 1)))
        self._history = rows[: np.count_nonzero(strength > 1e-13 * strength.max(initial=0.0))]
        self._panels = self._made()
        self.size = equation.size + len(self._history) * sum(panel.nodes for panel in self._panels)

    def apply(self, state: np.ndarray) -> np.ndarray:
        """One revolution of each column, shape (size, columns)."""
        checkpoint()
        d, rows = self._equation.size, len(self._history)
        out = np.empty_like(state)
        z, at = state[:d], d
        for panel in self._panels:
            until = at + rows * panel.nodes
            moved = panel.matrix @ np.concatenate([z, state[at:until]])
            z, out[at:until] = moved[:d], moved[d:]
            at = until
        out[:d] = z
        return out

    def eigenvalues(self) -> np.ndarray:
        """All of them, from the dense matrix."""
        if self.size > LARGEST_DENSE:
            raise TooMuchWork(
                "count", None, f"name a count: the operator has {self.size} rows, {LARGEST_DENSE} is the most"
            )
        matrix = np.hstack(
            [self.apply(np.eye(self.size, min(200, self.size - i), k=-i)) for i in range(0, self.size, 200)]
        )
        return np.linalg.eigvals(self._finite(matrix))

    def leading(self, count: int) -> np.ndarray:
        """At least `count` of largest modulus, by Arnoldi iteration."""
        self._finite(self.apply(np.ones((self.size, 1))))
        operator = LinearOperator(
            (self.size, self.size), matvec=lambda s: self.apply(s.reshape(-1, 1))[:, 0], dtype=float
        )
        wanted = count + 2  # that no conjugate pair is cut in two
        start = np.random.default_rng(0).standard_normal(self.size)
        try:
            return eigs(
                operator, wanted, ncv=6 * wanted + 40, v0=start, maxiter=200, return_eigenvectors=False
            )
        except ArpackNoConvergence:
            if self.size <= LARGEST_DENSE:
                return self.eigenvalues()
            raise self._too_much("the leading multipliers lie too close together") from None

    def _made(self) -> list[_Panel]:
        ends = self._equation.pieces
        plan = [(start, end, self._cuts(start, end)) for start, end in pairwise(ends)]
        d, m, rows = self._equation.size, self._method.order, len(self._history)
        state = d + rows * m * sum(cuts for *_, cuts in plan)
        if state > LARGEST_STATE:
            raise self._too_much(f"its oscillations take {state} unknowns, {LARGEST_STATE} is the most")
        panels: list[_Panel] = []
        known: dict[tuple[float, bytes], _Panel] = {}
        entries = 0
        for start, end, cuts in plan:
            if not cuts:
                a, _ = self._coefficients(start, end)
                with np.errstate(over="ignore"):  # seen by _finite
                    panels.append(_Panel(expm(a[0] * (end - start)), 0))
            h = (end - start) / max(cuts, 1)
            for i in range(cuts):
                checkpoint()
                a, b = self._coefficients(start + i * h, start + (i + 1) * h)
                if _constant(a) and _constant(b):
                    key = (h, a[0].tobytes() + b[0].tobytes())
                    panel = known.get(key) or known.setdefault(key, self._collocated(a, b, h))
                else:
                    panel = self._collocated(a, b, h)
                    entries += panel.matrix.size
                if entries > LARGEST_MAPS:
                    raise self._too_much("the maps of its panels take too much memory at this order")
                panels.append(panel)
        return panels

    def _cuts(self, start: float, end: float) -> int:
        """Panels of a smooth interval; 0 where one matrix exponential crosses it."""
        a, b = self._coefficients(start, end)
        if _constant(a) and _constant(b):
            if not b.any():
                return 0
            a, b = a[:1], b[:1]
        # With multiplier μ the motion obeys ż = (A + B/μ)z; those near |μ| = 1 are wanted.
        past = b @ self._history
        rates = np.linalg.eigvals(np.concatenate([a, a + past, a - past]))
        phase = np.abs(rates).max() * (end - start) / self._method.panel_rad
        return max(1, int(np.ceil(min(phase, LARGEST_STATE))))

    def _coefficients(self, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
        """A and B̂ at the Chebyshev points of an interval, balanced, shapes (m, d, d) and (m, d, p)."""
        points, *_ = _integration(self._method.order)
        t = start + (end - start) * (points + 1) / 2
        a, b = self._equation.a.at(t) * self._similar, self._equation.b.at(t) * self._similar
        return a, b @ self._history.T

    def _collocated(self, a: np.ndarray, b: np.ndarray, h: float) -> _Panel:
        """The panel's map from A and B̂ at its points, and its length h in s."""
        _, to_points, to_end = _integration(self._method.order)
        q, q_end = to_points * h / 2, to_end * h / 2
        m, d, rows = b.shape
        implicit = np.eye(m * d) - np.einsum("jk,kab->jakb", q, a).reshape(m * d, m * d)
        forced = np.einsum("jk,kac->jakc", q, b).reshape(m * d, m * rows)
        z = np.linalg.solve(implicit, np.hstack([np.tile(np.eye(d), (m, 1)), forced])).reshape(m, d, -1)
        end = np.einsum("k,kab,kbs->as", q_end, a, z)
        end[:, :d] += np.eye(d)
        end[:, d:] += np.einsum("k,kac->akc", q_end, b).reshape(d, m * rows)
        return _Panel(np.vstack([end, (self._history @ z).reshape(m * rows, -1)]), m)

    def _finite(self, found: np.ndarray) -> np.ndarray:
        if not np.isfinite(found).all():
            raise self._too_much("motion overflows within one revolution")
        return found

    def _too_much(self, why: str) -> TooMuchWork:
        return TooMuchWork("tau", float(self._equation.tau), f"shorten the delay: {why}")


@cache
def _integration(order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Chebyshev points x in (−1, 1) ascending; Q, integrals of the Lagrange polynomials to them; q, to 1.

    Points of the first kind lie inside, where the coefficients have one value at a break too.
    """
    points = -np.cos((2 * np.arange(order) + 1) * np.pi / (2 * order))
    basis = np.polynomial.chebyshev.chebvander(points, order - 1)
    to_coefficients = 2.0 / order * basis.T  # discrete orthogonality
    to_coefficients[0] /= 2
    integrals = np.polynomial.chebyshev.chebint(np.eye(order), lbnd=-1) @ to_coefficients
    ends = np.polynomial.chebyshev.chebvander(np.r_[points, 1.0], order) @ integrals
    return points, ends[:-1], ends[-1]


def _constant(values: np.ndarray) -> bool:
    return bool((values == values[0]).all())

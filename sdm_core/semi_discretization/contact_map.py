"""The monodromy operator on the contact history: applied in O(N), or reduced to the size of the state."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from sdm_core.errors import TooMuchWork
from sdm_core.interruption import checkpoint
from sdm_core.semi_discretization.step_maps import StepMaps

LARGEST_DENSE = 2000  # rows up to which the Krylov iteration may fall back on all eigenvalues
_SMALL = 300  # rows up to which all eigenvalues cost less than the Krylov iteration for a few
_ENTRIES = 500_000  # of the arrays of one chunk: 8 MB complex


@dataclass(frozen=True)
class ContactMap:
    """(z_0, w of the engaged steps) → the same a revolution later.

    Only the contact displacements over engaged steps have memory (DESIGN, fact 3), so the state has
    d + s·(engaged steps) entries, and one application takes O(N) operations instead of a product
    with a matrix. Its eigenvalues are the multipliers of the scheme that are not zero.

    Attributes
    ----------
    steps
        The different steps.
    kind, repeat
        A revolution as runs: index into `steps` and number of equal steps, shapes (runs,).
    """

    steps: StepMaps
    kind: np.ndarray
    repeat: np.ndarray

    @property
    def size(self) -> int:
        """Entries of the state."""
        stages = self.steps.y.shape[-1]
        return self.steps.p.shape[-1] + stages * int(self.repeat @ self.steps.engaged[self.kind])

    # One revolution of a vector ------------------------------------------------------------------

    def apply(self, states: np.ndarray) -> np.ndarray:
        """One revolution of each column, shape (size, columns).

        z_{i+1} = P_i z_i + f_i is solved in √N blocks side by side from z = 0, and what each block
        starts from is added by the products of its P_i: √N vector operations instead of N.
        """
        checkpoint()
        scan = self._scan
        d, stages = self.steps.p.shape[-1], self.steps.y.shape[-1]
        columns = states.shape[1]
        past = states[d:].reshape(len(scan.engaged), stages, columns)
        force = np.zeros((*scan.step.shape[:2], d, columns))
        force.reshape(-1, d, columns)[scan.engaged] = self.steps.r[scan.kind] @ past
        moved = force  # filled in place
        for j in range(1, force.shape[1]):
            moved[:, j] += scan.step[:, j] @ moved[:, j - 1]
        starts = np.empty((len(force), 1, d, columns))
        z = states[:d]
        for i in range(len(force)):
            starts[i, 0] = z
            z = scan.product[i, -1] @ z + moved[i, -1]
        before = np.concatenate([starts, moved[:, :-1] + scan.product[:, :-1] @ starts], axis=1)
        before = before.reshape(-1, d, columns)[scan.engaged]
        kept = self.steps.x[scan.kind] @ before + self.steps.y[scan.kind] @ past
        return np.concatenate([z, kept.reshape(-1, columns)])

    def matrix(self) -> np.ndarray:
        """The operator as a matrix, shape (size, size)."""
        size = self.size
        return np.hstack([self.apply(np.eye(size, min(50, size - i), k=-i)) for i in range(0, size, 50)])

    def eigenvalues(self, count: int) -> np.ndarray:
        """At least `count` of largest modulus, or all there are: dense, or by Arnoldi iteration.

        Raises
        ------
        TooMuchWork
            When motion overflows within one revolution, or the iteration does not converge.
        """
        with np.errstate(all="ignore"):
            finite = np.isfinite(self.apply(np.ones((self.size, 1)))).all()
        if not finite:
            raise TooMuchWork("steps", self.size, "shorten the delay: motion overflows within a revolution")
        if self.size <= max(_SMALL, 4 * count):
            return np.linalg.eigvals(self.matrix())
        operator = LinearOperator(
            (self.size, self.size), matvec=lambda v: self.apply(v.reshape(-1, 1))[:, 0], dtype=float
        )
        wanted = count + 2  # that no conjugate pair is cut in two
        first = np.random.default_rng(0).standard_normal(self.size)
        subspace = min(self.size, 4 * wanted + 30)
        try:
            return eigs(operator, wanted, ncv=subspace, v0=first, maxiter=100, return_eigenvectors=False)
        except ArpackNoConvergence:
            if self.size <= LARGEST_DENSE:
                return np.linalg.eigvals(self.matrix())
            raise TooMuchWork("count", count, "ask for fewer: they lie too close together") from None

    @cached_property
    def _scan(self) -> _Scan:
        kind = np.repeat(self.kind, self.repeat)
        d = self.steps.p.shape[-1]
        length = max(1, int(np.sqrt(len(kind))))
        blocks = -(-len(kind) // length)
        flat = np.empty((blocks * length, d, d))
        flat[: len(kind)] = self.steps.p[kind]
        flat[len(kind) :] = np.eye(d)
        step = flat.reshape(blocks, length, d, d)
        product = step.copy()
        with np.errstate(all="ignore"):
            for j in range(1, length):
                product[:, j] = step[:, j] @ product[:, j - 1]
        engaged = np.flatnonzero(self.steps.engaged[kind])
        return _Scan(step, product, engaged, kind[engaged])

    # The same, reduced to d equations in u = 1/μ ----------------------------------------------------

    def reduced(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """M(u) = S_{N−1}(u) ... S_0(u), shape (k, d, d), and Π det(I − uY_i), shape (k,).

        det(I − uΦ) of the monodromy matrix Φ is det(I − uM(u)) Π det(I − uY_i), a polynomial. Runs of
        equal steps are powers, by repeated squaring; others are multiplied in pairs.
        """
        d, stages = self.steps.p.shape[-1], self.steps.y.shape[-1]
        at_once = max(1, _ENTRIES // (d * d + stages * (d + stages)))
        if len(u) > 1 and len(u) * min(len(self.kind), at_once) > at_once:
            chunk = max(1, at_once // len(self.kind))
            parts = [self.reduced(u[i : i + chunk]) for i in range(0, len(u), chunk)]
            return np.concatenate([m for m, _ in parts]), np.concatenate([c for _, c in parts])
        out = np.broadcast_to(np.eye(d, dtype=complex), (len(u), d, d))
        log_pivot = np.zeros(len(u), dtype=complex)
        with np.errstate(all="ignore"):  # where u is huge entries overflow: callers look at the result
            for i in range(0, len(self.kind), at_once):
                checkpoint()
                repeat = self.repeat[i : i + at_once]
                factors, pivot = self.steps[self.kind[i : i + at_once]].reduced(u)
                for j in np.flatnonzero(repeat > 1):
                    factors[:, j] = np.linalg.matrix_power(factors[:, j], int(repeat[j]))
                log_pivot += np.log(pivot) @ repeat
                out = _product(factors) @ out
            return out, np.exp(log_pivot)

    def determinant(self, u: np.ndarray) -> np.ndarray:
        """det(I − uΦ), shape (k,): a polynomial in u whose zeros are 1/μ."""
        m, pivots = self.reduced(u)
        with np.errstate(all="ignore"):
            return np.linalg.det(np.eye(m.shape[-1]) - u[:, None, None] * m) * pivots


@dataclass(frozen=True)
class _Scan:
    """P_i and their products within blocks, shapes (blocks, length, d, d); the engaged steps."""

    step: np.ndarray
    product: np.ndarray
    engaged: np.ndarray
    kind: np.ndarray


def _product(factors: np.ndarray) -> np.ndarray:
    """factors[:, −1] ... factors[:, 0], shape (k, d, d), from (k, steps, d, d)."""
    while factors.shape[1] > 1:
        even = factors.shape[1] // 2 * 2
        pairs = factors[:, 1:even:2] @ factors[:, 0:even:2]
        factors = np.concatenate([pairs, factors[:, even:]], axis=1)
    return factors[:, 0]

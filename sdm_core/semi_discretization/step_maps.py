"""One step of semi-discretization as a linear map, and the coordinates it is written in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import matrix_balance

from sdm_core.delay_equation import DelayEquation


@dataclass(frozen=True)
class ContactCoordinates:
    """Balanced state, and the r combinations of it whose past matters: B(t) = B̂(t) C.

    Displacements and velocities differ by powers of ten; a diagonal similarity in powers of two evens
    them out exactly. The rows of C span the row spaces of all matrices of B.

    Attributes
    ----------
    similar
        Factor of each entry of A and B, shape (d, d).
    contact
        C, shape (r, d).
    """

    similar: np.ndarray
    contact: np.ndarray

    @classmethod
    def of(cls, equation: DelayEquation) -> ContactCoordinates:
        mean_a, mean_b = equation.means(np.zeros(1), np.full(1, equation.tau))
        _, (scale, _) = matrix_balance(np.abs(mean_a[0]) + np.abs(mean_b[0]), permute=False, separate=True)
        similar = scale[None, :] / scale[:, None]
        stacked = np.vstack([m * similar for m in (equation.b.constant, *(m for _, m in equation.b.terms))])
        _, strength, rows = np.linalg.svd(stacked)
        return cls(similar, rows[: np.count_nonzero(strength > 1e-13 * strength.max(initial=0.0))])

    def of_coefficients(self, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A and B̂ of stacks of A and B, shapes (..., d, d) and (..., d, r)."""
        return a * self.similar, (b * self.similar) @ self.contact.T


@dataclass(frozen=True)
class StepMaps:
    """K steps: z_{i+1} = P z_i + R w_i with w_i the past contact, V_i = X z_i + Y w_i the new one.

    V_i holds what the scheme keeps of the contact displacements over the step, s numbers; a revolution
    later it acts as w. Where R = 0 the step has no memory.

    Attributes
    ----------
    p, r, x, y
        Shapes (K, d, d), (K, d, s), (K, s, d), (K, s, s).
    """

    p: np.ndarray
    r: np.ndarray
    x: np.ndarray
    y: np.ndarray

    def __len__(self) -> int:
        return len(self.p)

    def __getitem__(self, rows: np.ndarray | slice) -> StepMaps:
        return StepMaps(self.p[rows], self.r[rows], self.x[rows], self.y[rows])

    @classmethod
    def joined(cls, parts: list[StepMaps]) -> StepMaps:
        """All of them in one stack."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in "prxy"))

    @property
    def engaged(self) -> np.ndarray:
        """Which steps feel the past, shape (K,)."""
        return np.abs(self.r).sum(axis=(1, 2)) > 0

    def reduced(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """S(u) = P + uR(I − uY)⁻¹X and det(I − uY), shapes (k, K, d, d) and (k, K), for k values of u.

        A Floquet solution of multiplier μ has w_i = V_i/μ = uV_i, which eliminates V_i.
        """
        stages = self.y.shape[-1]
        if stages == 0:
            return np.broadcast_to(self.p, (len(u), *self.p.shape)).astype(complex), np.ones(
                (len(u), len(self)), dtype=complex
            )
        u = u[:, None, None, None]
        pivot = np.eye(stages) - u * self.y
        if stages == 1:  # the usual case of one contact combination: a division
            return self.p + u * (self.r @ self.x) / pivot, pivot[..., 0, 0]
        kept = np.linalg.solve(pivot, np.broadcast_to(self.x, (len(u), *self.x.shape)))
        return self.p + u * (self.r @ kept), np.linalg.det(pivot)

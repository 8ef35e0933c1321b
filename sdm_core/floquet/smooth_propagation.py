"""Motion over one revolution with smooth engagement: fundamental matrices to rounding, many at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sdm_core.floquet.smooth_revolution import SmoothRevolution
from sdm_core.rubbing_blade import RubbingBlade

_KEPT = 2**25  # entries of all series kept of a batch: 256 MB


@dataclass(frozen=True)
class SmoothPropagation:
    """ẍ + 2ξΛẋ + (Λ² − c γ(Ωt) G) x = 0 over one revolution, γ a Fourier series, for a batch of blades.

    What `ArcPropagation` is for arcs: a Floquet solution of multiplier μ has contact force c γ G x
    with c = K_e(1/μ − 1) (DESIGN, fact 5). The state is (x, ẋ/ω), time is in revolutions. The revolution is
    cut into equal panels; on each the fundamental matrix is a power series in c whose
    coefficients do not depend on c, so that one M(c) is a sum and a product a panel.

    Attributes
    ----------
    angle
        ωτ, rad a revolution, shape (b, n).
    damping_ratio
        ξ, shape (b, n).
    coupling
        G τ/ω, kg^-1 s²; rows divided by ω of that row; shape (b, n, n).
    mean
        Mean of γ, shape (b,).
    revolutions
        One for each problem, b of them.
    """

    angle: np.ndarray
    damping_ratio: np.ndarray
    coupling: np.ndarray
    mean: np.ndarray
    revolutions: tuple[SmoothRevolution, ...] = field(repr=False)

    @classmethod
    def of(cls, problems: Sequence[RubbingBlade]) -> SmoothPropagation:
        """Of problems with equally many modes, each with smooth engagement."""
        omega = np.array([p.omega for p in problems])
        tau = np.array([p.tau for p in problems])
        damping = np.array([p.damping_ratio for p in problems])
        coupling = np.array([p.contact_matrix for p in problems]) * (tau[:, None] / omega)[:, :, None]
        revolutions = []
        extremes = {p.engagement: p.engagement.extremes for p in problems if p.engagement is not None}
        for p in problems:
            assert p.engagement is not None
            factor = p.contact_factor
            if factor.shape[1] == 0:  # no mode moves the contact nodes
                factor = np.zeros((len(p.omega), 1))
            revolutions.append(
                SmoothRevolution(
                    p.omega * p.tau,
                    p.damping_ratio,
                    factor,
                    factor * (p.tau / p.omega)[:, None],
                    p.engagement,
                    extremes[p.engagement][1],
                    min(_KEPT // 8, _KEPT // len(problems)),
                )
            )
        mean = np.array([r.engagement.mean for r in revolutions])
        return cls(omega * tau[:, None], damping, coupling, mean, tuple(revolutions))

    def __getitem__(self, rows: np.ndarray) -> SmoothPropagation:
        numbers = np.arange(len(self))[rows]
        return SmoothPropagation(
            self.angle[rows],
            self.damping_ratio[rows],
            self.coupling[rows],
            self.mean[rows],
            tuple(self.revolutions[i] for i in numbers),
        )

    def __len__(self) -> int:
        return len(self.angle)

    @property
    def size(self) -> int:
        """2n."""
        return 2 * self.angle.shape[1]

    @property
    def phase_shift(self) -> np.ndarray:
        """Σ_j G_jj τ/(2ω_j) × mean γ, m/N, shape (b,), as in `ArcPropagation`."""
        return 0.5 * np.trace(self.coupling, axis1=1, axis2=2) * self.mean

    @property
    def rounding(self) -> np.ndarray:
        """Error of entries of M relative to the largest, what panels miss included, shape (b,)."""
        missed = np.array([r.error for r in self.revolutions])
        return np.finfo(float).eps * (1 + self.angle.max(axis=1)) + missed

    def fundamental(self, case: np.ndarray, c: np.ndarray) -> np.ndarray:
        """M(c) of problem `case` each, shape (k, 2n, 2n); c in N/m, shape (k,).

        NaN where the panels of a revolution would be more than `MOST_PANELS`.
        """
        out = np.empty((len(case), self.size, self.size), dtype=np.result_type(c, float))
        with np.errstate(all="ignore"):  # callers look at the result
            for i in np.unique(case):
                rows = np.flatnonzero(case == i)
                out[rows] = self.revolutions[i].fundamental(c[rows])
        return out

    def displacement(self, case: int, c: complex, state: np.ndarray) -> np.ndarray:
        """Fᵀx at equal times of a revolution from `state` (2n,), fine enough for its motion, shape (s, p)."""
        return self.revolutions[case].displacement(c, state)

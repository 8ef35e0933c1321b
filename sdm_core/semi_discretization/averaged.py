"""Semi-discretization with the delayed state averaged over a step, on the contact history."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.floquet.arc_propagation import exponentials
from sdm_core.semi_discretization.step_maps import StepMaps
from sdm_core.semi_discretization.structured import MeanCoefficients


@dataclass(frozen=True)
class StructuredAveraged(MeanCoefficients):
    """The scheme of [SBL] Eqs. 7-14, with the multipliers of its dense twin `Averaged`.

    Over a step the coefficients are their means (Eq. 10) and the delayed contact displacement the
    average of its values at the ends (Eq. 8), so that this average is all a step has to keep:

        V_i = ½C(z_i + z_{i+1}),  z_{i+1} = P_i z_i + R_i V_{i−N}.

    Second order.

    Parameters
    ----------
    steps
        N, 2 to 1,000,000.
    aligned
        As in `MeanCoefficients`.

    Examples
    --------
    >>> from sdm_core.delay_equation import delayed_mathieu
    >>> mu = StructuredAveraged(2000).multipliers(delayed_mathieu(3.0, 2.0, -0.15, 0.1))
    >>> round(float(abs(mu[0])), 5)
    0.51205
    """

    @property
    def values_a_step(self) -> int:
        return 1

    def step_maps(self, a: np.ndarray, b: np.ndarray, length: np.ndarray, contact: np.ndarray) -> StepMaps:
        # R = ∫₀^h exp(As) ds B̂ from one exponential of a bordered matrix: A may be singular.
        d, r = b.shape[-2:]
        bordered = np.zeros((len(a), d + r, d + r))
        bordered[:, :d, :d], bordered[:, :d, d:] = a[:, 0], b[:, 0]
        grown = exponentials(bordered * length[:, None, None])
        p, past = grown[:, :d, :d], grown[:, :d, d:]
        return StepMaps(p, past, 0.5 * contact @ (np.eye(d) + p), 0.5 * contact @ past)

"""Semi-discretization with the delayed state interpolated linearly over a step, on the contact history."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.floquet.arc_propagation import exponentials
from sdm_core.semi_discretization.step_maps import StepMaps
from sdm_core.semi_discretization.structured import MeanCoefficients


@dataclass(frozen=True)
class Linear(MeanCoefficients):
    """First-order semi-discretization (Insperger, Stépán and Turi 2008), elsewhere also so called.

    Over a step of length h the delayed contact displacement is v_0 + (s/h)(v_1 − v_0), v_0 and v_1 its
    values at the ends, and

        z_{i+1} = P_i z_i + (Φ_0 − Φ_1) v_0 + Φ_1 v_1,
        Φ_j = ∫₀^h exp(A_i(h − s)) (s/h)^j ds B̂_i.

    Second order, as `StructuredAveraged`, with a smaller constant.

    Parameters
    ----------
    steps
        N, 2 to 1,000,000.
    aligned
        As in `MeanCoefficients`.

    Examples
    --------
    >>> from sdm_core.delay_equation import delayed_mathieu
    >>> mu = Linear(2000).multipliers(delayed_mathieu(3.0, 2.0, -0.15, 0.1))
    >>> round(float(abs(mu[0])), 5)
    0.51205
    """

    @property
    def values_a_step(self) -> int:
        return 2

    def step_maps(self, a: np.ndarray, b: np.ndarray, length: np.ndarray, contact: np.ndarray) -> StepMaps:
        # One exponential of z driven by v_0 and by v_1 − v_0, which v_0 grows by over the step.
        d, r = b.shape[-2:]
        bordered = np.zeros((len(a), d + 2 * r, d + 2 * r))
        bordered[:, :d, :d], bordered[:, :d, d : d + r] = a[:, 0], b[:, 0]
        bordered *= length[:, None, None]
        bordered[:, d : d + r, d + r :] = np.eye(r)
        grown = exponentials(bordered)
        p, level, slope = grown[:, :d, :d], grown[:, :d, d : d + r], grown[:, :d, d + r :]
        past = np.concatenate([level - slope, slope], axis=2)
        x = np.concatenate([np.broadcast_to(contact, (len(a), r, d)), contact @ p], axis=1)
        y = np.concatenate([np.zeros((len(a), r, 2 * r)), contact @ past], axis=1)
        return StepMaps(p, past, x, y)

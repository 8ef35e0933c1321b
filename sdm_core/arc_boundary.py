"""Stability boundary with arcs of contact: a scan of K_e, proven counts, Newton on (arg μ, K_e)."""

from __future__ import annotations

import numpy as np

from sdm_core.arc_stability import batch_multipliers
from sdm_core.characteristic import CharacteristicEquation
from sdm_core.closed_form import Crossings
from sdm_core.rubbing_blade import RubbingBlade

SCAN_RATIO = 1.06  # between neighbouring stiffnesses: an island narrower than this can be missed
_BRACKET = 1e-3


def least_destabilising_ke(problem: RubbingBlade) -> float:
    """A K_e, N/m, below which no contact of any arcs is unstable (small-gain theorem).

    The force is −K_e γ (1 − delay) applied to H; γ has gain at most 1 and (1 − delay) at most 2,
    so 2 K_e sup_ω ‖H(iω)‖ < 1 is stable.
    """
    if problem.contact_factor.shape[1] == 0:
        return np.inf
    # ‖H(iω)‖ ≤ Σ_j |h_j(iω)| G_jj, and |h_j| is at most 1/(2ξω²√(1 − ξ²)), or 1/ω² above ξ = 1/√2.
    xi = np.minimum(problem.damping_ratio, np.sqrt(0.5))
    peak = 1.0 / (2 * xi * np.sqrt(1 - xi**2) * problem.omega**2)
    return float(1.0 / (2.0 * (peak * problem.contact_matrix.diagonal()).sum()))


def arc_crossings(problem: RubbingBlade, ke_max: float) -> Crossings:
    """K_e up to `ke_max` at which the blade becomes unstable or stable again, at one speed.

    The verdict is proven by the argument principle at stiffnesses `SCAN_RATIO` apart from the
    small-gain bound up; each change is bracketed and then solved to rounding. Where one of those
    verdicts cannot be decided the crossings are not `proven`.
    """
    low = least_destabilising_ke(problem)
    if low >= ke_max:
        return Crossings(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0))
    low = max(low, 1e-9 * ke_max)
    grid = np.geomspace(low, ke_max, 2 + int(np.log(ke_max / low) / np.log(SCAN_RATIO)))
    verdicts = [_verdict(problem, ke) for ke in grid]
    unstable = [verdict is not False for verdict in verdicts]  # not decided is never called stable
    found = []
    for i in range(len(unstable) - 1):
        if unstable[i] != unstable[i + 1]:
            found.append(_between(problem, grid[i], grid[i + 1], unstable[i + 1]))
    ke, frequency, direction, error = np.array(found).reshape(-1, 4).T
    return Crossings(ke, frequency, direction, error, proven=None not in verdicts)


def _verdict(problem: RubbingBlade, ke: float) -> bool | None:
    """True where the blade is unstable; None where neither K_e nor its neighbours can be decided."""
    for nudge in (0.0, 1e-7, -1e-7, 1e-5):
        count = CharacteristicEquation(problem.with_ke(ke * (1 + nudge))).count_outside()
        if count is not None:
            return count > 0
    # So strong a contact that multipliers cannot be counted: one far outside is proof enough.
    stable = batch_multipliers([problem.with_ke(ke)], dominant=False).stable[0]
    return None if np.isnan(stable) else bool(stable == 0.0)


def _unstable(problem: RubbingBlade, ke: float) -> bool:
    return _verdict(problem, ke) is not False


def _between(
    problem: RubbingBlade, low: float, high: float, destabilising: bool
) -> tuple[float, float, float, float]:
    direction = 1.0 if destabilising else -1.0
    while high / low - 1 > _BRACKET:
        middle = np.sqrt(low * high)
        if _unstable(problem, middle) == destabilising:
            high = middle
        else:
            low = middle
    ke, mu, error = _solved(problem, low, high)
    while error == np.inf and high / low - 1 > 1e-7:
        middle = np.sqrt(low * high)
        if _unstable(problem, middle) == destabilising:
            high = middle
        else:
            low = middle
    if error == np.inf:
        ke = np.sqrt(low * high)
        equation = CharacteristicEquation(problem.with_ke(ke))
        mu, error = equation.crossing_near(), high / low - 1
    frequency = CharacteristicEquation(problem.with_ke(ke)).chatter_hz(mu)
    return ke, frequency, direction, error


def _solved(problem: RubbingBlade, low: float, high: float) -> tuple[float, complex, float]:
    """Newton's method on det(I − M(e^{iθ}; K_e)e^{−iθ}) = 0 in (θ, K_e), within the bracket."""
    ke = np.sqrt(low * high)
    angle = float(np.angle(CharacteristicEquation(problem.with_ke(ke)).crossing_near()))
    real_root = min(abs(np.sin(angle)), 1.0) < 1e-7

    def f(theta: float, k: float) -> complex:
        return CharacteristicEquation(problem.with_ke(k)).value(np.exp(1j * np.array([theta])))[0]

    change = np.inf
    for _ in range(25):
        h, g = 1e-6, 1e-6 * ke
        value = f(angle, ke)
        by_ke = (f(angle, ke + g) - f(angle, ke - g)) / (2 * g)
        if real_root:  # at μ = ±1 the determinant is real and θ stays
            move_angle, move_ke = 0.0, -value.real / by_ke.real if by_ke.real else np.inf
        else:
            by_angle = (f(angle + h, ke) - f(angle - h, ke)) / (2 * h)
            jacobian = np.array([[by_angle.real, by_ke.real], [by_angle.imag, by_ke.imag]])
            try:
                move_angle, move_ke = np.linalg.solve(jacobian, [-value.real, -value.imag])
            except np.linalg.LinAlgError:
                return ke, np.exp(1j * angle), np.inf
        if not np.isfinite(move_ke) or abs(move_ke) > 0.05 * ke:
            return ke, np.exp(1j * angle), np.inf
        angle, ke, change = angle + move_angle, ke + move_ke, abs(move_ke) / ke
        if change < 1e-12:
            break
    inside = low * (1 - 1e-6) <= ke <= high * (1 + 1e-6)
    return ke, complex(np.exp(1j * angle)), change + 1e-13 if inside and change < 1e-8 else np.inf

"""Number of unstable roots in permanent contact, by the argument principle."""

from __future__ import annotations

import numpy as np

from sdm_core.errors import TooMuchWork
from sdm_core.interruption import checkpoint
from sdm_core.receptance import ContactReceptance

MOST_FREQUENCIES = 1_000_000
_LARGEST_STEP = 0.8  # rad of phase between neighbouring frequencies


def unstable_root_count(receptance: ContactReceptance, speed_hz: float, ke: np.ndarray) -> np.ndarray:
    """Characteristic roots with positive real part, for each K_e at one rotor speed.

    D(s) = det(I + K_e(1 − e^{−sτ}) H(s)) has no pole in the right half-plane, so its zeros there
    number −(1/π) × the change of arg D(iω) from ω = 0 to ∞. Frequencies are added until the phase
    turns by less than 0.8 rad between neighbours, and then once more at every middle to see
    that no turn was hidden.

    Parameters
    ----------
    speed_hz
        Ω, Hz.
    ke
        N/m, shape (m,).

    Returns
    -------
    Counts as floats, shape (m,); NaN where a root lies on the axis to rounding.
    """
    ke = np.atleast_1d(np.asarray(ke, dtype=float))
    tau = 1.0 / speed_hz
    if receptance.rank == 0 or not (ke > 0).any():
        return np.zeros(len(ke))
    w = _frequencies(receptance, tau, ke.max())
    d = _characteristic(receptance, tau, w, ke)
    for _ in range(40):
        checkpoint()
        step = np.abs(np.angle(d[1:] / d[:-1])).max(axis=1)
        wide = np.diff(w) > 1e-13 * w[1:]
        coarse = np.flatnonzero((step > _LARGEST_STEP) & wide)
        if len(coarse) == 0:
            middle = 0.5 * (w[:-1] + w[1:])
            d_middle = _characteristic(receptance, tau, middle, ke)
            hidden = np.angle(d_middle / d[:-1]) + np.angle(d[1:] / d_middle) - np.angle(d[1:] / d[:-1])
            coarse = np.flatnonzero((np.abs(hidden).max(axis=1) > 1.0) & wide)
            if len(coarse) == 0:
                break
            new, d_new = middle[coarse], d_middle[coarse]
        else:
            new = 0.5 * (w[coarse] + w[coarse + 1])
            d_new = _characteristic(receptance, tau, new, ke)
        w = np.insert(w, coarse + 1, new)
        d = np.insert(d, coarse + 1, d_new, axis=0)
    turns = np.angle(d[1:] / d[:-1])
    phase = turns.sum(axis=0) - np.angle(d[-1])  # D → 1 beyond the last frequency
    count = -phase / np.pi
    rounded = np.round(count)
    decided = (np.abs(count - rounded) < 1e-3) & (np.abs(turns).max(axis=0) < 2.0)
    return np.where(decided, rounded, np.nan)


def _frequencies(receptance: ContactReceptance, tau: float, ke: float) -> np.ndarray:
    omega = receptance.omega
    strength = (receptance.factor**2).sum()
    high = np.sqrt(omega.max() ** 2 + 8 * ke * strength)
    points = max(64.0, 6 * high * tau / (2 * np.pi))
    if not points < MOST_FREQUENCIES:
        raise TooMuchWork(
            "ke",
            float(ke),
            f"lower K_e or raise the speed: {points / 6:.3g} oscillations a revolution to count",
        )
    grid = [np.linspace(0.0, high, int(points))]
    for centre, damping in zip(omega, receptance.damping_ratio, strict=True):
        width = max(damping, 1e-8)
        offset = (
            centre
            * width
            * np.r_[0.0, np.geomspace(0.25, max(1.0, 0.5 / width), 2 + int(4 * np.log(1 / width)))]
        )
        grid += [centre + offset, np.maximum(centre - offset, 0.0)]
    return np.unique(np.concatenate(grid))


def _characteristic(receptance: ContactReceptance, tau: float, w: np.ndarray, ke: np.ndarray) -> np.ndarray:
    """D(iω), shape (frequencies, stiffnesses)."""
    gain = (1 - np.exp(-1j * w * tau))[:, None] * ke[None, :]
    if receptance.rank == 1:
        return 1 + gain * receptance.eigenvalues(w)
    # det(I + c H) = Π(1 + c λ): one set of eigenvalues serves every K_e.
    lam = receptance.eigenvalues(w)
    return (1 + gain[:, :, None] * lam[:, None, :]).prod(axis=2)

"""Closed-form stability boundary in permanent contact (DESIGN, fact 2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.errors import TooMuchWork
from sdm_core.receptance import ContactReceptance, Sweep, swept

MOST_CANDIDATES = 1_000_000
_SUBDIVISION = np.linspace(0.0, 1.0, 9)


@dataclass(frozen=True)
class Crossings:
    """Roots on the imaginary axis at one speed, by rising K_e.

    Attributes
    ----------
    ke
        N/m, shape (c,).
    frequency_hz
        ω/2π, Hz: the chatter frequency there.
    direction
        +1 where a pair of roots becomes unstable as K_e rises, −1 where one becomes stable again.
    error_estimate
        Relative error of `ke`.
    proven
        False when another method contradicts these crossings, or could not confirm them.
    """

    ke: np.ndarray
    frequency_hz: np.ndarray
    direction: np.ndarray
    error_estimate: np.ndarray
    proven: bool = True

    @property
    def consistent(self) -> bool:
        """False when a crossing must have been missed: fewer than no unstable roots."""
        return bool((np.cumsum(self.direction) >= 0).all())

    def unstable_intervals(self, ke_max: float) -> tuple[tuple[float, float], ...]:
        """Intervals of K_e up to `ke_max` with unstable roots, N/m."""
        pairs, intervals, start = 0, [], 0.0
        for ke, direction in zip(self.ke, self.direction, strict=True):
            if ke > ke_max:
                break
            before, pairs = pairs, pairs + int(direction)
            if before <= 0 < pairs:
                start = float(ke)
            elif pairs <= 0 < before:
                intervals.append((start, float(ke)))
        if pairs > 0:
            intervals.append((start, float(ke_max)))
        return tuple(intervals)


def crossings(
    receptance: ContactReceptance,
    speed_hz: float,
    ke_max: float,
    *,
    sweep: Sweep | None = None,
    first_only: bool = False,
) -> Crossings:
    """All K_e up to `ke_max` at which a root lies on the imaginary axis, at one rotor speed.

    With λ(ω) an eigenvalue of H(iω), a root s = iω needs e^{−iωτ} = 1 + 1/(K_e λ). Its modulus
    gives K_e = −1/(2 Re λ), its phase ωτ − 2 arg λ + π = 2πk. The phase condition is solved on
    the piecewise linear 1/λ of the sweep, then by Newton's method on the exact eigenvalue.

    Parameters
    ----------
    speed_hz
        Ω, Hz.
    ke_max
        N/m.
    sweep
        `swept(receptance, ke_max)`, to be shared between speeds with the same modes.
    first_only
        Only the lowest few crossings are refined and returned; enough for the first one.
    """
    tau = 1.0 / speed_hz
    if receptance.rank == 0:
        return _none()
    w, z, spread = _candidates(sweep or swept(receptance, ke_max), tau)
    with np.errstate(divide="ignore", over="ignore"):
        ke = np.where(z.real < 0, -(np.abs(z) ** 2) / (2 * z.real), np.inf)
    near = ke < 1.2 * ke_max
    if first_only and near.any():
        near &= ke <= 1.3 * ke[near].min()
    if not near.any():
        return _none()
    return _refined(receptance, tau, w[near], z[near], spread[near], ke_max)


def _candidates(sweep: Sweep, tau: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Approximate ω, 1/λ and interval width of every solution of the phase condition."""
    t = _SUBDIVISION[:, None, None]
    width = sweep.right - sweep.left
    w = sweep.left[None, :, None] + t * width[None, :, None]
    z = sweep.z_left + t * (sweep.z_right - sweep.z_left)
    step = np.angle(z[1:] / z[:-1])
    phase = np.angle(z[:1]) + np.concatenate([np.zeros_like(step[:1]), np.cumsum(step, axis=0)])
    turns = (w * tau + 2 * phase + np.pi) / (2 * np.pi)  # arg λ = −arg(1/λ)
    start, end = turns[:-1], turns[1:]
    # A root needs Re λ < 0; a little to spare, because the line is an approximation.
    useful = (z.real[:-1] < 0.05 * np.abs(z[:-1])) | (z.real[1:] < 0.05 * np.abs(z[1:]))
    start, end = start[useful], end[useful]
    first = np.ceil(np.minimum(start, end))
    every = np.maximum(np.floor(np.maximum(start, end)) - first + 1, 0)
    if not every.sum() < MOST_CANDIDATES:
        raise TooMuchWork(
            "speed_hz",
            float(1 / tau),
            f"raise it or lower K_e: {every.sum():.3g} possible crossings to solve",
        )
    count = every.astype(int)
    index = np.repeat(np.arange(len(count)), count)
    rank = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    k = first[index] + rank
    share = (k - start[index]) / (end[index] - start[index])
    shape = useful.shape
    w = np.broadcast_to(w, (len(t), *shape[1:]))
    w_found = w[:-1][useful][index] + share * (w[1:] - w[:-1])[useful][index]
    z_found = z[:-1][useful][index] + share * (z[1:] - z[:-1])[useful][index]
    spread = np.broadcast_to(width[None, :, None], shape)[useful][index]
    return w_found, z_found, spread


def _refined(
    receptance: ContactReceptance,
    tau: float,
    w: np.ndarray,
    z: np.ndarray,
    spread: np.ndarray,
    ke_max: float,
) -> Crossings:
    """Newton's method on the exact phase condition; duplicates and strays removed."""
    start = w
    for _ in range(30):
        lam, slope = receptance.eigenvalue_near(w, z)
        residual = np.angle(-np.exp(1j * w * tau) * np.conj(lam) / lam)
        rate = tau - 2 * (1j * slope / lam).imag
        move = np.clip(-residual / rate, -0.25 * spread, 0.25 * spread)
        w = w + move
        z = 1.0 / lam - 1j * slope / lam**2 * move
        if (np.abs(move) <= 1e-13 * w).all():
            break
    lam, slope = receptance.eigenvalue_near(w, z)
    residual = np.angle(-np.exp(1j * w * tau) * np.conj(lam) / lam)
    ke = -1.0 / (2 * lam.real)
    good = (np.abs(residual) < 1e-7) & (lam.real < 0) & (np.abs(w - start) <= 2 * spread)
    # f(s) = e^{−sτ} − 1 − 1/(K_e λ) = 0 gives ds/dK_e.
    f_s = -tau * np.exp(-1j * w * tau) + slope / (ke * lam**2)
    direction = np.sign((-1.0 / (ke**2 * lam) / f_s).real)
    # Relative error of K_e from what is left of the residual and from rounding in ω.
    sensitivity = np.abs((1j * slope).real / lam.real)
    error = sensitivity * (np.abs(residual) / np.abs(rate) + 4 * np.finfo(float).eps * w) + 1e-14
    keep = np.flatnonzero(good & (ke <= ke_max) & (ke > 0))
    keep = keep[np.lexsort((w[keep], ke[keep]))]
    if len(keep) > 1:
        same = (np.diff(ke[keep]) < 1e-9 * ke[keep][1:]) & (np.abs(np.diff(w[keep])) < 1e-9 * w[keep][1:])
        keep = keep[np.r_[True, ~same]]
    return Crossings(ke[keep], w[keep] / (2 * np.pi), direction[keep], error[keep])


def _none() -> Crossings:
    empty = np.zeros(0)
    return Crossings(empty, empty, empty, empty)

"""Leading multipliers of a semi-discretization from an equation of the size of the state."""

from __future__ import annotations

import numpy as np

from sdm_core.semi_discretization.contact_map import ContactMap

_SAMPLES = (16, 24, 32, 48, 64, 96, 128)
_NEGLIGIBLE = 1e-10  # size of the last terms of a resolved series; Newton's method does the rest
_MOST_CIRCLES = 16
_SMALLEST_CIRCLE, _LARGEST_CIRCLE = 1e-6, 1e4  # beyond, entries of M lose their digits
_SLOPE_STEP = 1e-5


def leading(monodromy: ContactMap, count: int) -> np.ndarray | None:
    """At least `count` multipliers of largest modulus, or None where the series does not resolve them.

    With u = 1/μ, q(u) = det(I − uΦ) is a polynomial with q(0) = 1. Samples on a circle |u| = R give
    its power series, eigenvalues of a companion matrix the zeros inside, the argument principle
    their number, and Newton's method on (I − uM(u))x = 0 their exact places. R is doubled until
    enough multipliers lie inside.
    """
    try:
        return _leading(monodromy, count)
    except np.linalg.LinAlgError:  # a pivot vanished to the last bit
        return None


def _leading(monodromy: ContactMap, count: int) -> np.ndarray | None:
    reach, low, high = 1.0, 0.0, np.inf
    for _ in range(_MOST_CIRCLES):
        found = _inside(monodromy, reach)
        if found is None:
            high = reach
            reach = reach / 4 if low == 0 else np.sqrt(low * high)
        elif np.where(found.imag == 0, 1, 2).sum() >= count:
            return _polished(monodromy, found)
        else:
            low = reach
            reach = 2 * reach if np.isinf(high) else np.sqrt(low * high)
        if not _SMALLEST_CIRCLE < reach < _LARGEST_CIRCLE or high < 1.05 * low:
            break
    return None


def _inside(monodromy: ContactMap, reach: float) -> np.ndarray | None:
    """Multipliers of the upper half-plane with |μ| above about 1/reach; None where not resolved."""
    values = np.zeros(0, dtype=complex)
    for samples in _SAMPLES:
        half = np.arange(samples // 2 + 1)
        u = reach * np.exp(2j * np.pi * half / samples)
        known = np.zeros(len(half), dtype=bool)
        if len(values) and samples == 2 * (2 * (len(values) - 1)):  # every other one is known
            known[::2] = True
        fresh = np.empty(len(half), dtype=complex)
        fresh[known] = values[: known.sum()]
        fresh[~known] = monodromy.determinant(u[~known])
        values = fresh
        size = np.abs(values).max()
        if not np.isfinite(size):
            return None
        series = np.fft.irfft(values.conj(), samples)
        if np.abs(series[-max(2, samples // 8) :]).max() <= _NEGLIGIBLE * size:
            return _zeros(series, reach)
    return None


def _zeros(series: np.ndarray, reach: np.ndarray | float) -> np.ndarray | None:
    """Multipliers of the upper half-plane from the series of q in u/R; None where some are missing."""
    kept = np.flatnonzero(np.abs(series) > _NEGLIGIBLE * np.abs(series).max())
    if len(kept) == 0 or kept[0] != 0:
        return None
    found = np.roots(series[: kept[-1] + 1])  # R μ
    modulus = np.abs(found)
    # They are counted on the circle through the widest gap of their moduli near the rim.
    near = np.log(np.sort(np.r_[1.0, modulus[(modulus > 1.0) & (modulus < 1.25)], 1.25]))
    widest = int(np.argmax(np.diff(near)))
    rim = np.exp(near[widest : widest + 2].mean())
    inside = found[modulus > rim]
    if _winding(series, 1.0 / rim) != len(inside):
        return None
    inside = np.where(np.abs(inside.imag) <= 1e-7 * np.abs(inside), inside.real + 0j, inside)
    return inside[inside.imag >= 0] / reach


def _winding(series: np.ndarray, radius: float) -> int | None:
    """Zeros of the series inside a circle, by the argument principle; None where it passes too near one."""
    scaled = series * radius ** np.arange(len(series))
    values = np.fft.rfft(scaled, 64 * len(series))
    if np.abs(values).min() <= 1e-10 * np.abs(values).max():
        return None
    turns = np.angle(values[:-1] / values[1:])
    return round(turns.sum() / np.pi) if np.abs(turns).max() < 0.8 else None


def _polished(monodromy: ContactMap, mu: np.ndarray) -> np.ndarray | None:
    """Multipliers of both half-planes after Newton's method; None where it wanders off."""
    u = 1.0 / mu
    d = monodromy.steps.p.shape[-1]
    rng = np.random.default_rng(d)
    seed = rng.normal(size=(2, d)) + 1j * rng.normal(size=(2, d))
    moved = np.zeros(len(u))
    change = np.full(len(u), np.inf)
    for _ in range(6):
        m, _ = monodromy.reduced(np.concatenate([u, u * (1 + _SLOPE_STEP), u * (1 - _SLOPE_STEP)]))
        at, above, below = m.reshape(3, len(u), d, d)
        t = np.eye(d) - u[:, None, None] * at
        slope = -at - (above - below) / (2 * _SLOPE_STEP)
        scale = np.abs(u) * np.maximum(np.abs(at).max(axis=(1, 2)), 1.0)
        x = _inverse_step(t, seed[0], scale)
        y = _inverse_step(t.conj().swapaxes(1, 2), seed[1], scale)
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        y /= np.linalg.norm(y, axis=1, keepdims=True)
        left = y.conj().swapaxes(1, 2)
        with np.errstate(all="ignore"):
            step = (left @ t @ x)[:, 0, 0] / (left @ slope @ x)[:, 0, 0]
        step = np.where(mu.imag == 0, step.real, step)  # a multiplier on the real axis stays there
        before, change = change, np.abs(step / u)
        if not np.isfinite(change).all():
            return None
        u = u - step
        moved += change
        if (change < 1e-14).all() or (change >= before).all():
            break
    if (moved > 1e-3).any():
        return None
    mu = 1.0 / u
    return np.concatenate([mu, mu[mu.imag != 0].conj()])


def _inverse_step(t: np.ndarray, seed: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """t⁻¹ seed, shape (k, d, 1): one step of inverse iteration.

    A small shift keeps a matrix that is singular to the last bit from dividing by zero.
    """
    d = t.shape[-1]
    side = np.broadcast_to(seed[:, None], (len(t), d, 1))
    shift = np.diag(np.exp(1j * np.arange(1, d + 1)))
    for size in (0.0, 1e-15, 1e-14):
        try:
            return np.linalg.solve(t + (size * scale)[:, None, None] * shift, side)
        except np.linalg.LinAlgError:
            continue
    return np.linalg.solve(t + (1e-13 * scale)[:, None, None] * shift, side)

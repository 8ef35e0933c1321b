"""Leading Floquet multipliers as the zeros of an entire function, many problems at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.floquet.contact_expansion import ContactExpansion
from sdm_core.floquet.power_series import half_circle, real_series
from sdm_core.interruption import checkpoint

_SAMPLES = (16, 20, 24, 32, 48, 64, 96, 128, 192)
_SHARE = 0.85  # of the terms that M has: q seldom needs fewer
_NEGLIGIBLE = 1e-13
_ENOUGH = 1e-11  # of the series: what its zeros are found from, before Newton's method
_ORIGIN = 1e-3
_RIM = (1.0, 1.2)  # of R|μ|, between which the circle for counting lies
_SHORT = 20  # coefficients: counted apart from longer series
_LAST_STEP = 1e-8  # of Newton's method on ln u
_UNPOLISHED = 1e-5  # relative error of those zeros, also of double ones
_NEAR_ONE = 1e-3  # of |ln |μ||: multipliers so near the circle are polished before they are counted
_EPS = np.finfo(float).eps


@dataclass(frozen=True)
class LeadingMultipliers:
    """Multipliers with |μ| ≥ 1/reach, largest modulus first, those of the lower half-plane left out.

    Attributes
    ----------
    multiplier
        μ, shape (b, l), zero where there are no more.
    error_estimate
        Relative error of each, shape (b, l); of those not polished, that of the series.
    outside
        Number outside the unit circle, both half-planes, shape (b,); −1 where not decided.
    resolved
        False where the series did not converge or its zeros could not be told apart, shape (b,).
    """

    multiplier: np.ndarray
    error_estimate: np.ndarray
    outside: np.ndarray
    resolved: np.ndarray


def leading_multipliers(
    expansion: ContactExpansion, ke: np.ndarray, *, polished: int = 1
) -> LeadingMultipliers:
    """Zeros of q(u) = det(I − u M(K_e(u − 1))), u = 1/μ.

    q is the Fredholm determinant of the monodromy operator: an entire function with q(0) = 1 and the
    zeros 1/μ, the same number of times. Samples on the circle |u| = R give its power series by a
    discrete Fourier transform, eigenvalues of a companion matrix its zeros inside, the argument
    principle their number, and Newton's method on T(u)x = (I − uM)x = 0 their exact places.

    Parameters
    ----------
    expansion
        M(c) for each problem, b of them; R is its radius over its centre.
    ke
        K_e up to the expansion's centre, N/m, shape (b,).
    polished
        How many of the largest are made exact, besides all that lie near the unit circle.
    """
    reach = expansion.radius / expansion.centre
    series, resolved = _series(expansion, ke, reach)
    mu, counted = _zeros(series, reach)
    resolved &= counted & expansion.resolved
    error = np.where(mu != 0, _UNPOLISHED, 0.0)
    modulus = np.abs(mu)
    with np.errstate(divide="ignore"):
        near = np.abs(np.log(np.where(modulus > 0, modulus, 1e-300))) < _NEAR_ONE
    refine = (mu != 0) & (near | (np.arange(mu.shape[1]) < polished)) & resolved[:, None]
    case, at = np.nonzero(refine)
    if len(case):
        mu[case, at], error[case, at] = _polished(expansion, ke, case, mu[case, at])
    order = np.argsort(-np.abs(mu), axis=1, kind="stable")
    mu, error = np.take_along_axis(mu, order, axis=1), np.take_along_axis(error, order, axis=1)
    modulus = np.abs(mu)
    touching = (np.abs(modulus - 1) <= error * modulus) & (mu != 0)
    each = np.where(mu.imag == 0, 1, 2)
    outside = np.where(touching.any(axis=1) | ~resolved, -1, ((modulus > 1) * each).sum(axis=1))
    return LeadingMultipliers(mu, error, outside, resolved)


def _series(expansion: ContactExpansion, ke: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of q in u/R, shape (b, samples), and whether they fell to rounding, shape (b,)."""
    b, d = len(ke), expansion.coefficients.shape[-1]
    out = np.zeros((b, _SAMPLES[0]))
    resolved = np.zeros(b, dtype=bool)
    waiting = np.flatnonzero(expansion.resolved)
    fewest = np.maximum(2 * d, _SHARE * expansion.terms[waiting])
    order = np.argsort(expansion.terms[waiting], kind="stable")  # short series together are cheap
    waiting, fewest = waiting[order], fewest[order]
    one, share = np.eye(d), ke / expansion.centre
    for samples in _SAMPLES:
        todo = waiting[~resolved[waiting] & (fewest <= samples)]
        if len(todo) == 0:
            continue
        half = samples // 2
        circle = half_circle(samples)
        found = np.empty((len(todo), samples))
        size = np.empty(len(todo))
        chunk = max(1, int(3e4 / (half * d * d)))
        for i in range(0, len(todo), chunk):
            checkpoint()
            rows = todo[i : i + chunk]
            u = reach[rows, None] * circle
            # c = K_e (u − 1), written so that places are the same for all where K_e is the centre.
            part = share[rows, None]
            t = circle[None] if (part == 1).all() else part * circle + (1 - part) / reach[rows, None]
            m = expansion[rows].at(t)
            q = np.linalg.det(one - u[..., None, None] * m)
            size[i : i + chunk] = np.abs(q).max(axis=1)
            found[i : i + chunk] = real_series(q[:, :, None])[:, :, 0]
        tail = np.abs(found[:, -max(2, samples // 8) :]).max(axis=1)
        done = tail <= np.maximum(_NEGLIGIBLE, 30 * expansion.noise[todo]) * size
        if samples > out.shape[1]:
            out = np.pad(out, ((0, 0), (0, samples - out.shape[1])))
        done &= np.abs(found[:, 0] - 1) < _ORIGIN  # q(0) = 1, unless lost in rounding
        out[todo[done], :samples] = found[done]
        resolved[todo[done]] = True
    out[~resolved, 0] = 1.0
    return out, resolved


def _zeros(series: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Multipliers of the upper half-plane with |μ| > 1/R, shape (b, l), and whether their number is right."""
    b, every = len(series), np.arange(len(series))
    largest = np.maximum(np.abs(series).max(axis=1), 1e-300)
    kept = np.abs(series) > _ENOUGH * largest[:, None]
    degree = series.shape[1] - 1 - np.argmax(kept[:, ::-1], axis=1)
    padded = 2 * ((degree + 1) // 2)
    roots = np.zeros((b, int(padded.max(initial=2))), dtype=complex)
    by_degree = np.argsort(padded, kind="stable")
    ends = np.searchsorted(padded[by_degree], np.arange(0, roots.shape[1] + 1, 2), side="right")
    for d, start, end in zip(range(2, roots.shape[1] + 1, 2), ends[:-1], ends[1:], strict=True):
        if start == end:
            continue
        rows = by_degree[start:end]
        kept_now = series[rows, 1 : d + 1]
        companion = np.zeros((len(rows), d, d))
        companion[:, 0, : kept_now.shape[1]] = -kept_now / series[rows, :1]
        companion[:, np.arange(1, d), np.arange(d - 1)] = 1.0
        roots[rows, :d] = np.linalg.eigvals(companion)  # R μ
    modulus = np.abs(roots)
    # The circle on which zeros are counted runs through the widest gap between their moduli near the rim.
    near = np.empty((b, roots.shape[1] + 2))
    near[:, :2] = _RIM
    near[:, 2:] = np.clip(modulus, *_RIM)
    near = np.sort(near, axis=1)[:, ::-1]
    widest = np.argmax(near[:, :-1] / near[:, 1:], axis=1)
    rim = np.sqrt(near[every, widest] * near[every, widest + 1])
    winding = np.empty(b, dtype=int)
    short = padded <= _SHORT
    for some in (short, ~short):
        if some.any():
            terms = min(series.shape[1], int(padded[some].max()) + 2)
            winding[some] = _winding(series[some, :terms], 1.0 / rim[some])
    counted = winding == (modulus > rim[:, None]).sum(axis=1)
    mu = roots / reach[:, None]
    tiny = np.abs(mu.imag) <= 1e-9 * np.abs(mu)
    mu = np.where(tiny, mu.real + 0j, mu)
    mu = np.where((modulus > rim[:, None]) & (mu.imag >= 0), mu, 0.0)
    order = np.argsort(-np.abs(mu), axis=1, kind="stable")
    return np.take_along_axis(mu, order, axis=1)[
        :, : max(1, int((mu != 0).sum(axis=1).max(initial=1)))
    ], counted


def _winding(series: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Zeros of the series inside |t| = radius, by the argument principle; −1 where not resolved."""
    terms = series.shape[1]
    scaled = series * radius[:, None] ** np.arange(terms)
    values = np.fft.rfft(scaled, 16 * terms, axis=1).conj()
    size = np.abs(values).max(axis=1)
    turns = np.angle(values[:, 1:] / np.where(values[:, :-1] == 0, 1.0, values[:, :-1]))
    good = (np.abs(turns).max(axis=1) < 0.8) & (np.abs(values).min(axis=1) > 1e-10 * size)
    count = turns.sum(axis=1) / np.pi
    return np.where(good & (np.abs(count - np.round(count)) < 1e-3), np.round(count), -1).astype(int)


def _polished(
    expansion: ContactExpansion, ke: np.ndarray, case: np.ndarray, mu: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Multipliers after Newton's method on T(u)x = 0, and their relative errors."""
    u = 1.0 / mu
    own, stiffness = expansion[case], ke[case]
    change, before = np.full(len(u), np.inf), np.full(len(u), np.inf)
    moved, slope, size = np.zeros(len(u)), np.ones(len(u), dtype=complex), np.ones(len(u))
    go = np.arange(len(u))
    for _ in range(4):
        t, t_slope, scale, _ = _pencil(own if len(go) == len(u) else own[go], stiffness[go], u[go])
        x, left = null_vectors(t, scale)
        slope[go], size[go] = (left @ t_slope @ x)[:, 0, 0], scale
        with np.errstate(all="ignore"):
            step = (left @ t @ x)[:, 0, 0] / slope[go]
            step = np.where(np.isfinite(step), step, 0.0)
            before[go], change[go] = change[go], np.abs(step / u[go])
        step *= np.minimum(1.0, 0.05 / np.maximum(change[go], 1e-300))
        # A multiplier on the real axis stays there.
        u[go] = np.where(mu[go].imag == 0, (u[go] - step).real, u[go] - step)
        moved[go] += np.minimum(change[go], 0.05)
        # Newton's method squares its step: below `_LAST_STEP` the next one is rounding.
        go = go[(change[go] > _LAST_STEP) & (change[go] < before[go])]
        if len(go) == 0:
            break
    left_over = np.where(change <= _LAST_STEP, change * _LAST_STEP, np.minimum(change, before))
    floor = 4 * (4 * _EPS + own.noise) * size / np.maximum(np.abs(slope * u), 1e-300)
    error = left_over + floor
    strayed = moved > 1e-3  # the series was better than that: Newton went to another multiplier
    return 1.0 / u, np.where(strayed, np.inf, error)


def null_vectors(t: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Right and left null vectors of nearly singular T, unit length, shapes (k, d, 1) and (k, 1, d)."""
    d = t.shape[-1]
    rng = np.random.default_rng(d)
    seed = rng.normal(size=(2, d)) + 1j * rng.normal(size=(2, d))
    x = _inverse_step(t, seed[0], scale)
    y = _inverse_step(t.conj().swapaxes(1, 2), seed[1], scale)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return x, y.conj().swapaxes(1, 2)


def slopes(
    expansion: ContactExpansion, ke: np.ndarray, mu: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Newton's correction and derivatives of a multiplier, by T(u)x = 0 with its null vectors.

    Returns
    -------
    yᴴTx/(yᴴT_u x u), what Newton's method would take from ln u; d ln μ/d ln K_e; and the rounding
    error of ln μ; each of shape (k,).
    """
    u = 1.0 / mu
    t, by_u, scale, slope = _pencil(expansion, ke, u)
    x, left = null_vectors(t, scale)
    # T = I − u M(K_e(u − 1)): with K_e it changes by −u (u − 1) M'.
    by_ke = -(u * (u - 1))[:, None, None] * slope
    with np.errstate(all="ignore"):
        own = (left @ by_u @ x)[:, 0, 0] * u
        residual = (left @ t @ x)[:, 0, 0] / own
        change = (left @ by_ke @ x)[:, 0, 0] * ke / own
        noise = (4 * _EPS + expansion.noise) * scale / np.abs(own)
    return residual, change, noise


def _inverse_step(t: np.ndarray, seed: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """t⁻¹ seed, shape (k, d, 1): one step of inverse iteration.

    A small shift keeps a matrix that is singular to the last bit from dividing by zero.
    """
    d = t.shape[-1]
    side = np.broadcast_to(seed[:, None], (len(t), d, 1))
    shift = np.diag(np.exp(1j * np.arange(1, d + 1)))
    for size in (0.0, 1e-15, 1e-14, 1e-13):
        try:
            return np.linalg.solve(t + (size * scale)[:, None, None] * shift, side)
        except np.linalg.LinAlgError:
            continue
    return np.linalg.pinv(t) @ side


def _pencil(
    expansion: ContactExpansion, ke: np.ndarray, u: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """T(u), dT/du, the size of u M and M'(c), shapes (k, d, d), (k, d, d), (k,), (k, d, d)."""
    m, m_slope = expansion.fundamental_and_slope((ke * (u - 1))[:, None])
    m, m_slope = m[:, 0], m_slope[:, 0]
    t = np.eye(m.shape[-1]) - u[:, None, None] * m
    t_slope = -m - (u * ke)[:, None, None] * m_slope
    return t, t_slope, np.abs(u) * np.maximum(expansion.size, 1.0), m_slope

"""Lobes of one mode by itself under arcs of contact, exactly: what the surrogate starts from there.

With y = e^{ξωt} x, a free mode and one in contact are undamped oscillators of frequency ν₀ = √(1 − ξ²) and
ν = √(1 − ξ² − k), k = κ(1/μ − 1), in units of ω (the state of decision 6 for n = 1). Their maps over a
segment have determinant 1, so that μ is a multiplier where the trace of their product P over a revolution
is m + 1/m, m = μ e^{ξφ}, φ = 2πf/Ω.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

_NEWTON_STEPS = 12
_LONGEST_STEP = 0.5  # in ln κ, and in rad
_CONVERGED = 1e-6
_FLIP_POINTS = 24
_FLIP_DECADES = 0.8  # below the lasting boundary, in which flips are looked for
_FLIP_BISECTIONS, _FLIP_NEWTON_STEPS = 10, 2
# Where Newton's method starts for a pair next to −1: below the boundary, in log10 κ, and next to π, rad.
_BESIDE_A_FLIP = (-0.046, 0.08)
_CEILING = 4.0


@dataclass(frozen=True)
class Segments:
    """Arcs of contact and the gaps after them, revolutions, shape (e, 4) each; zero where there are none."""

    arcs: Tensor
    gaps: Tensor

    @classmethod
    def of(cls, arcs: Tensor) -> Segments:
        """From starts and ends (e, 4, 2), alike where there is no arc."""
        start, end = arcs[:, :, 0], arcs[:, :, 1]
        length = end - start
        there = length > 0
        following = torch.cat([start[:, 1:], start[:, :1]], dim=1)
        follows = torch.cat([there[:, 1:], torch.zeros_like(there[:, :1])], dim=1)
        following = torch.where(follows, following, start[:, :1] + 1)
        return cls(length, torch.where(there, following - end, 0.0))

    def __getitem__(self, rows: Tensor) -> Segments:
        return Segments(self.arcs[rows], self.gaps[rows])


def _over(nu: Tensor, angle: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Entries cos νθ, sin(νθ)/ν and −ν sin νθ of the map over an angle."""
    cosine, sine = torch.cos(nu * angle), torch.sin(nu * angle)
    return cosine, sine / nu, -nu * sine


def _trace(segments: Segments, xi: Tensor, phase: Tensor, k: Tensor) -> tuple[Tensor, Tensor]:
    """tr P and its derivative with respect to k, shape (e,)."""
    free, nu = torch.sqrt(1 - xi**2).to(k.dtype), torch.sqrt(1 - xi**2 - k)
    one, zero = torch.ones_like(k), torch.zeros_like(k)
    p: tuple[Tensor, ...] = (one, zero, zero, one)
    dp: tuple[Tensor, ...] = (zero, zero, zero, zero)
    for i in range(segments.arcs.shape[1]):
        angle = phase * segments.arcs[:, i]
        c, s, t = _over(nu, angle)
        # By ν² = 1 − ξ² − k: d cos/dk = θ (sin/ν)/2, and likewise.
        by_c = 0.5 * angle * s
        by_s = (s - angle * c) / (2 * nu**2)
        by_t = 0.5 * (s + angle * c)
        moved = (_times((by_c, by_s, by_t, by_c), p), _times((c, s, t, c), dp))
        dp = tuple(a + b for a, b in zip(*moved, strict=True))
        p = _times((c, s, t, c), p)
        c, s, t = _over(free, phase * segments.gaps[:, i])
        p, dp = _times((c, s, t, c), p), _times((c, s, t, c), dp)
    return p[0] + p[3], dp[0] + dp[3]


def _times(a: tuple[Tensor, ...], b: tuple[Tensor, ...]) -> tuple[Tensor, ...]:
    return (
        a[0] * b[0] + a[1] * b[2],
        a[0] * b[1] + a[1] * b[3],
        a[2] * b[0] + a[3] * b[2],
        a[2] * b[1] + a[3] * b[3],
    )


def lobe_with_arcs(
    segments: Segments, xi: Tensor, phase: Tensor, log_kappa: Tensor, ratio: Tensor
) -> tuple[Tensor, Tensor]:
    """log10 κ on the lobe next to a guess, and where Newton's method got there; elsewhere the guess itself.

    Parameters
    ----------
    xi, phase
        ξ and φ of modes, shape (e,).
    log_kappa, ratio
        The guess: log10 κ, and chatter frequency over the mode's frequency.
    """
    at_kappa, at_angle = (log_kappa * _LN10).detach(), (phase * ratio).detach()
    moving = torch.arange(len(xi), device=xi.device)
    with torch.no_grad():
        for _ in range(_NEWTON_STEPS):
            step = _newton(segments[moving], xi[moving], phase[moving], at_kappa[moving], at_angle[moving])
            size = torch.maximum(step[0].abs(), step[1].abs())
            shrink = 1 / torch.clamp(size / _LONGEST_STEP, min=1.0)
            at_kappa[moving] += shrink * step[0]
            at_angle[moving] += shrink * step[1]
            moving = moving[(size > _CONVERGED) & torch.isfinite(size)]
            if len(moving) == 0:
                break
    # The last step brings the derivatives of an implicit function.
    step_kappa, step_angle = _newton(segments, xi, phase, at_kappa, at_angle)
    there = (step_kappa.abs() < _CONVERGED) & (step_angle.abs() < _CONVERGED) & (at_kappa < _CEILING * _LN10)
    # Where it did not converge the step may not be a number, and so must not be in the graph.
    found = at_kappa + torch.where(there, step_kappa, 0.0)
    return torch.where(there, found / _LN10, log_kappa), there


def _newton(
    segments: Segments, xi: Tensor, phase: Tensor, ln_kappa: Tensor, angle: Tensor
) -> tuple[Tensor, Tensor]:
    """Steps in ln κ and arg μ towards tr P = m + 1/m on |μ| = 1."""
    kappa = torch.exp(ln_kappa)
    turn = torch.polar(torch.ones_like(angle), -angle)  # 1/μ
    trace, by_k = _trace(segments, xi, phase, kappa * (turn - 1))
    m = torch.polar(torch.exp(xi * phase), angle)
    f = trace - m - 1 / m
    # Of the slopes only the values count, also where the step is differentiated.
    by_kappa = (by_k * kappa * (turn - 1)).detach()
    by_angle = (-1j * (by_k * kappa * turn + m - 1 / m)).detach()
    det = by_kappa.real * by_angle.imag - by_kappa.imag * by_angle.real
    det = torch.where(det.abs() > 1e-300, det, 1e-300)
    return (
        (f.imag * by_angle.real - f.real * by_angle.imag) / det,
        (f.real * by_kappa.imag - f.imag * by_kappa.real) / det,
    )


def lobe_beside_a_flip(segments: Segments, xi: Tensor, phase: Tensor, log_kappa: Tensor) -> Tensor:
    """log10 κ of a pair that leaves the circle just before it would meet at −1, below `log_kappa`.

    Neither of the lobes of the mean engagement leads there. The ceiling where there is none.
    """
    below = log_kappa + _BESIDE_A_FLIP[0]
    found, there = lobe_with_arcs(segments, xi, phase, below, (torch.pi - _BESIDE_A_FLIP[1]) / phase)
    return torch.where(there, found, _CEILING)


def first_flip(segments: Segments, xi: Tensor, phase: Tensor, log_kappa: Tensor) -> Tensor:
    """log10 κ from which on a multiplier is beyond −1, below a lobe; the ceiling if there is none.

    At μ = −1 the delayed displacement is −x: in contact the mode is stiffened by 2κ, and the trace of a real
    product, Meissner's, says whether a multiplier has passed −1.
    """
    threshold = 2 * torch.cosh(xi * phase)

    def excess(at: Tensor) -> Tensor:
        """Below zero where a real multiplier lies beyond −1."""
        return _trace(segments, xi, phase, -2 * torch.exp(at * _LN10))[0] + threshold

    with torch.no_grad():
        top = torch.clamp(log_kappa, max=_CEILING)
        high = torch.full_like(top, float("inf"))
        low = top - _FLIP_DECADES
        before, none_yet = low, torch.ones_like(top, dtype=torch.bool)
        for i in range(_FLIP_POINTS + 1):
            at = top - _FLIP_DECADES * (1 - i / _FLIP_POINTS)
            beyond = none_yet & (excess(at) < 0)
            high = torch.where(beyond, at, high)
            low = torch.where(beyond, before, low)
            none_yet &= ~beyond
            before = at
        there = torch.isfinite(high)
        for _ in range(_FLIP_BISECTIONS):
            middle = 0.5 * (low + torch.where(there, high, top))
            beyond = excess(middle) < 0
            high, low = torch.where(beyond, middle, high), torch.where(beyond, low, middle)
    at = torch.where(there, 0.5 * (low + high), top)
    for _ in range(_FLIP_NEWTON_STEPS):  # the last one brings the derivatives
        at = at.detach()
        kappa = torch.exp(at * _LN10)
        trace, by_k = _trace(segments, xi, phase, -2 * kappa)
        slope = (-2 * kappa * _LN10 * by_k).detach()
        steep = there & (slope.abs() > 1e-12)
        at = at - torch.where(steep, (trace + threshold) / torch.where(steep, slope, 1.0), 0.0)
    return torch.where(there, at, _CEILING)


_LN10 = 2.302585092994046

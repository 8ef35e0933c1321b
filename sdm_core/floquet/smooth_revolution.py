"""One revolution of a blade with smooth engagement: power series of short panels in the contact stiffness."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from sdm_core.fourier_engagement import FourierEngagement
from sdm_core.interruption import checkpoint

_NODES = 32  # Gauss points a panel
_PANEL_RAD = 18.0  # phase of the fastest product of two motions and γ: of its half 32 points miss 1e-15
_PANEL_CONTACT = 2.0  # |c| tr(coupling) max γ over a panel: terms of its series reach 2, so none cancel
_FURTHER = 4.0  # times the |c| asked for: more may be wanted
_MOST_TERMS = 40
_NEGLIGIBLE = 1e-17
MOST_PANELS = 8192  # 70,000 rad a revolution
_WORST = 1e-11  # estimated error, relative to the largest entry, above which panels are halved
_TAIL = 2  # last Legendre polynomials of an integrand, that tell what its Gauss points miss
_AT_ONCE = 2**19  # entries of what is multiplied together
_PICTURES = 16  # a panel, of the contact displacement: well below 1 rad apart


@dataclass(frozen=True)
class _Panels:
    """Maps of N equal panels, Σ_k t^k S_k with t = c/`radius`, |t| ≤ 1.

    Attributes
    ----------
    count
        N.
    radius
        N/m.
    error
        Estimate of what all maps miss together, relative to the largest entry of each.
    series
        S_k where they are few enough to keep, shape (terms, N, 2n, 2n).
    """

    count: int
    radius: float
    error: float
    series: np.ndarray | None


@dataclass
class SmoothRevolution:
    """M(c) of one blade, from its contact displacements y = Fᵀx, F Fᵀ = G, over panels of a revolution.

    Over a panel of length h, from the state z = (x, ẋ/ω) at its start, time in revolutions,

        y(t) = Fᵀ Φ_x(t) z + c ∫_0^t κ(t − s) γ(s) y(s) ds,
        z(h) = Φ(h) z + c ∫_0^h Φ(h − s) [0; (τ/ω) F γ(s) y(s)] ds,

    Φ the free motion, in closed form, Φ_x its displacements, Φ_xv their part from ẋ/ω and
    κ(t) = Fᵀ Φ_xv(t) (τ/ω)F: a Volterra equation of the second kind, whose Neumann series in c
    converges for every c. Integrals are those of polynomials through Gauss points (Brunner, Collocation
    Methods for Volterra Equations, 2004, chapter 2). κ and Φ do not depend on the panel, so
    that one product serves all panels. What has been computed is kept.

    Attributes
    ----------
    angle
        ωτ, rad a revolution, shape (n,).
    damping_ratio
        ξ, shape (n,).
    factor, stiffness
        F, kg^-1/2, and (τ/ω)F, shapes (n, p).
    engagement
        γ.
    largest
        max γ.
    kept
        Entries of one set of series that may be kept.
    """

    angle: np.ndarray
    damping_ratio: np.ndarray
    factor: np.ndarray
    stiffness: np.ndarray
    engagement: FourierEngagement
    largest: float
    kept: int
    _levels: dict[int, _Panels] = field(default_factory=dict, init=False, repr=False)

    @property
    def strength(self) -> float:
        """tr(coupling) max γ, m/N."""
        return float((self.factor * self.stiffness).sum()) * self.largest

    @property
    def error(self) -> float:
        """Of the maps used so far."""
        return max((p.error for p in self._levels.values() if p.error <= _WORST), default=0.0)

    def fundamental(self, c: np.ndarray) -> np.ndarray:
        """M(c), shape (k, 2n, 2n); NaN where the panels would be too many."""
        d = 2 * len(self.angle)
        largest = float(np.abs(c).max(initial=0.0))
        panels = self._panels(largest)
        if panels is None:
            # Others of the batch may ask for less.
            if len(c) == 1:
                return np.full((1, d, d), np.nan, dtype=np.result_type(c, float))
            return np.concatenate([self.fundamental(c[i : i + 1]) for i in range(len(c))])
        out: np.ndarray | None = None
        t = c / panels.radius
        for series in self._series(panels, len(c)):
            checkpoint()
            terms, count = series.shape[:2]
            powers = t[:, None] ** np.arange(terms)
            flat = series.reshape(terms, -1)
            maps = (powers.real @ flat).astype(powers.dtype)
            if np.iscomplexobj(powers):
                maps.imag = powers.imag @ flat
            product = _product(maps.reshape(len(c), count, d, d))
            out = product if out is None else product @ out
        assert out is not None
        return out

    def displacement(self, c: complex, state: np.ndarray) -> np.ndarray:
        """y at equal times of a revolution that begins with `state`, shape (samples, p)."""
        panels = self._panels(abs(c))
        if panels is None:
            return np.full((1, self.factor.shape[1]), np.nan)
        pictures = []
        step = 1.0 / panels.count
        operators = _Operators.of(self, step)
        for first, last in self._parts(panels.count):
            maps = np.zeros((last - first, *2 * (2 * len(self.angle),)), dtype=complex)
            seen = np.zeros((_NODES * self.factor.shape[1], last - first, 2 * len(self.angle)), dtype=complex)
            for k, (s, y, _) in enumerate(self._terms(operators, panels, first, last)):
                maps += (c / panels.radius) ** k * s
                seen += (c / panels.radius) ** k * y
            for i in range(last - first):
                pictures.append(seen[:, i] @ state)
                state = maps[i] @ state
        nodes = np.array(pictures).reshape(panels.count, _NODES, -1)
        return (_resampling() @ nodes).reshape(panels.count * _PICTURES, -1)

    def _panels(self, c: float) -> _Panels | None:
        """Series of panels short enough for |c|, γ and the motion; None where they would be too many."""
        phase = (2 * (1 + self.damping_ratio) * self.angle).max() + 2 * np.pi * self.engagement.harmonics
        fewest = max(1.0, np.ceil(phase / _PANEL_RAD))
        needed = max(1.0, c * self.strength / _PANEL_CONTACT / fewest)
        if not fewest * needed <= MOST_PANELS:
            return None
        level = int(np.ceil(np.log2(needed)))
        while fewest * 2**level <= MOST_PANELS:
            count = int(fewest) * 2**level
            # Half as long as need be costs less than another set of series.
            for known in (self._levels.get(count), self._levels.get(2 * count)):
                if known is not None and known.error <= _WORST and c <= known.radius:
                    return known
            found = self._levels.get(count)
            if found is None or c > found.radius:
                # Small c need few terms; one that comes later and is larger, all that converge fast.
                found = self._made(count, _FURTHER * c if c and found is None else np.inf)
                self._levels[count] = found
            if found.error <= _WORST:
                return found
            level += 1
        return None

    def _made(self, count: int, radius: float) -> _Panels:
        """Series of `count` panels up to |c| = `radius` if they converge fast so far, and their error."""
        radius = min(radius, _PANEL_CONTACT * count / max(self.strength, 1e-300))
        panels = _Panels(count, radius, 0.0, None)
        operators = _Operators.of(self, 1.0 / count)
        d = 2 * len(self.angle)
        series: list[np.ndarray] | None = []
        missed = largest = 0.0
        for first, last in self._parts(count):
            lost, terms = 0.0, list[np.ndarray]()
            for s, _, tail in self._terms(operators, panels, first, last):
                lost += tail
                size = float(np.abs(s).max())
                largest = max(largest, size)
                if len(terms) * count * d * d > self.kept:
                    series = None
                terms.append(s if series is not None else s[:0])
            missed = max(missed, lost + size)  # the last term is more than all that follow
            if series is not None:
                series.append(np.array(terms))
        error = count * missed / largest
        if series is None or not error <= _WORST:
            return _Panels(count, radius, error, None)
        most = max(len(part) for part in series)
        padded = [np.pad(part, ((0, most - len(part)), (0, 0), (0, 0), (0, 0))) for part in series]
        return _Panels(count, radius, error, np.concatenate(padded, axis=1))

    def _series(self, panels: _Panels, c_count: int) -> Iterator[np.ndarray]:
        """S_k of some panels after the others, shape (terms, panels, 2n, 2n)."""
        d = 2 * len(self.angle)
        if panels.series is not None:
            size = max(1, _AT_ONCE // (c_count * d * d))
            for i in range(0, panels.count, size):
                yield panels.series[:, i : i + size]
            return
        operators = _Operators.of(self, 1.0 / panels.count)
        for first, last in self._parts(panels.count, c_count * d * d):
            yield np.array([s for s, _, _ in self._terms(operators, panels, first, last)])

    def _parts(self, count: int, entries: int = 0) -> Iterator[tuple[int, int]]:
        """Panels worked on together."""
        own = _NODES * self.factor.shape[1] * 2 * len(self.angle)
        size = max(1, _AT_ONCE // max(own, entries))
        return ((i, min(count, i + size)) for i in range(0, count, size))

    def _terms(
        self, operators: _Operators, panels: _Panels, first: int, last: int
    ) -> Iterator[tuple[np.ndarray, np.ndarray, float]]:
        """S_k (panels, 2n, 2n), y_k at the Gauss points, and what the points of its integrand miss."""
        n, p, count = len(self.angle), self.factor.shape[1], last - first
        d = 2 * n
        theta = (np.arange(first, last) + _points()[:, None]) / panels.count
        gamma = np.repeat(self.engagement.at(theta) * panels.radius, p, axis=0)[:, :, None]
        y = np.broadcast_to(operators.seen[:, None], (_NODES * p, count, d))
        yield np.broadcast_to(operators.free, (count, d, d)), y, 0.0
        for _ in range(_MOST_TERMS):
            checkpoint()
            force = (gamma * y).reshape(_NODES * p, count * d)
            ends = operators.ends @ force
            y = (operators.within @ force).reshape(_NODES * p, count, d)
            s = ends[:d].reshape(d, count, d).swapaxes(0, 1)
            yield s, y, float(np.abs(ends[d:]).max(initial=0.0))
            if not np.abs(s).max() > _NEGLIGIBLE:
                return


@dataclass(frozen=True)
class _Operators:
    """Free motion and integrals over a panel, the same for all.

    Attributes
    ----------
    free
        Φ(h), shape (2n, 2n).
    seen
        Fᵀ Φ_x at the Gauss points, shape (m p, 2n).
    within
        γ y at the points → ∫ κ γ y up to them, shape (m p, m p).
    ends
        γ y at the points → ∫ Φ(h − s)[0; (τ/ω)F γ y] over the panel, and what the last Legendre
        polynomials of those integrands add to integrals, shape (2n (1 + tail), m p).
    """

    free: np.ndarray
    seen: np.ndarray
    within: np.ndarray
    ends: np.ndarray

    @classmethod
    def of(cls, blade: SmoothRevolution, step: float) -> _Operators:
        n, p = blade.stiffness.shape
        t = step * _points()
        xx, xv, _, _ = _free_motion(blade, t)  # (m, n)
        seen = np.concatenate([xx[:, :, None] * blade.factor, xv[:, :, None] * blade.factor], axis=1)
        _, apart, _, _ = _free_motion(blade, (t[:, None] - t).ravel())
        kernel = blade.factor.T @ (apart[:, :, None] * blade.stiffness)
        kernel = kernel.reshape(_NODES, _NODES, p, p) * (step * _integrals())[:, :, None, None]
        _, left, _, over = _free_motion(blade, step - t)
        pushed = np.concatenate([left[:, :, None] * blade.stiffness, over[:, :, None] * blade.stiffness], 1)
        weighted = (step * _weights())[:, None, None] * pushed
        tails = np.einsum("am,mdp->admp", step * _tail(), pushed).reshape(-1, _NODES * p)
        free = np.zeros((2 * n, 2 * n))
        at = np.arange(n)
        whole = _free_motion(blade, np.array([step]))
        for block, (row, column) in zip(whole, ((0, 0), (0, n), (n, 0), (n, n)), strict=True):
            free[row + at, column + at] = block[0]
        return cls(
            free,
            seen.transpose(0, 2, 1).reshape(_NODES * p, 2 * n),
            kernel.transpose(0, 2, 1, 3).reshape(_NODES * p, _NODES * p),
            np.concatenate([weighted.transpose(1, 0, 2).reshape(2 * n, _NODES * p), tails]),
        )


def _free_motion(blade: SmoothRevolution, t: np.ndarray) -> tuple[np.ndarray, ...]:
    """Free motion of (x, ẋ/ω) after t, revolutions: its entries xx, xv, vx, vv, shape (k, n) each."""
    xi, turn = blade.damping_ratio, t[:, None] * blade.angle
    root = np.sqrt(1 - xi**2)
    decay, cosine, sine = np.exp(-xi * turn), np.cos(root * turn), np.sin(root * turn) / root
    return decay * (cosine + xi * sine), decay * sine, -decay * sine, decay * (cosine - xi * sine)


def _product(maps: np.ndarray) -> np.ndarray:
    """Later times earlier of maps (k, N, d, d), in pairs: shape (k, d, d)."""
    while maps.shape[1] > 1:
        count = maps.shape[1]
        pairs = maps[:, 1::2] @ maps[:, : count - count % 2 : 2]
        maps = np.concatenate([pairs, maps[:, -1:]], axis=1) if count % 2 else pairs
    return maps[:, 0]


@cache
def _points() -> np.ndarray:
    """Gauss points of [0, 1]."""
    return (np.polynomial.legendre.leggauss(_NODES)[0] + 1) / 2


@cache
def _weights() -> np.ndarray:
    """Their weights."""
    return np.polynomial.legendre.leggauss(_NODES)[1] / 2


@cache
def _to_legendre() -> np.ndarray:
    """Legendre coefficients of the polynomial through values at the points, shape (m, m)."""
    degree = np.arange(_NODES)
    values = np.polynomial.legendre.legvander(2 * _points() - 1, _NODES - 1)
    return (2 * degree[:, None] + 1) * values.T * _weights()  # discrete orthogonality


@cache
def _integrals() -> np.ndarray:
    """Integrals from 0 to each point of the Lagrange polynomials, shape (m, m)."""
    at = 2 * _points() - 1
    integrals = np.polynomial.legendre.legint(np.eye(_NODES), lbnd=-1) / 2
    return np.polynomial.legendre.legvander(at, _NODES) @ integrals @ _to_legendre()


@cache
def _tail() -> np.ndarray:
    """What the last Legendre polynomials P_k add to integrals: coefficients over 2k + 1, shape (tail, m)."""
    degree = np.arange(_NODES)[:, None]
    return (_to_legendre() / (2 * degree + 1))[-_TAIL:]


@cache
def _resampling() -> np.ndarray:
    """Values at equal times of a panel from those at the points, shape (pictures, m)."""
    at = 2 * np.arange(_PICTURES) / _PICTURES - 1
    return np.polynomial.legendre.legvander(at, _NODES - 1) @ _to_legendre()

"""Receptance of the blade at its contact nodes, and its eigenvalues along the frequency axis."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sdm_core.interruption import checkpoint

_AT_ONCE = 40_000  # numbers a mode-by-frequency table may hold, so that it stays in the cache
_MOST_INTERVALS = 200_000


@dataclass(frozen=True)
class ContactReceptance:
    """H(s) = Fᵀ(Λ² + s² + 2ξΛs)⁻¹F, F Fᵀ = G: what the tip answers to a contact force.

    Its non-zero eigenvalues are those of W^½V_bᵀ(...)⁻¹V_bW^½ (DESIGN, fact 2), whatever the number
    of tip nodes. Every mode with a contact amplitude is damped, so Im H(iω) is negative definite
    and every eigenvalue lies in the lower half-plane for ω > 0. One blade, or a stack of g sets of
    modes that is evaluated at pairs (frequency, set).

    Attributes
    ----------
    omega
        Λ, rad/s, shape (n,) or (g, n).
    damping_ratio
        ξ, shape (n,) or (g, n).
    factor
        F, kg^-1/2, shape (n, p) or (g, n, p).
    """

    omega: np.ndarray
    damping_ratio: np.ndarray
    factor: np.ndarray

    @property
    def rank(self) -> int:
        """p."""
        return self.factor.shape[-1]

    @cached_property
    def stack(self) -> ContactReceptance:
        """The same with the axis of sets, g = 1 for one blade."""
        if self.omega.ndim == 2:
            return self
        return ContactReceptance(self.omega[None], self.damping_ratio[None], self.factor[None])

    def __getitem__(self, sets: np.ndarray) -> ContactReceptance:
        """Some sets of a stack."""
        return ContactReceptance(self.omega[sets], self.damping_ratio[sets], self.factor[sets])

    @cached_property
    def strength(self) -> np.ndarray:
        """G_jj, kg^-1, shape (g, n)."""
        return (self.stack.factor**2).sum(axis=2)

    def eigenvalues(self, w: np.ndarray, sets: np.ndarray, rest: np.ndarray | None = None) -> np.ndarray:
        """λ(iω) in no order, m/N, shape (p, k), at frequencies ω = w + rest (k,) of sets (k,).

        The rest is what rounding took from w: next to a resonance with ξ = 1e-8 a unit in the last
        place of ω moves λ by as much as 1e-8.
        """
        solve = {1: self._one, 2: self._two}.get(self.rank, self._many)
        pieces = []
        for part in self._parts(len(w)):
            checkpoint()
            h = self._modal(w[part], sets[part], 0.0 if rest is None else rest[part])
            pieces.append(solve(h, sets[part]))
        return pieces[0] if len(pieces) == 1 else np.concatenate(pieces, axis=1)

    def eigenvalue_near(
        self, w: np.ndarray, guess: np.ndarray, sets: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The eigenvalue whose inverse is nearest to `guess` (k,), and dλ/dω."""
        solve = {1: self._one_near, 2: self._two_near}.get(self.rank, self._many_near)
        found = np.empty((2, len(w)), dtype=complex)
        for part in self._parts(len(w)):
            checkpoint()
            found[:, part] = solve(w[part], guess[part], sets[part])
        return found[0], found[1]

    def rounding(self, w: np.ndarray, sets: np.ndarray) -> np.ndarray:
        """Rounding error of the eigenvalues, at most ε Σ_j |h_j| G_jj, m/N, shape (k,)."""
        return 4 * np.finfo(float).eps * (np.abs(self._modal(w, sets)) * self._of(self.strength, sets)).sum(0)

    def bend(self, left: np.ndarray, right: np.ndarray, width: np.ndarray, sets: np.ndarray) -> np.ndarray:
        """Bound of ‖H(iω) − its chord‖ over each interval [left, right], m/N, shape (k,).

        The chord is at most width²/8 · max‖H″‖ away, and with h = 1/P, P = Λ² − ω² + 2iξΛω:
        |h″| = |2P′²/P³ − P″/P²| ≤ 8(right + ξΛ)²/|P|³ + 2/|P|².
        """
        omega, loss = self._of(self.stack.omega, sets), self._of(self._loss, sets)
        nearest = np.clip(omega, left, right)
        p = np.hypot((omega - nearest) * (omega + nearest), 2 * loss * left)
        second = 8 * (right + loss) ** 2 / p**3 + 2 / p**2
        return width**2 / 8 * (self._of(self.strength, sets) * second).sum(0)

    def softening(self, left: np.ndarray, right: np.ndarray, sets: np.ndarray) -> np.ndarray:
        """Σ_j G_jj max(−Re h_j) over each interval [left, right], or more, m/N, shape (k,).

        Re h_j < 0 above Λ only, and there −Re h ≤ min(1/(ω² − Λ²), 1/(4ξΛω)).
        """
        omega, loss = self._of(self.stack.omega, sets), self._of(self._loss, sets)
        most = 1 / np.maximum((left - omega) * (left + omega), 4 * loss * left)
        return (self._of(self.strength, sets) * np.where(omega < right, most, 0.0)).sum(0)

    def _parts(self, count: int) -> list[slice]:
        modes = self.omega.shape[-1]
        # A matrix of LAPACK costs microseconds, and checkpoints are to come some times a second.
        size = modes if self.rank == 1 else modes**2 if self.rank == 2 else 2 * self.rank**3
        step = max(1, _AT_ONCE // size)
        return [slice(i, i + step) for i in range(0, max(count, 1), step)]

    @cached_property
    def _loss(self) -> np.ndarray:
        """ξΛ, rad/s, shape (g, n)."""
        return self.stack.damping_ratio * self.stack.omega

    @cached_property
    def _pairs(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Modes i < j and det(F_ij)², the 2 × 2 minors of F, shape (g, n(n − 1)/2)."""
        f = self.stack.factor
        i, j = np.triu_indices(f.shape[1], 1)
        return i, j, (f[:, i, 0] * f[:, j, 1] - f[:, j, 0] * f[:, i, 1]) ** 2

    def _of(self, table: np.ndarray, sets: np.ndarray) -> np.ndarray:
        """Rows of a table (g, n) for each frequency, shape (n, k); (n, 1) where there is one row."""
        return table.T if len(table) == 1 else table.T[:, sets]

    def _modal(self, w: np.ndarray, sets: np.ndarray, rest: np.ndarray | float = 0.0) -> np.ndarray:
        """h_j = 1/(Λ² − ω² + 2iξΛω), s²/rad², shape (n, k)."""
        omega = self._of(self.stack.omega, sets)
        h = np.empty((len(omega), len(w)), dtype=complex)
        h.real = (omega - w - rest) * (omega + w)  # Λ² − ω² without cancellation near a resonance
        h.imag = 2 * self._of(self._loss, sets) * w
        return np.divide(1.0, h, out=h)

    def _modal_slope(self, h: np.ndarray, w: np.ndarray, sets: np.ndarray) -> np.ndarray:
        """dh_j/dω, shape (n, k)."""
        return 2 * h**2 * (w - 1j * self._of(self._loss, sets))

    def _one(self, h: np.ndarray, sets: np.ndarray) -> np.ndarray:
        return (h * self._of(self.strength, sets)).sum(axis=0)[None]

    def _one_near(self, w: np.ndarray, guess: np.ndarray, sets: np.ndarray) -> tuple[np.ndarray, ...]:
        h, g = self._modal(w, sets), self._of(self.strength, sets)
        return (g * h).sum(axis=0), (g * self._modal_slope(h, w, sets)).sum(axis=0)

    def _two(self, h: np.ndarray, sets: np.ndarray) -> np.ndarray:
        return self._both(h, sets)[0]

    def _both(self, h: np.ndarray, sets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Both roots of λ² − Tλ + Δ = 0 (T = tr H, Δ = det H), and T²/4 − Δ under its root.

        Δ by Cauchy and Binet as Σ_{i<j} h_i h_j det(F_ij)², so that the smaller root Δ/λ₁ keeps
        its digits next to a resonance of the larger; T²/4 − Δ as the product (d + iH₁₂)(d − iH₁₂),
        d = (H₁₁ − H₂₂)/2, so that both keep theirs where they meet.
        """
        f = self.stack.factor
        i, j, minor = self._pairs
        half = (h * self._of(0.5 * self.strength, sets)).sum(axis=0)
        d = (h * self._of(0.5 * (f[:, :, 0] ** 2 - f[:, :, 1] ** 2), sets)).sum(axis=0)
        ih12 = 1j * (h * self._of(f[:, :, 0] * f[:, :, 1], sets)).sum(axis=0)
        det = (h[i] * h[j] * self._of(minor, sets)).sum(axis=0)
        root = np.sqrt((d + ih12) * (d - ih12))
        root = np.where(half.real * root.real + half.imag * root.imag < 0, -root, root)
        large = half + root
        return np.array([large, det / large]), root

    def _two_near(self, w: np.ndarray, guess: np.ndarray, sets: np.ndarray) -> tuple[np.ndarray, ...]:
        """dλ/dω = (T′λ − Δ′)/(2λ − T), or T′/2 of a double eigenvalue."""
        h = self._modal(w, sets)
        slope = self._modal_slope(h, w, sets)
        i, j, minor = self._pairs
        (large, small), root = self._both(h, sets)
        first = np.abs(1 / large - guess) <= np.abs(1 / small - guess)
        lam = np.where(first, large, small)
        trace = (slope * self._of(self.strength, sets)).sum(axis=0)
        det = ((slope[i] * h[j] + h[i] * slope[j]) * self._of(minor, sets)).sum(axis=0)
        double = np.abs(root) < 1e-12 * np.abs(lam)
        gap = np.where(double, 1.0, np.where(first, 2 * root, -2 * root))
        return lam, np.where(double, 0.5 * trace, (trace * lam - det) / gap)

    def _matrix(self, h: np.ndarray, sets: np.ndarray) -> np.ndarray:
        """Fᵀ diag(h) F, shape (k, p, p)."""
        f = self.stack.factor if len(self.stack.factor) == 1 else self.stack.factor[sets]
        return (np.swapaxes(f, 1, 2) * h.T[:, None, :]) @ f

    def _many(self, h: np.ndarray, sets: np.ndarray) -> np.ndarray:
        return np.linalg.eigvals(self._matrix(h, sets)).T

    def _many_near(self, w: np.ndarray, guess: np.ndarray, sets: np.ndarray) -> tuple[np.ndarray, ...]:
        """One step from 1/guess, a tenth of the cost of `eig`.

        With R = (H − λI)⁻¹ and m equal eigenvalues next to λ, tr R = m/δ and tr R² = m/δ² where the
        others are far, so that λ + tr R/tr R² is the eigenvalue, whatever m. dλ/dω = tr(RH′)/tr R.
        """
        h = self._modal(w, sets)
        matrix = self._matrix(h, sets)
        # Where λ is right already H − λI is singular; so far off, the step still restores it. The second
        # part keeps it off where λ is so much smaller than H that the first is lost in rounding.
        aside = 1e-11j / guess + 1e-14j * np.abs(matrix).max(axis=(1, 2))
        for times in (1, 3, 9):
            start = 1.0 / guess + times * aside
            try:
                inverse = np.linalg.inv(matrix - start[:, None, None] * np.eye(self.rank))
                break
            except np.linalg.LinAlgError:
                # Rarely a guess is off by just as much to the other side, and meets λ to the last bit.
                if times == 9:
                    raise
        trace = np.trace(inverse, axis1=1, axis2=2)
        slope = self._matrix(self._modal_slope(h, w, sets), sets)
        return start + trace / (inverse**2).sum(axis=(1, 2)), (inverse * slope).sum(axis=(1, 2)) / trace


@dataclass(frozen=True)
class FrequencyGrid:
    """Intervals of the frequency axis outside which no K_e up to a bound has a root on it.

    Attributes
    ----------
    w, sets
        Frequencies in rad/s, rising within each set of modes, and their set; shape (k,).
    joined
        Where [w[i], w[i + 1]] is one of the intervals, shape (k − 1,).
    """

    w: np.ndarray
    sets: np.ndarray
    joined: np.ndarray

    @classmethod
    def of(
        cls, receptance: ContactReceptance, ke_max: np.ndarray, *, first: float, ratio: float
    ) -> FrequencyGrid:
        """Frequencies crowding geometrically into each resonance.

        A root needs an eigenvalue with Re λ ≤ −1/(2K_e), and Re λ is at least the smallest eigenvalue
        of Re H = Σ_j Re h_j F_jᵀF_j. Only modes with Λ < ω have Re h < 0, and there
        −Re h ≤ min(1/(ω² − Λ²), 1/(4ξΛω)). An interval where 2K_e Σ_j max(−Re h_j) G_jj < 1 is left out.

        Parameters
        ----------
        ke_max
            N/m, one a set, shape (g,).
        first
            Smallest distance from a natural frequency, in half-widths ξω.
        ratio
            Between one distance and the next.
        """
        omega, touched = receptance.stack.omega[:, :, None], receptance.strength[:, :, None] > 0
        width = np.maximum(receptance.stack.damping_ratio, 1e-9)[:, :, None]
        low = np.where(touched, omega, np.inf).min(axis=1)
        strength = receptance.strength.sum(axis=1)
        high = np.sqrt(omega.max(axis=1) ** 2 + 4 * (ke_max * strength)[:, None])
        steps = 2 + int(np.log(1 / (first * width[touched].min())) / np.log(ratio))
        offset = first * width * omega * ratio ** np.arange(steps)
        offset = np.where(touched & (offset <= omega), offset, np.nan)
        g = len(omega)
        resonances = [np.where(touched, omega + d, np.nan).reshape(g, -1) for d in (-offset, [0.0], offset)]
        w = np.concatenate([low, high, *resonances, np.geomspace(low[:, 0], high[:, 0], 24, axis=1)], axis=1)
        w = np.sort(np.where((w >= low) & (w <= high), w, np.nan), axis=1)
        distinct = np.diff(w, prepend=-1.0, axis=1) > 1e-12 * w
        sets, _ = np.nonzero(distinct)
        w = w[distinct]
        joined = sets[1:] == sets[:-1]
        joined &= 2 * ke_max[sets[1:]] * receptance.softening(w[:-1], w[1:], sets[1:]) >= 1
        used = np.r_[joined, False] | np.r_[False, joined]
        return cls(w[used], sets[used], joined[used[:-1]][: used.sum() - 1])

    @property
    def intervals(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Left end, right end and set of each interval."""
        return self.w[:-1][self.joined], self.w[1:][self.joined], self.sets[1:][self.joined]

    def ends(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (p, k) at the frequencies, as values at the left and right end of each interval."""
        return values[:, :-1][:, self.joined], values[:, 1:][:, self.joined]


@dataclass(frozen=True)
class Sweep:
    """Dynamic stiffness 1/λ of every branch, piecewise linear between frequencies.

    1/λ rather than λ, because it is nearly a straight line through a resonance.

    Attributes
    ----------
    left, right
        Ends of the intervals, rad/s, shape (k,).
    z_left, z_right
        1/λ of each branch at the ends, the same branch in the same row, N/m, shape (p, k).
    sets
        Set of modes of each interval, rising, shape (k,).
    """

    left: np.ndarray
    right: np.ndarray
    z_left: np.ndarray
    z_right: np.ndarray
    sets: np.ndarray


def swept(receptance: ContactReceptance, ke_max: float | np.ndarray, tolerance: float = 1e-2) -> Sweep:
    """Sweep of the frequencies at which K_e up to `ke_max` can have a root on the imaginary axis.

    Intervals are halved until 1/λ at the middle is within `tolerance` of the straight line and the
    branches can be told apart, except where no K_e ≤ `ke_max` has a root, and once more at that
    middle.

    Parameters
    ----------
    ke_max
        N/m, one number or one a set of modes.
    """
    ke_max = np.broadcast_to(ke_max, len(receptance.stack.omega))
    grid = FrequencyGrid.of(receptance, ke_max, first=0.5, ratio=1.4)
    left, right, sets = grid.intervals
    z_left, z_right = grid.ends(_dynamic_stiffness(receptance, grid.w, grid.sets))
    done: list[tuple[np.ndarray, ...]] = []
    for _ in range(24):
        z_right, clear = _matched(z_left, z_right)
        middle = 0.5 * (left + right)
        line = 0.5 * (z_left + z_right)
        z_middle, _ = _matched(line, _dynamic_stiffness(receptance, middle, sets))
        size = np.minimum(np.abs(z_left), np.abs(z_right))
        bend = np.abs(z_middle - line)
        straight = bend <= tolerance * np.minimum(size, np.abs(z_middle))
        # A branch that stays stiffer than any root needs, or on the stable side, may stay coarse.
        stiff = size > 4 * ke_max[sets]
        positive = np.minimum(np.minimum(z_left.real, z_right.real), z_middle.real) > 0
        positive &= bend <= 0.3 * size
        settled = ((straight & clear) | stiff | positive).all(axis=0) | (right - left < 1e-9 * right)
        settled |= len(left) > _MOST_INTERVALS
        halves = (
            np.r_[left, middle],
            np.r_[middle, right],
            np.concatenate([z_left, z_middle], axis=1),
            np.concatenate([z_middle, z_right], axis=1),
            np.r_[sets, sets],
        )
        twice = np.r_[settled, settled]
        done.append(tuple(part[..., twice] for part in halves))
        left, right, z_left, z_right, sets = (part[..., ~twice] for part in halves)
        if len(left) == 0:
            break
    else:
        done.append((left, right, z_left, _matched(z_left, z_right)[0], sets))
    parts = [np.concatenate(column, axis=-1) for column in zip(*done, strict=True)]
    order = np.lexsort((parts[0], parts[4]))
    return Sweep(*(part[..., order] for part in parts))


def _dynamic_stiffness(receptance: ContactReceptance, w: np.ndarray, sets: np.ndarray) -> np.ndarray:
    """1/λ(iω), bounded so that its square still fits a double; no K_e comes near the bound."""
    lam = receptance.eigenvalues(w, sets)
    return 1.0 / np.where(np.abs(lam) < 1e-120, 1e-120, lam)


def _matched(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of b (p, k) permuted, column by column, to lie nearest to a; and where that is clear.

    Distances are relative, so that a soft branch is not lost among stiff ones. Clear is where each
    branch has its match at less than half the distance of any other, those aside that lie so near
    to the match that it does not matter.
    """
    p, k = a.shape
    if p == 1:
        return b, np.ones((1, k), dtype=bool)
    distance = np.abs(a[:, None] - b[None])
    distance /= np.abs(a)[:, None] + np.abs(b)[None]
    chosen = distance == distance.min(axis=1, keepdims=True)
    twice = (chosen.sum(axis=0) != 1).any(axis=0) | (chosen.sum(axis=1) != 1).any(axis=0)
    if twice.any():
        chosen[:, :, twice] = _greedy(distance[:, :, twice])
    matched = np.where(chosen, b[None], 0.0).sum(axis=1)
    own = np.where(chosen, distance, 0.0).sum(axis=1)
    clear = own < 0.5 * np.where(chosen, np.inf, distance).min(axis=1)
    unclear = np.flatnonzero(~clear.all(axis=0))
    if len(unclear):
        b, match, distance = b[None, :, unclear], matched[:, None, unclear], distance[:, :, unclear]
        twin = np.abs(b - match) < 1e-4 * (np.abs(b) + np.abs(match))
        clear[:, unclear] = own[:, unclear] < 0.5 * np.where(twin, np.inf, distance).min(axis=1)
    return matched, clear


def _greedy(distance: np.ndarray) -> np.ndarray:
    """One partner for each branch (p, p, k): the nearest pair first, then the nearest of the rest."""
    p, _, k = distance.shape
    left = distance.reshape(p * p, k).copy()
    chosen = np.zeros((p, p, k), dtype=bool)
    columns = np.arange(k)
    for _ in range(p):
        i, j = np.divmod(left.argmin(axis=0), p)
        chosen[i, j, columns] = True
        square = left.reshape(p, p, k)
        square[i, :, columns] = np.inf
        square[:, j, columns] = np.inf
    return chosen

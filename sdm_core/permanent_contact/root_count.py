"""Number of unstable roots in permanent contact, by the argument principle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.interruption import checkpoint
from sdm_core.permanent_contact.receptance import ContactReceptance, FrequencyGrid

_MOST_PIECES = 50  # in doubt at once for one K_e, by the entries of F


def unstable_root_count(
    receptance: ContactReceptance,
    speed_hz: float | np.ndarray,
    ke: np.ndarray,
    sets: np.ndarray | None = None,
) -> np.ndarray:
    """Characteristic roots with positive real part, for each K_e at one rotor speed or more.

    D(s) = det(I + K_e(1 − e^{−sτ}) H(s)) has no pole in the right half-plane, so its zeros there
    number −(1/π) × the change of arg D(iω) from ω = 0 to ∞. D is a product over the eigenvalues λ
    of H(iω), and the delay can be taken out of each factor. Where Re λ > −1/(2K_e),

        1 + K_e(1 − e^{−iωτ})λ = (1 + K_eλ)(1 − q e^{−iωτ}),   q = K_eλ/(1 + K_eλ), |q| < 1,

    and as λ and 1 + K_eλ lie in the lower half-plane, both arguments are principal values: there
    is nothing to follow. Where Re λ < −1/(2K_e) it is −K_eλe^{−iωτ}(1 − e^{iωτ}/q), the same but for
    the phase −ωτ. On the limit the two differ by 2πk, k = ⌊ψ/2π⌋, ψ = ωτ + π − 2α, α = arg(−λ). So

        unstable roots = 2 Σ (k where λ leaves Re λ < −1/(2K_e) as ω rises − k where it enters).

    Frequencies are added where such a place may hide, or k is in doubt. With one eigenvalue the
    curvature of H is bounded and nothing can hide; with more it is measured at the middle of
    each interval.

    Parameters
    ----------
    speed_hz
        Ω, Hz; one, or one a case, shape (c,).
    ke
        N/m, shape (m,), or (c, m).
    sets
        Set of modes of each case, shape (c,).

    Returns
    -------
    Counts as floats, shape (m,) at one speed, else (c, m); NaN where a root lies on the axis to
    rounding.
    """
    ke = np.asarray(ke, dtype=float)
    speed = np.atleast_1d(np.asarray(speed_hz, dtype=float))
    sets = np.zeros(len(speed), dtype=int) if sets is None else sets
    table = np.broadcast_to(ke, (len(speed), ke.shape[-1] if ke.ndim else 1))
    count = np.zeros(table.shape)
    if receptance.rank and (table > 0).any():
        case, column = np.nonzero(table > 0)
        count[case, column] = _counted(receptance, sets[case], 1.0 / speed[case], table[case, column])
    return count if np.ndim(speed_hz) else count[0]


@dataclass(frozen=True)
class _Pieces:
    """Pieces of the frequency axis, with the eigenvalues in places 1 to p by rising real part.

    Attributes
    ----------
    w, rest
        ω as w + rest at both ends, rad/s, shape (2, k).
    lam
        λ at both ends, m/N, shape (2, p, k).
    slack
        How far Re λ and Im λ may stray from between their ends, m/N, shape (2, p, k).
    smooth
        Where no eigenvalue changes places, shape (k,).
    sets
        Set of modes, shape (k,).
    """

    w: np.ndarray
    rest: np.ndarray
    lam: np.ndarray
    slack: np.ndarray
    smooth: np.ndarray
    sets: np.ndarray

    @classmethod
    def halves(
        cls, receptance: ContactReceptance, w: np.ndarray, rest: np.ndarray, lam: np.ndarray, sets: np.ndarray
    ) -> _Pieces:
        """Both halves of intervals known at left, middle and right: w (3, k), λ (3, p, k)."""
        w, rest, ends = (np.concatenate([part[:2], part[1:]], axis=-1) for part in (w, rest, lam))
        sets = np.r_[sets, sets]
        if receptance.rank == 1:
            bend = receptance.bend(w[0], w[1], _width(w, rest), sets)
            return cls(w, rest, ends, np.array([[bend], [bend]]), np.ones(len(sets), dtype=bool), sets)
        # Re λ of one place is continuous, with a kink where two change places. Half of a kink shows at
        # the middle, and four times what is left in the halves of a smooth curve. Im λ jumps there.
        off = 2 * (lam[1] - 0.5 * (lam[0] + lam[2]))
        smooth = (np.abs(off) <= 0.25 * np.abs(lam).min(axis=0)).all(axis=0)
        slack = np.tile(np.abs([off.real, off.imag]), 2)
        if receptance.rank > 2:
            slack += receptance.rounding(w[0], sets)
        return cls(w, rest, ends, slack, np.tile(smooth, 2), sets)

    def __getitem__(self, rows: np.ndarray) -> _Pieces:
        return _Pieces(
            self.w[:, rows],
            self.rest[:, rows],
            self.lam[..., rows],
            self.slack[..., rows],
            self.smooth[rows],
            self.sets[rows],
        )

    @property
    def reach(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest Re λ of each place, m/N, shape (p, k)."""
        re = self.lam.real
        return re.min(axis=0) - self.slack[0], re.max(axis=0) + self.slack[0]

    def turns(self, place: np.ndarray, tau: np.ndarray, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """⌊ψ/2π⌋, the least and the most it can be where Re λ of a place is `level`, shape (k,)."""
        columns = np.arange(len(place))
        im = np.abs(self.lam.imag[:, place, columns])  # < 0, but for rounding
        slack = self.slack[1, place, columns]
        least = np.arctan2(np.maximum(im.min(axis=0) - slack, 0.0), -level) / np.pi
        most = np.arctan2(im.max(axis=0) + slack, -level) / np.pi
        ends = self.w * tau / (2 * np.pi) + 0.5
        rounding = 1e-14 + 4 * np.finfo(float).eps * ends[1]
        return np.floor(ends[0] - most - rounding), np.floor(ends[1] - least + rounding)


def _counted(receptance: ContactReceptance, sets: np.ndarray, tau: np.ndarray, ke: np.ndarray) -> np.ndarray:
    """Counts for each entry (set of modes, delay, K_e), shape (k,)."""
    level = -0.5 / ke
    pairs = np.zeros(len(ke))
    doubtful = np.zeros(len(ke), dtype=bool)
    most = _MOST_PIECES * receptance.stack.factor[0].size
    entry, place, pieces = _met(_first_pieces(receptance, sets, ke), sets, level)
    while len(entry):
        checkpoint()
        low, high = pieces.turns(place, tau[entry], level[entry])
        clear = pieces.smooth & (low == high)
        before, after = pieces.lam.real[:, place, np.arange(len(place))] < level[entry]
        pairs += np.bincount(entry, clear * low * (before * 1.0 - after), minlength=len(ke))
        narrow = _width(pieces.w, pieces.rest) <= np.finfo(float).eps ** 1.5 * pieces.w[1]
        doubtful[entry[~clear & narrow]] = True
        # With a root on the axis to rounding every piece of a piece stays in doubt.
        doubtful |= np.bincount(entry[~clear], minlength=len(ke)) > most
        go = ~clear & ~doubtful[entry]
        entry, place = np.tile(entry[go], 4), np.tile(place[go], 4)
        pieces = _quartered(receptance, pieces[go])
        lowest, highest = (bound[place, np.arange(len(place))] for bound in pieces.reach)
        near = (lowest <= level[entry]) & (level[entry] <= highest)
        entry, place, pieces = entry[near], place[near], pieces[near]
    return np.where(doubtful, np.nan, 2 * pairs)


def _first_pieces(receptance: ContactReceptance, sets: np.ndarray, ke: np.ndarray) -> _Pieces:
    """Where a root may lie, once for all entries of a set."""
    most = np.zeros(len(receptance.stack.omega))
    np.maximum.at(most, sets, ke)
    grid = FrequencyGrid.of(receptance, most, first=0.37, ratio=1.3)
    left, right, owner = grid.intervals
    middle = 0.5 * (left + right)
    ends = grid.ends(_by_real_part(receptance.eigenvalues(grid.w, grid.sets)))
    lam = np.array([ends[0], _by_real_part(receptance.eigenvalues(middle, owner)), ends[1]])
    w = np.array([left, middle, right])
    return _Pieces.halves(receptance, w, np.zeros_like(w), lam, owner)


def _met(pieces: _Pieces, sets: np.ndarray, level: np.ndarray) -> tuple[np.ndarray, np.ndarray, _Pieces]:
    """Entry, place and piece, wherever the level −1/(2K_e) of an entry is within reach."""
    order = np.lexsort((level, sets))
    start = np.searchsorted(sets[order], np.arange(max(sets.max(), pieces.sets.max(initial=0)) + 2))
    present = np.diff(start) > 0
    softest = np.where(present, level[order][start[:-1] * present], np.inf)[pieces.sets]
    stiffest = np.where(present, level[order][start[1:] - 1], -np.inf)[pieces.sets]
    lowest, highest = pieces.reach
    place, row = np.nonzero((lowest <= stiffest) & (highest >= softest))
    key = (sets + 1j * level)[order]  # complex numbers sort by real part, then imaginary part
    first = np.searchsorted(key, pieces.sets[row] + 1j * lowest[place, row])
    count = np.searchsorted(key, pieces.sets[row] + 1j * highest[place, row], side="right") - first
    pair = np.repeat(np.arange(len(first)), count)
    index = np.arange(len(pair)) - np.repeat(np.cumsum(count) - count - first, count)
    return order[index], place[pair], pieces[row[pair]]


def _quartered(receptance: ContactReceptance, pieces: _Pieces) -> _Pieces:
    """Each piece in four, in four blocks."""
    step = pieces.rest[0] + np.linspace(0.0, 1.0, 5)[:, None] * _width(pieces.w, pieces.rest)
    w = pieces.w[0] + step
    rest = step - (w - pieces.w[0])
    inner = receptance.eigenvalues(w[1:4].ravel(), np.tile(pieces.sets, 3), rest[1:4].ravel())
    inner = _by_real_part(inner).reshape(len(inner), 3, -1).swapaxes(0, 1)
    lam = np.concatenate([pieces.lam[:1], inner, pieces.lam[1:]])
    w, rest, lam = (np.concatenate([part[:3], part[2:]], axis=-1) for part in (w, rest, lam))
    return _Pieces.halves(receptance, w, rest, lam, np.tile(pieces.sets, 2))


def _width(w: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Width of pieces with ends w + rest (2, k), rad/s, shape (k,)."""
    return (w[1] - w[0]) + (rest[1] - rest[0])


def _by_real_part(lam: np.ndarray) -> np.ndarray:
    """Eigenvalues (p, k) in columns by rising real part."""
    if len(lam) == 1:
        return lam
    return np.take_along_axis(lam, np.argsort(lam.real, axis=0), axis=0)

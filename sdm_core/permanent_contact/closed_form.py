"""Closed-form stability boundary in permanent contact (DESIGN, fact 2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.crossings import Crossings
from sdm_core.interruption import checkpoint
from sdm_core.permanent_contact.phase_condition import Guesses, guesses, loss_angle
from sdm_core.permanent_contact.receptance import ContactReceptance, Sweep, swept


@dataclass(frozen=True)
class CrossingTable:
    """Crossings of many cases in one table, by case and then by rising K_e.

    Attributes
    ----------
    start
        First row of each case, and the number of rows; shape (cases + 1,).
    case, ke, frequency_hz, direction, error_estimate
        One row a crossing, as in `Crossings`.
    """

    start: np.ndarray
    case: np.ndarray
    ke: np.ndarray
    frequency_hz: np.ndarray
    direction: np.ndarray
    error_estimate: np.ndarray

    @classmethod
    def of_rows(cls, cases: int, rows: np.ndarray) -> CrossingTable:
        """From case, K_e, ω, direction and error in sorted columns, shape (5, k)."""
        case, ke, w, direction, error = rows
        case = case.astype(int)
        start = np.searchsorted(case, np.arange(cases + 1))
        return cls(start, case, ke, w / (2 * np.pi), direction, error)

    def of(self, case: int) -> Crossings:
        """The crossings of one case."""
        rows = slice(self.start[case], self.start[case + 1])
        return Crossings(
            self.ke[rows], self.frequency_hz[rows], self.direction[rows], self.error_estimate[rows]
        )

    @property
    def unstable_pairs(self) -> np.ndarray:
        """Pairs of unstable roots above each crossing, shape of `ke`."""
        total = np.cumsum(self.direction)
        return total - np.r_[0.0, total][self.start[self.case]]


def crossings(
    receptance: ContactReceptance,
    speed_hz: float,
    ke_max: float,
    *,
    sweep: Sweep | None = None,
    first_only: bool = False,
) -> Crossings:
    """All K_e up to `ke_max` at which a root lies on the imaginary axis, at one rotor speed.

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
    one = np.zeros(1, dtype=int)
    return all_crossings(
        receptance, np.array([speed_hz]), np.array([ke_max]), one, sweep=sweep, first_only=first_only
    ).of(0)


def all_crossings(
    receptance: ContactReceptance,
    speed_hz: np.ndarray,
    ke_max: np.ndarray,
    sets: np.ndarray,
    *,
    sweep: Sweep | None = None,
    first_only: bool = False,
) -> CrossingTable:
    """The crossings of many cases, each a rotor speed with one set of modes of the receptance.

    With λ(ω) an eigenvalue of H(iω), a root s = iω needs e^{−iωτ} = 1 + 1/(K_e λ). Its modulus
    gives K_e = −1/(2 Re λ), its phase ψ = ωτ + π − 2α = 2πk, α = arg(−λ) the loss angle, which lies
    between 0 and π. The phase condition is solved on the piecewise linear 1/λ of the sweep, then
    by Newton's method on the exact eigenvalue.

    Parameters
    ----------
    speed_hz, ke_max
        Ω in Hz and K_e in N/m, shape (cases,).
    sets
        Set of modes of each case, shape (cases,).
    """
    if receptance.rank == 0:
        return CrossingTable.of_rows(len(speed_hz), np.zeros((5, 0)))
    if sweep is None:
        most = np.zeros(len(receptance.stack.omega))
        np.maximum.at(most, sets, ke_max)
        sweep = swept(receptance, most)
    tau = 1.0 / speed_hz
    found = [np.zeros((5, 0))]
    for some in guesses(receptance, sweep, tau, sets, ke_max.max()):
        checkpoint()
        # The smallest K_e, as far as the line is to be trusted.
        size = np.abs(some.z)
        ke = size**2 / (2 * np.maximum(0.005 * size - some.z.real, 1e-9 * size))
        bound = 1.2 * ke_max
        if first_only:
            least = np.full(len(tau), np.inf)
            np.minimum.at(least, some.case, ke)
            bound = np.minimum(bound, 1.3 * least)
        near = some[ke <= bound[some.case]]
        refined = _refined(receptance, sets[near.case], tau[near.case], near)
        inside = (refined[0] > 0) & (refined[0] <= ke_max[near.case])
        found.append(np.array([near.case, *refined])[:, inside])
    return CrossingTable.of_rows(len(tau), _distinct(receptance, sets, tau, np.concatenate(found, axis=1)))


def _refined(
    receptance: ContactReceptance, sets: np.ndarray, tau: np.ndarray, some: Guesses
) -> tuple[np.ndarray, ...]:
    """Newton's method on ψ(ω) = 2πk: K_e, ω, direction and error; K_e is 0 where it goes astray."""

    def phase(w: np.ndarray, z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, ...]:
        lam, slope = receptance.eigenvalue_near(w, z, sets[rows])
        residual = (w * tau[rows] - 2 * np.pi * some.turn[rows]) + (np.pi - 2 * loss_angle(lam))
        return lam, slope, residual, tau[rows] - 2 * (slope / lam).imag

    w, z = some.w.copy(), some.z.copy()
    active = np.arange(len(w))
    for _ in range(60):
        lam, slope, residual, rate = phase(w[active], z[active], active)
        reach = 0.5 * some.spread[active]
        with np.errstate(divide="ignore", invalid="ignore"):
            move = np.clip(np.nan_to_num(-residual / rate), -reach, reach)
        w[active] += move
        z[active] = 1.0 / lam - slope / lam**2 * move
        active = active[np.abs(move) > 1e-14 * w[active]]
        if len(active) == 0:
            break
    lam, slope, residual, rate = phase(w, z, np.arange(len(w)))
    # What rounding leaves of ψ, through ω and through λ. Where ψ only nearly touches 2πk, Newton's
    # method wanders about the nearest point, and the residual there is larger.
    eps, rounding = np.finfo(float).eps, receptance.rounding(w, sets)
    noise = 4 * eps * w * (tau + np.abs(tau - rate)) + 2 * rounding / np.abs(lam)
    good = (np.abs(residual) <= 32 * noise) & (lam.real < 0) & (np.abs(w - some.w) <= 4 * some.spread)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ke = np.where(good, -1.0 / (2 * lam.real), 0.0)
        offset = (np.abs(residual) + noise) / np.abs(rate) + 4 * eps * w
        error = (np.abs(slope.real) * offset + rounding) / np.abs(lam.real)
    # One more pair is unstable where ψ passes 2πk rising (`unstable_root_count`).
    return ke, w, np.sign(rate), np.nan_to_num(error, nan=np.inf, posinf=np.inf) + 1e-14


def _distinct(
    receptance: ContactReceptance, sets: np.ndarray, tau: np.ndarray, rows: np.ndarray
) -> np.ndarray:
    """Crossings sorted by case and K_e, each as often as its eigenvalue λ = 1/(K_e(e^{−iωτ} − 1))."""
    rows = rows[:, np.lexsort((rows[2], rows[1], rows[0]))]
    case, ke, w, direction, error = rows
    same = np.minimum(1e-9 + 2 * (error[1:] + error[:-1]), 1e-6)
    alike = (np.diff(case) == 0) & (np.diff(direction) == 0) & (np.diff(ke) <= same * ke[1:])
    alike &= np.abs(np.diff(w)) <= same * w[1:]
    if not alike.any():
        return rows
    first = np.flatnonzero(np.r_[True, ~alike])
    size = np.diff(np.r_[first, len(case)])
    crowd = first[size > 1]
    owner = case[crowd].astype(int)
    lam = 1.0 / (ke[crowd] * (np.exp(-1j * w[crowd] * tau[owner]) - 1))
    times = np.ones(len(first), dtype=int)
    near = np.abs(receptance.eigenvalues(w[crowd], sets[owner]) - lam) <= 1e-6 * np.abs(lam)
    times[size > 1] = np.maximum(near.sum(axis=0), 1)
    return rows[:, np.arange(len(case)) - np.repeat(first, size) < np.repeat(times, size)]

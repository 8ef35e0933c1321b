"""The exact characteristic equation of a rubbing blade, whatever its engagement (DESIGN, fact 5)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sdm_core.floquet.propagation import Fundamental, Propagation, for_many, propagation_of
from sdm_core.floquet.smooth_propagation import SmoothPropagation
from sdm_core.floquet.winding import half_turns
from sdm_core.interruption import checkpoint
from sdm_core.rubbing_blade import RubbingBlade

_LARGEST_GROWTH = 1e11  # of an entry of M: what is smaller than its rounding error no longer shows
_AT_REST = 1e-10  # of the contact's displacement, relative to that of the modes
_MOST_OSCILLATIONS = 200_000.0  # rad a revolution that the chatter frequency is looked for among


def determinant(m: np.ndarray, mu: np.ndarray) -> np.ndarray:
    """det(I − M/μ), shape (k,); NaN where M grows so much that rounding would hide a multiplier."""
    with np.errstate(all="ignore"):
        m = np.where((np.abs(m).max(axis=(1, 2)) < _LARGEST_GROWTH)[:, None, None], m, np.nan)
        return np.linalg.det(np.eye(m.shape[-1]) - m / mu[:, None, None])


def first_points(motion: Propagation, ke: np.ndarray, radius: float = 1.0) -> np.ndarray:
    """Points of the half circle |μ| = `radius` to begin a count with, shape (b,).

    Contact adds a phase of up to K_e |1/μ − 1| × `phase_shift` over a revolution; those of all
    unstable multipliers together turn the determinant about as much.
    """
    return 17 + np.minimum(1000.0, 0.5 * motion.phase_shift * ke * (1 + 1 / radius)).astype(int)


def count_outside(motion: Propagation, ke: np.ndarray, many: Fundamental | None = None) -> np.ndarray:
    """Multipliers outside the unit circle of each problem of a batch, shape (b,); −1 where not decided.

    `many` is the same motion `for_many` |c| ≤ 2 K_e, where already there.
    """
    ready = for_many(motion, 2 * ke) if many is None else many

    def value(case: np.ndarray, angle: np.ndarray) -> np.ndarray:
        checkpoint()
        mu = np.exp(1j * angle)
        chunk = 4000
        parts = [slice(i, i + chunk) for i in range(0, len(case), chunk)]
        return np.concatenate(
            [determinant(ready.fundamental(case[p], ke[case[p]] * (1 / mu[p] - 1)), mu[p]) for p in parts]
        )

    # Contact makes vibration grow most a quarter turn round the circle: what is hidden shows there first.
    probe = value(np.arange(len(motion)), np.full(len(motion), 0.5 * np.pi))
    points = np.where(np.isfinite(probe), first_points(motion, ke), 0)
    turns, _ = half_turns(value, points)
    count = -np.round(np.where(np.isnan(turns), 1.0, turns)).astype(int)
    return np.where((count >= 0) & (np.abs(turns + count) < 1e-3), count, -1)


@dataclass
class CharacteristicEquation:
    """det(I − M(μ)/μ) = 0, M(μ) the fundamental matrix over one revolution.

    A Floquet solution has x(t − τ) = x(t)/μ, so the delayed force is K_e γ(t) G (1/μ − 1) x and
    the multipliers are the eigenvalues of M(μ) that equal μ: on each arc the coefficients are
    constant and M is a product of matrix exponentials, with smooth γ it is integrated to rounding. The
    delay is not discretized.

    Attributes
    ----------
    problem
        The rubbing blade.
    evaluations
        Fundamental matrices computed so far: the cost.
    """

    problem: RubbingBlade
    evaluations: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self._motion = propagation_of([self.problem])

    @property
    def size(self) -> int:
        """2n."""
        return self._motion.size

    def fundamental(self, mu: np.ndarray) -> np.ndarray:
        """M(μ), shape (m, 2n, 2n)."""
        mu = np.atleast_1d(np.asarray(mu, dtype=complex))
        self.evaluations += len(mu)
        with np.errstate(all="ignore"):  # near μ = 0, an essential singularity
            return self._motion.fundamental(np.zeros(len(mu), dtype=int), self.problem.ke * (1 / mu - 1))

    def value(self, mu: np.ndarray) -> np.ndarray:
        """det(I − M(μ)/μ), shape (m,); NaN where M grows so much that rounding would hide a multiplier."""
        mu = np.atleast_1d(np.asarray(mu, dtype=complex))
        out = np.empty(len(mu), dtype=complex)
        chunk = max(1, int(4000 * (10 / self.size) ** 3))
        for i in range(0, len(mu), chunk):
            part = mu[i : i + chunk]
            out[i : i + chunk] = determinant(self.fundamental(part), part)
        return out

    def _candidates(self, mu: np.ndarray) -> np.ndarray:
        """Eigenvalues of M(μ), shape (m, 2n); rows that overflow are zero."""
        matrices = self.fundamental(mu)
        matrices[~np.isfinite(matrices).all(axis=(1, 2))] = 0.0
        with np.errstate(all="ignore"):
            nu = np.linalg.eigvals(matrices)
        return np.where(np.isfinite(nu), nu, 0.0)

    def count_outside(self, radius: float = 1.0) -> int | None:
        """Multipliers with modulus above `radius`, or None when one lies on the circle to rounding.

        det(μI − M(μ)) has 2n zeros' worth of growth at infinity and an essential singularity at 0,
        so zeros are counted from outside: their number is minus the winding number of
        det(I − M(μ)/μ) round the circle. Conjugate symmetry leaves half of it.
        """
        turns, _ = self._on_circle(radius)
        count = -round(turns) if np.isfinite(turns) else -1
        return count if count >= 0 and abs(turns + count) < 1e-3 else None

    def crossing_near(self, radius: float = 1.0) -> complex:
        """Point of the circle nearest to a multiplier, as the determinant shows it."""
        return complex(radius * np.exp(1j * self._on_circle(radius)[1]))

    def _on_circle(self, radius: float) -> tuple[float, float]:
        turns, nearest = half_turns(
            lambda _, angle: self.value(radius * np.exp(1j * angle)), np.array([self._first_points(radius)])
        )
        return float(turns[0]), float(nearest[0])

    def _first_points(self, radius: float) -> int:
        return int(first_points(self._motion, np.array([self.problem.ke]), radius)[0])

    def dominant(self, unstable: int | None = None) -> tuple[complex, float]:
        """Multiplier of largest modulus (upper half-plane) and the relative error of its modulus.

        Candidates are eigenvalues ν of M(μ) on a circle whose argument is near that of μ; Newton's
        method makes them exact, and the argument principle proves that none lies outside the
        largest. Where one does, the next circle lies between the largest found and the
        smallest radius known to hold all.

        Parameters
        ----------
        unstable
            `count_outside(1.0)`, where already known.

        Returns
        -------
        The multiplier, and an infinite error where the proof did not succeed.
        """
        unstable = self.count_outside(1.0) if unstable is None else unstable
        low, high = 0.0, 1.0 if unstable == 0 else np.inf
        radius, best = 1.0, 0j
        for _ in range(16):
            for starts in self._starts(radius):
                best = max([best, *self._newton(starts)], key=abs)
                low = abs(best)
                outside = self.count_outside(low * (1 + 1e-7)) if low > 0 else -1
                if outside == 0:
                    return complex(best.real, abs(best.imag)), self._newton_step(best)
                if outside is None:
                    return complex(best.real, abs(best.imag)), np.inf
            if np.isinf(high):
                radius = 2.0 * max(radius, low)
                high = radius if self.count_outside(radius) == 0 else high
            elif low <= 0.01 * radius:
                radius *= 0.6
                continue
            radius = np.sqrt(low * high) if np.isfinite(high) else radius
            if np.isfinite(high) and self.count_outside(radius) == 0:
                high = radius
                radius = np.sqrt(low * high)
        return complex(best.real, abs(best.imag)), np.inf

    def one_outside(self) -> tuple[complex, float]:
        """Some multiplier outside the circle and the relative error of its modulus; zero if none is met."""
        for radius in (1.5, 4.0, 12.0):
            for starts in self._starts(radius):
                best = max([0j, *self._newton(starts)], key=abs)
                if abs(best) > 1.0:
                    return complex(best.real, abs(best.imag)), self._newton_step(best)
        return 0j, np.inf

    def chatter_hz(self, mu: complex) -> float:
        """Frequency of the largest Fourier component of the contact displacement, Hz.

        The Floquet solution of multiplier μ is e^{(ln μ/τ)t} times a τ-periodic function; its
        components lie at |arg μ/2π + k|Ω (DESIGN, section 1).
        """
        p = self.problem
        if p.contact_factor.shape[1] == 0:  # no mode moves the contact nodes
            return float("nan")
        matrix = self.fundamental(np.array([mu]))[0]
        # The fastest oscillation there can be.
        fastest = np.sqrt(p.omega.max() ** 2 + 2 * p.ke * np.trace(p.contact_matrix))
        if not (fastest * p.tau < _MOST_OSCILLATIONS and np.isfinite(matrix).all()):
            return float("nan")
        nu, vectors = np.linalg.eig(matrix)
        state = vectors[:, np.argmin(np.abs(nu - mu))]
        if isinstance(self._motion, SmoothPropagation):
            motion = self._motion.displacement(0, p.ke * (1 / mu - 1), state)
        else:
            motion = self._displacement(mu, state, 64 * int(np.ceil(max(8.0, fastest * p.tau / 8))))
        if (
            np.abs(motion).max()
            < _AT_REST * np.abs(p.contact_factor).max() * np.abs(state[: len(p.omega)]).max()
        ):
            return float("nan")  # the mode does not move the contact: what is left is rounding
        samples = len(motion)
        periodic = motion * np.exp(-np.log(mu) * np.arange(samples) / samples)[:, None]
        spectrum = (np.abs(np.fft.fft(periodic, axis=0)) ** 2).sum(axis=1)
        k = np.fft.fftfreq(samples, 1 / samples)[np.argmax(spectrum)]
        return float(abs(np.angle(mu) / (2 * np.pi) + k) * p.speed_hz)

    def _displacement(self, mu: complex, state: np.ndarray, samples: int) -> np.ndarray:
        """Fᵀx at equal times of a revolution that begins with `state`, arc by arc, shape (samples, p)."""
        p, n = self.problem, len(self.problem.omega)
        free, contact = self._rates()
        engaged = free + (1 / mu - 1) * contact
        edges = np.cumsum([0.0, *(s.length for s in p.segments)])
        t = np.arange(samples) / samples
        motion = np.empty((samples, p.contact_factor.shape[1]), dtype=complex)
        for segment, start, end in zip(p.segments, edges[:-1], edges[1:], strict=True):
            inside = (t >= start - 1e-12) & (t < end - 1e-12)
            rates, modes = np.linalg.eig(engaged if segment.engaged else free.astype(complex))
            amplitude = np.linalg.solve(modes, state)
            history = modes[:n] @ (amplitude[:, None] * np.exp(rates[:, None] * (t[inside] - start)))
            motion[inside] = history.T @ p.contact_factor
            state = modes @ (amplitude * np.exp(rates * segment.length))
        return motion

    def _rates(self) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients of free motion and of contact, per revolution, shape (2n, 2n) each."""
        angle, n = self._motion.angle[0], len(self.problem.omega)
        free, contact = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
        free[:n, n:], free[n:, :n] = np.diag(angle), -np.diag(angle)
        free[n:, n:] = -2 * np.diag(self.problem.damping_ratio * angle)
        contact[n:, :n] = self.problem.ke * self._motion.coupling[0]
        return free, contact

    def _starts(self, radius: float) -> list[np.ndarray]:
        """Starting points for Newton's method in batches, the most promising first."""
        angle = np.linspace(0.0, np.pi, 2 * self._first_points(radius) + 1)
        mu = radius * np.exp(1j * angle)
        nu = self._candidates(mu)
        # Branches need no tracking: an eigenvalue whose argument is near that of μ is nearly a root.
        offset = np.abs(np.angle(nu / mu[:, None]))
        rows, columns = np.nonzero((offset < 0.3) & (np.abs(nu) > 1e-12))
        found, offset = nu[rows, columns], offset[rows, columns]
        found = found[np.argsort(offset - np.log(np.abs(found)))]
        apart: list[complex] = []
        for start in found:
            if all(abs(start - other) > 0.05 * abs(other) for other in apart):
                apart.append(start)
            if len(apart) == 40:
                break
        starts = np.array(apart, dtype=complex)
        starts *= np.clip(np.abs(starts), 0.5 * radius, 2 * radius) / np.abs(starts)
        return [starts[i : i + 8] for i in range(0, len(starts), 8)]

    def _newton(self, start: np.ndarray) -> np.ndarray:
        """Roots reached from the starts, by Newton's method on log μ with a numerical slope."""
        x = np.log(start)
        alive = np.ones(len(x), dtype=bool)
        h = 1e-6
        step = np.full(len(x), np.inf, dtype=complex)
        for _ in range(25):
            go = np.flatnonzero(alive & (np.abs(step) > 1e-13))
            if len(go) == 0:
                break
            f = self.value(np.exp(x[go]))
            with np.errstate(all="ignore"):
                slope = (self.value(np.exp(x[go] + h)) - self.value(np.exp(x[go] - h))) / (2 * h)
                move = np.where(slope != 0, -f / slope, np.inf)
            alive[go] &= np.isfinite(move)
            move[~np.isfinite(move)] = 0.0
            move *= np.minimum(1.0, 0.3 / np.maximum(np.abs(move), 1e-300))
            step[go] = move
            x[go] = x[go] + move
            alive &= (x.real > -60) & (x.real < 60)
        done = alive & (np.abs(step) < 1e-9)
        return np.exp(x[done])

    def _newton_step(self, mu: complex) -> float:
        """Size of one more Newton step on log μ: what is left of the error."""
        h = 1e-6
        value = self.value(np.array([mu, mu * np.exp(h), mu * np.exp(-h)]))
        slope = (value[1] - value[2]) / (2 * h)
        return float(abs(value[0] / slope)) + 1e-14 if slope != 0 else np.inf

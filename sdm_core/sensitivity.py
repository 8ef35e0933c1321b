"""Exact derivatives of a multiplier, and of the K_e at which it crosses the unit circle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.linalg import expm

from sdm_core.errors import InvalidInput
from sdm_core.rubbing_blade import RubbingBlade
from sdm_core.validation import KE_LIMIT, number

_FARTHEST_START = 1e-3  # Newton's first step on ln μ from what the caller takes for a multiplier
_LAST_STEP = 1e-9  # on ln μ: the error left is its square
_MOST_STEPS = 60  # towards a double multiplier each only halves the distance
_ON_CIRCLE = 1e-6  # |ln|μ|| of what the caller takes for a crossing
_WORST_CONDITION = 1e7  # a double multiplier itself is only found to √ε, and shows as about 1/√ε
_LARGEST_GROWTH = 1e11  # of an entry of M/μ: as in `CharacteristicEquation`
_EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Gradient:
    """Derivatives of one quantity with respect to every parameter of a `RubbingBlade`.

    Attributes
    ----------
    omega
        Per rad/s, shape (n,).
    damping_ratio
        Per unit of ξ, shape (n,).
    contact_matrix
        Per kg^-1 of each entry of G by itself, symmetric, shape (n, n): of a symmetric change dG the
        quantity changes by Σ_ij contact_matrix_ij dG_ij.
    speed_hz
        Per Hz of Ω at frozen modal data and arcs in revolutions.
    ke
        Per N/m.
    arcs
        Per revolution of each arc's start and end, shape (arcs, 2); empty in permanent contact.
    """

    omega: np.ndarray
    damping_ratio: np.ndarray
    contact_matrix: np.ndarray
    speed_hz: np.ndarray
    ke: np.ndarray
    arcs: np.ndarray

    @classmethod
    def unknown(cls, problem: RubbingBlade) -> Gradient:
        """NaN throughout."""
        n, arcs = len(problem.omega), len(problem.arcs or ())
        return cls(*(np.full(shape, np.nan) for shape in (n, n, (n, n), (), (), (arcs, 2))))

    def mapped(self, function: Callable[..., np.ndarray], *others: Gradient) -> Gradient:
        """`function` of the derivatives of this gradient and others, parameter by parameter."""
        return Gradient(
            *(np.asarray(function(*(getattr(g, f.name) for g in (self, *others)))) for f in fields(self))
        )

    def mode_shape(self, mode_shape: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Per kg^-1/2 of each amplitude V_b, shape (n, r), where G = V_b diag(w) V_bᵀ.

        Parameters
        ----------
        mode_shape
            V_b, kg^-1/2, shape (n, r).
        weights
            w, shape (r,).
        """
        return 2 * self.contact_matrix @ mode_shape * weights

    def weights(self, mode_shape: np.ndarray) -> np.ndarray:
        """Per unit weight of each node, shape (r,); `mode_shape` as in `Gradient.mode_shape`."""
        return np.einsum("ik,ij,jk->k", mode_shape, self.contact_matrix, mode_shape)


@dataclass(frozen=True)
class MultiplierSensitivity:
    """Derivatives of ln μ of one Floquet multiplier.

    Attributes
    ----------
    multiplier
        μ, polished by Newton's method from what was given.
    log_multiplier
        Derivatives of ln μ, complex: growth per revolution and, in the imaginary part, angle.
    condition
        By how much rounding errors are magnified: the derivatives carry a relative error of about
        1e-16 times this.
    simple
        False where the multiplier is double, or so nearly that its derivatives mean nothing; they
        are NaN then.
    """

    multiplier: complex
    log_multiplier: Gradient
    condition: float
    simple: bool

    @property
    def multiplier_gradient(self) -> Gradient:
        """Derivatives of μ itself."""
        return self.log_multiplier.mapped(lambda d: self.multiplier * d)

    @property
    def growth(self) -> Gradient:
        """Derivatives of ln|μ|, the growth per revolution."""
        return self.log_multiplier.mapped(np.real)

    @property
    def angle(self) -> Gradient:
        """Derivatives of arg μ, rad."""
        return self.log_multiplier.mapped(np.imag)


@dataclass(frozen=True)
class KeSensitivity:
    """Derivatives of the K_e at which one multiplier crosses the unit circle.

    Attributes
    ----------
    ke
        K_e there, N/m.
    multiplier
        On the unit circle.
    critical_ke
        Derivatives of that K_e, N/m per unit of the parameter; its own `ke` is NaN.
    angle
        Derivatives of arg μ along the boundary, rad per unit; its own `ke` is NaN.
    growth_per_log_ke
        ∂ln|μ|/∂ln K_e: above 0 where rising K_e destabilises. At 0 the boundary only touches, and
        has no derivative.
    condition
        As in `MultiplierSensitivity`, the touch included.
    simple
        False where the multiplier is double or the boundary touches: derivatives are NaN.
    """

    ke: float
    multiplier: complex
    critical_ke: Gradient
    angle: Gradient
    growth_per_log_ke: float
    condition: float
    simple: bool


def multiplier_sensitivity(problem: RubbingBlade, multiplier: complex) -> MultiplierSensitivity:
    """Derivatives of a Floquet multiplier, by implicit differentiation of the characteristic equation.

    With T = I − M(μ, p)/μ of `CharacteristicEquation`, T x = 0 and yᴴ T = 0,

        d ln μ/dp = (yᴴ ∂M/∂p x/μ) / (yᴴ x + K_e/μ² yᴴ ∂M/∂c x),   c = K_e(1/μ − 1).

    M is a product of exponentials E_s = exp(ℓ_s A_s) over the segments. With x_s and y_s the
    vectors carried to its two ends, y_sᴴ dE_s x_s = tr(dA_s N_s), where N_s is the Fréchet derivative of
    the exponential in direction x_s y_sᴴ, the upper right block of exp([[ℓA, ℓxyᴴ], [0, ℓA]]) (Van Loan
    1978; Higham, Functions of Matrices, 3.16 and 10.6). One N_s a segment serves all
    parameters, and a defective A_s is no exception.

    In permanent contact a negative μ is double: of the roots λ = (ln|μ| + iπ(2k + 1))/τ and λ̄ each has
    its own null vector of T, and as parameters change the pair passes through itself on the axis.
    ln|μ| has the same derivatives on both sides, but only beside it does T tell the two apart. No
    real μ lies outside the circle there: c < 0 only stiffens the blade.

    Parameters
    ----------
    problem
        A rubbing blade.
    multiplier
        One of its multipliers, e.g. `stability(problem).multiplier`, to three digits or better.

    Raises
    ------
    InvalidInput
        When there is no multiplier near, or the engagement is smooth: then no segments have constant γ.

    Examples
    --------
    >>> from sdm_core.rubbing_blade import single_state_problem
    >>> from sdm_core.stability import stability
    >>> problem = single_state_problem([100.0], [2e-3], [[5.0]], [1.0], 70.0, 900.0)
    >>> found = multiplier_sensitivity(problem, stability(problem).multiplier)
    >>> bool(found.growth.damping_ratio[0] < 0)
    True
    """
    if not problem.segments:
        raise InvalidInput(
            "contact.engagement", "smooth", "give arcs, or neither: derivatives need constant γ"
        )
    mu = _checked_multiplier(multiplier)
    pencil = _Pencil.at(problem, mu)
    for _ in range(_MOST_STEPS):
        if pencil.singular:
            break
        step = pencil.newton_step
        if not abs(step) <= _FARTHEST_START:
            raise InvalidInput(
                "multiplier", multiplier, "give one of the problem's, such as stability(problem).multiplier"
            )
        mu *= complex(np.exp(step))
        pencil = _Pencil.at(problem, mu)
        if abs(step) <= _LAST_STEP:
            break
    simple = bool(pencil.condition < _WORST_CONDITION)
    gradient = pencil.gradient() if simple else Gradient.unknown(problem)
    return MultiplierSensitivity(mu, gradient, pencil.condition, simple)


def critical_ke_sensitivity(problem: RubbingBlade, multiplier: complex) -> KeSensitivity:
    """Derivatives of the K_e of a crossing: along the boundary ln|μ| stays zero.

        dK_e/dp = −Re(∂ln μ/∂p)/Re(∂ln μ/∂K_e)
        d arg μ/dp = Im(∂ln μ/∂p) + Im(∂ln μ/∂K_e) dK_e/dp

    Parameters
    ----------
    problem
        A rubbing blade at its critical K_e.
    multiplier
        On the unit circle; e^{2πif/Ω} with f the `frequency_hz` of the `Crossings`.

    Raises
    ------
    InvalidInput
        When K_e is 0, or there is no multiplier near, or the one there is not on the circle.

    Examples
    --------
    >>> from sdm_core.permanent_contact.permanent_boundary import permanent_crossings
    >>> from sdm_core.rubbing_blade import single_state_problem
    >>> problem = single_state_problem([100.0], [2e-3], [[5.0]], [1.0], 70.0, 900.0)
    >>> crossing = permanent_crossings([problem], 1e5)[0]
    >>> mu = np.exp(2j * np.pi * crossing.frequency_hz[0] / 70.0)
    >>> found = critical_ke_sensitivity(problem.with_ke(crossing.ke[0]), mu)
    >>> bool(found.critical_ke.damping_ratio[0] > 0)
    True
    """
    number("ke", problem.ke, 0.0, KE_LIMIT, "N/m", open_low=True)
    found = multiplier_sensitivity(problem, multiplier)
    if abs(np.log(abs(found.multiplier))) > _ON_CIRCLE:
        raise InvalidInput(
            "ke", problem.ke, f"give a critical one: here |μ| = {abs(found.multiplier):.9g}, not 1"
        )
    log_mu = found.log_multiplier
    by_ke = complex(log_mu.ke)
    rate = problem.ke * by_ke.real
    # An error of ln|μ| is one of ln K_e this much larger.
    condition = found.condition / min(1.0, abs(rate)) if rate != 0 else np.inf
    simple = bool(found.simple and condition < _WORST_CONDITION)
    slope = by_ke.real if simple else np.nan
    critical = log_mu.mapped(lambda d: -np.real(d) / slope)
    angle = log_mu.mapped(lambda d, k: np.imag(d) + by_ke.imag * k, critical)
    nothing = np.array(np.nan)
    return KeSensitivity(
        problem.ke,
        found.multiplier,
        replace(critical, ke=nothing),
        replace(angle, ke=nothing),
        rate,
        condition,
        simple,
    )


def chatter_hz_gradient(angle: Gradient, multiplier: complex, chatter_hz: float, speed_hz: float) -> Gradient:
    """Derivatives of the chatter frequency |arg μ/2π + k| Ω at constant k, Hz per unit.

    Parameters
    ----------
    angle
        Derivatives of arg μ: at constant K_e or along the boundary.
    multiplier, chatter_hz, speed_hz
        μ, the frequency itself and Ω.
    """
    turns = float(np.angle(multiplier)) / (2 * np.pi)
    order = chatter_hz / speed_hz

    def off(x: float) -> float:
        return abs(x - round(x))

    # The sign of arg μ/2π + k: a frequency below k revolutions counts backwards.
    sign = 1.0 if off(order - turns) <= off(order + turns) else -1.0
    out = angle.mapped(lambda d: sign * speed_hz / (2 * np.pi) * d)
    return replace(out, speed_hz=out.speed_hz + order)


def _checked_multiplier(multiplier: complex) -> complex:
    remedy = "give a finite complex number other than 0"
    try:
        mu = complex(multiplier)
    except (TypeError, ValueError, OverflowError):
        raise InvalidInput("multiplier", multiplier, remedy) from None
    if not np.isfinite(mu) or mu == 0:
        raise InvalidInput("multiplier", multiplier, remedy)
    return mu


@dataclass(frozen=True)
class _Pencil:
    """T = I − M(μ)/μ with its null vectors and the Fréchet derivatives of its segments.

    Attributes
    ----------
    problem, mu, c
        c = K_e(1/μ − 1), N/m.
    contact
        C: the contact's share of the coefficients per revolution is c·C, shape (2n, 2n).
    free, engaged
        Σ ℓ_s N_s over all segments and over those in contact, divided by μ, shape (2n, 2n).
    edges
        y_sᴴ C x_s/μ at the start and end of every segment in contact, shape (arcs, 2).
    smallest, largest
        Smallest singular value of T, yᴴ T x, and largest entry of M/μ, but at least 1.
    slope
        ∂(yᴴ T x)/∂ln μ.
    condition
        Of ln μ against rounding errors in M/μ.
    """

    problem: RubbingBlade
    mu: complex
    c: complex
    contact: np.ndarray
    free: np.ndarray
    engaged: np.ndarray
    edges: np.ndarray
    smallest: float
    largest: float
    slope: complex
    condition: float

    @property
    def singular(self) -> bool:
        """True where T is singular to rounding."""
        return self.smallest <= 4 * _EPS * self.largest

    @property
    def newton_step(self) -> complex:
        """Step on ln μ towards the multiplier; infinite where the matrices overflow."""
        return -self.smallest / self.slope if self.slope != 0 else complex(np.inf)

    @classmethod
    def at(cls, problem: RubbingBlade, mu: complex) -> _Pencil:
        p, n = problem, len(problem.omega)
        # The state is (x, ẋ/ω) and time is in revolutions, as in `ArcPropagation`.
        turn = p.omega * p.tau
        rate, contact = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
        rate[:n, n:], rate[n:, :n] = np.diag(turn), -np.diag(turn)
        rate[n:, n:] = -2 * np.diag(p.damping_ratio * turn)
        contact[n:, :n] = p.contact_matrix * (p.tau / p.omega)[:, None]
        c = p.ke * (1 / mu - 1)
        touching = np.array([s.engaged for s in p.segments])
        length = np.array([s.length for s in p.segments])
        rates = length[:, None, None] * (rate + c * touching[:, None, None] * contact)
        with np.errstate(all="ignore"):  # near μ = 0, an essential singularity
            steps = expm(rates)
            before = [np.eye(2 * n, dtype=complex)]
            for step in steps:
                before.append(step @ before[-1])
            after = [np.eye(2 * n, dtype=complex)]
            for step in steps[::-1]:
                after.append(after[-1] @ step)
            scaled = before[-1] / mu
        after.reverse()
        if not (np.isfinite(scaled).all() and np.abs(scaled).max() < _LARGEST_GROWTH):
            raise InvalidInput("multiplier", mu, "give a larger one: M(μ)/μ there hides them in its rounding")
        left, singular, right = np.linalg.svd(np.eye(2 * n) - scaled)
        x, y = right[-1].conj(), left[:, -1].conj()  # y holds yᴴ
        free, engaged, edges = np.zeros_like(scaled), np.zeros_like(scaled), []
        for s, on in enumerate(touching):
            x_s, y_s = before[s] @ x, (y @ after[s + 1]) / mu
            block = np.zeros((4 * n, 4 * n), dtype=complex)
            block[: 2 * n, : 2 * n] = block[2 * n :, 2 * n :] = rates[s]
            block[: 2 * n, 2 * n :] = np.outer(x_s, y_s)
            frechet = length[s] * expm(block)[: 2 * n, 2 * n :]
            free += frechet
            if on:
                engaged += frechet
                edges.append(((y @ after[s]) @ contact @ x_s / mu, y_s @ contact @ before[s + 1] @ x))
        slope = complex(y @ scaled @ x + p.ke / mu * np.sum(contact * engaged.T))
        # A double multiplier has either no slope or, with two null vectors, two small singular values.
        least = min(abs(slope), float(singular[-2]))
        largest = float(max(1.0, np.abs(scaled).max()))
        condition = largest / least if least > 0 else np.inf
        table = np.array(edges, dtype=complex).reshape(-1, 2)
        smallest = float(singular[-1])
        return cls(p, mu, c, contact, free, engaged, table, smallest, largest, slope, condition)

    def gradient(self) -> Gradient:
        """d ln μ/dp = tr(∂A/∂p N)/slope, A of entries ωτ, −ωτ, −2ξωτ and c G τ/ω."""
        p, n = self.problem, len(self.problem.omega)
        turn, at = p.omega * p.tau, np.arange(n)
        by_entry = self.free.T / self.slope  # per unit of A_ij, at [i, j]
        by_damping = by_entry[n + at, n + at]
        by_turn = by_entry[at, n + at] - by_entry[n + at, at] - 2 * p.damping_ratio * by_damping
        by_contact = self.engaged.T[n:, :n] * (p.tau / p.omega)[:, None] / self.slope  # per unit of cG_ij
        spent = p.contact_matrix * by_contact
        by_tau = p.omega @ by_turn + self.c * spent.sum() / p.tau
        arcs = self.c * self.edges * np.array([-1.0, 1.0]) / self.slope
        return Gradient(
            p.tau * by_turn - self.c * spent.sum(axis=1) / p.omega,
            -2 * turn * by_damping,
            0.5 * self.c * (by_contact + by_contact.T),
            np.asarray(-(p.tau**2) * by_tau),
            np.asarray((1 / self.mu - 1) * spent.sum()),
            arcs if p.arcs is not None else arcs[:0],
        )

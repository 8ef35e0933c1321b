"""Growth and frequency of a motion, read off what it does from one revolution to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdm_core.errors import InvalidInput
from sdm_core.time_domain.motion import Motion

SAMPLES = 64  # a vibration of the fastest mode
_MOST_SAMPLES = 20_000
_FEWEST_REVOLUTIONS = 6
_FAINTEST = 1e-9  # of the strongest motion: fainter ones are the integration's error
_WINDOWS = 4
_AT_REST = 1e-290  # below, numbers have lost their digits


@dataclass(frozen=True)
class FittedGrowth:
    """The strongest growth in a motion.

    Attributes
    ----------
    multiplier
        μ of the fit, of the upper half-plane: the motion of one revolution is μ times that of the one before.
    growth_per_revolution, growth_uncertainty
        ln |μ|, and the largest difference from fits that leave out the last revolutions or the first ones,
        plus the tolerance of the integration.
    frequency_hz, frequency_uncertainty_hz
        Frequency of the largest component of the contact displacement, Hz, and the same of it.
    """

    multiplier: complex
    growth_per_revolution: float
    growth_uncertainty: float
    frequency_hz: float
    frequency_uncertainty_hz: float


def fitted_growth(motion: Motion) -> FittedGrowth:
    """Fit exponentials to the last half of a motion.

    The states of revolution k + 1, sampled all along, are taken as a linear map of those of revolution k, of
    as many dimensions as the motion shows (dynamic mode decomposition, Schmid 2010). Its eigenvalues are the
    multipliers of what takes part in the motion. No stability solver is asked.

    Raises
    ------
    InvalidInput
        When there are too few revolutions, or nothing moves.
    """
    if not isinstance(motion, Motion):
        raise InvalidInput("motion", type(motion).__name__, "give a Motion, as `integrated` returns it")
    count = len(motion.revolutions)
    if count < _FEWEST_REVOLUTIONS:
        remedy = f"integrate {_FEWEST_REVOLUTIONS} or more"
        raise InvalidInput("revolutions", count, remedy)
    used = max(_FEWEST_REVOLUTIONS, count // 2)
    snapshots, times = _snapshots(motion, used)
    if not np.abs(snapshots).max() > _AT_REST:
        raise InvalidInput("motion", "at rest", "give a displacement that the modes take part in")
    multiplier, shape = _strongest(snapshots)
    hz = _frequency(motion, multiplier, shape, times)
    # What is not yet a sum of few exponentials shows in fits to parts of it.
    cuts = [(0, -j) for j in range(1, _WINDOWS)] + [(j, None) for j in range(1, _WINDOWS)]
    others = [_strongest(snapshots[:, a:b])[0] for a, b in cuts if used - abs(b or a) >= 4]
    growth = np.array([np.log(abs(other)) for other in others])
    turn = np.array([np.angle(other / multiplier) for other in others]) / (2 * np.pi)
    mean = float(np.log(abs(multiplier)))
    return FittedGrowth(
        complex(multiplier),
        mean,
        float(np.abs(growth - mean).max()) + motion.rtol,
        hz,
        float(np.abs(turn).max() * motion.problem.speed_hz) + motion.rtol * hz,
    )


def _snapshots(motion: Motion, used: int) -> tuple[np.ndarray, np.ndarray]:
    """The last revolutions as columns, shape (2n·samples, used), and the times in them, (samples,)."""
    problem = motion.problem
    fastest = problem.omega.max() / (2 * np.pi) * problem.tau
    samples = int(np.clip(SAMPLES * fastest, 256, _MOST_SAMPLES))
    times = np.arange(samples) / samples * problem.tau
    weight = np.concatenate([problem.omega, np.ones(len(problem.omega))])
    columns = [(revolution.at(times) * weight).ravel() for revolution in motion.revolutions[-used:]]
    return np.array(columns).T, times


def _strongest(snapshots: np.ndarray) -> tuple[complex, np.ndarray]:
    """The eigenvalue, and its shape over a revolution, that the last of the snapshots holds most of."""
    # Each revolution to the same size: of a motion that decays the first ones would count alone.
    size = np.linalg.norm(snapshots, axis=0)
    scaled = snapshots / np.where(size > 0, size, 1.0)
    before, after = scaled[:, :-1], snapshots[:, 1:] / np.where(size[:-1] > 0, size[:-1], 1.0)
    u, s, vh = np.linalg.svd(before, full_matrices=False)
    kept = s > _FAINTEST * s[0]
    u, s, vh = u[:, kept], s[kept], vh[kept]
    values, vectors = np.linalg.eig((u.T @ after) @ vh.T / s)
    share, *_ = np.linalg.lstsq(vectors, u.T @ scaled[:, -1].astype(complex), rcond=None)
    present = np.abs(share) > 1e-6 * np.abs(share).max()
    place = int(np.argmax(np.where(present, np.abs(values), 0.0)))
    value = values[place]
    shape = u @ vectors[:, place]
    return (value, shape) if value.imag >= 0 else (value.conjugate(), shape.conjugate())


def _frequency(motion: Motion, multiplier: complex, shape: np.ndarray, times: np.ndarray) -> float:
    """|arg μ/2π + k| Ω, k the largest Fourier component of the contact displacement over a revolution."""
    problem, n = motion.problem, len(motion.problem.omega)
    modal = shape.reshape(len(times), 2 * n)[:, :n] / problem.omega
    return chatter_frequency(multiplier, modal @ problem.contact_shape.T, problem.speed_hz)


def chatter_frequency(multiplier: complex, displacement: np.ndarray, speed_hz: float) -> float:
    """Hz, from the contact displacement at equal times over one revolution, complex, shape (m, r)."""
    many = len(displacement)
    # μ^(t/τ) taken out, the rest is periodic: its components lie at whole multiples of the rotor speed.
    exponent = np.log(abs(multiplier)) + 1j * np.angle(multiplier)
    periodic = displacement * np.exp(-exponent * np.arange(many) / many)[:, None]
    size = (np.abs(np.fft.fft(periodic, axis=0)) ** 2).sum(axis=1)
    k = float(np.fft.fftfreq(many, 1 / many)[int(np.argmax(size))])
    return float(abs(np.angle(multiplier) / (2 * np.pi) + k) * speed_hz)

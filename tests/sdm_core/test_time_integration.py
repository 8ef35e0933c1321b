"""Crossing type and chatter frequency against direct integration in time, which knows no multiplier."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from sdm_core.delay_equation import delayed_mathieu
from sdm_core.rubbing_blade import RubbingBlade, single_state_problem
from sdm_core.stability import stability

STAGES = 4
REVOLUTIONS = 32  # whose spectrum is taken
Coefficient = Callable[[float], np.ndarray]


def gauss(stages: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes, weights and matrix of the implicit Runge-Kutta method of order 2·stages (Butcher 1964)."""
    x, w = np.polynomial.legendre.leggauss(stages)
    c, b = (x + 1) / 2, w / 2
    powers = np.arange(1, stages + 1)
    return c, b, (c[:, None] ** powers / powers) @ np.linalg.inv(c[:, None] ** (powers - 1))


class MethodOfSteps:
    """ż = A(t)z + B(t)z(t − 1), integrated revolution by revolution; time in revolutions.

    Steps end where the coefficients jump and repeat each revolution, so that the delayed values at
    the stages of a step are the stage values of the same step a revolution before: nothing is
    interpolated. Each step is one implicit Runge-Kutta step with Gauss's nodes. Many histories are
    integrated side by side.

    Parameters
    ----------
    a, b
        Coefficients at a time, shape (d, d).
    jumps
        Times in [0, 1) where they jump.
    longest
        Step, revolutions.
    displacement
        Of the contact nodes, shape (signals, d/2), of z = (x, ẋ).
    """

    def __init__(
        self, a: Coefficient, b: Coefficient, jumps: list[float], longest: float, displacement: np.ndarray
    ) -> None:
        c, weight, table = gauss(STAGES)
        ends = np.unique([0.0, *jumps, 1.0])
        grid = [np.linspace(s, e, 1 + int(np.ceil((e - s) / longest))) for s, e in pairwise(ends)]
        self.t = np.unique(np.concatenate(grid))
        self.d = 2 * displacement.shape[1]
        self.felt = displacement
        self.stage_times = self.t[:-1, None] + np.diff(self.t)[:, None] * c
        one = np.eye(self.d * STAGES)
        steps = []
        for times, h in zip(self.stage_times, np.diff(self.t), strict=True):
            now, past = np.array([a(t) for t in times]), np.array([b(t) for t in times])
            spread = h * np.einsum("ij,jkl->ikjl", table, now).reshape(one.shape)
            delayed = h * np.einsum("ij,jkl->ikjl", table, past).reshape(one.shape)
            ahead = np.tile(np.eye(self.d), (STAGES, 1))
            stages = np.linalg.solve(one - spread, np.hstack([ahead, delayed]))
            last = h * np.einsum("j,jkl->kjl", weight, now).reshape(self.d, -1) @ stages
            last[:, : self.d] += np.eye(self.d)
            last[:, self.d :] += h * np.einsum("j,jkl->kjl", weight, past).reshape(self.d, -1)
            steps.append(np.vstack([last, stages]))
        self.steps = np.array(steps)

    def random_histories(self, number: int, rng: np.random.Generator) -> np.ndarray:
        """Smooth motions over the revolution before, shape (values, number)."""
        k = np.arange(12)
        cosine, sine = rng.normal(size=(2, 12, self.d, number)) / (1 + k[:, None, None])

        def motion(t: np.ndarray) -> np.ndarray:
            turn = 2 * np.pi * np.asarray(t)[..., None] * k
            return np.tensordot(np.cos(turn), cosine, 1) + np.tensordot(np.sin(turn), sine, 1)

        return np.concatenate([motion(1.0).ravel(), motion(self.stage_times).ravel()]).reshape(-1, number)

    def revolution(self, history: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The next revolution of every history, and the states at the steps, shape (steps + 1, d, m)."""
        m = history.shape[1]
        z, delayed = history[: self.d], history[self.d :].reshape(len(self.steps), -1, m)
        out, states = np.empty_like(delayed), [z]
        for i, step in enumerate(self.steps):
            both = step @ np.concatenate([z, delayed[i]])
            z, out[i] = both[: self.d], both[self.d :]
            states.append(z)
        return np.concatenate([z, out.reshape(-1, m)]), np.array(states)

    def dominant(self, rng: np.random.Generator) -> tuple[complex, np.ndarray]:
        """Factor by which the slowest decaying motion is multiplied a revolution, and that motion.

        Random histories are integrated until one of their combinations repeats itself up to a
        factor to 1e-9. The equation is linear: re-expressing them by orthogonal ones between
        revolutions is a change of basis.
        """
        histories = np.linalg.qr(self.random_histories(self.d + 4, rng))[0]
        for turn in range(1, 400):
            after, _ = self.revolution(histories)
            if turn % 10 == 0:
                factors, mix = np.linalg.eig(histories.T @ after)
                i = int(np.argmax(np.abs(factors)))
                off = after @ mix[:, i] - factors[i] * (histories @ mix[:, i])
                if np.linalg.norm(off) < 1e-9 * abs(factors[i]):
                    return complex(factors[i]), histories @ mix[:, i]
            histories = np.linalg.qr(after)[0]
        raise AssertionError("no motion has come to dominate")

    def spectral_peak(self, factor: complex, motion: np.ndarray) -> float:
        """Largest component of the displacement by FFT over REVOLUTIONS, cycles a revolution.

        The motion is integrated on; what it grows by is taken out, and the line of a Hann window
        is placed between the bins by a parabola through its logarithm.
        """
        samples = 1 << int(np.ceil(np.log2(2 * len(self.steps))))
        t = np.arange(samples) / samples
        history, record = np.real(motion)[:, None], []
        for _ in range(REVOLUTIONS):
            history, states = self.revolution(history)
            x, rate = np.split(states[:, :, 0], 2, axis=1)
            curve = CubicHermiteSpline(self.t, x @ self.felt.T, rate @ self.felt.T)
            record.append(curve(t) * abs(factor) ** -t[:, None])
            history = history / abs(factor)
        window = np.hanning(REVOLUTIONS * samples)[:, None]
        power = (np.abs(np.fft.rfft(window * np.concatenate(record), axis=0)) ** 2).sum(axis=1)
        k = int(np.argmax(power[1:-1])) + 1
        low, here, high = np.log(power[k - 1 : k + 2])
        return (k + 0.5 * (low - high) / (low - 2 * here + high)) / REVOLUTIONS


@dataclass(frozen=True)
class BladeCase:
    """Frequencies in Hz, damping, mode shape (n, r), speed in Hz, K_e in N/m and arcs."""

    frequency: list[float]
    damping: list[float]
    shape: list[list[float]]
    speed: float
    ke: float
    arcs: list[list[float]] | None = None

    @property
    def problem(self) -> RubbingBlade:
        nodes = np.ones(len(self.shape[0]))
        return single_state_problem(
            self.frequency, self.damping, np.array(self.shape), nodes, self.speed, self.ke, self.arcs
        )

    @property
    def motion(self) -> MethodOfSteps:
        """[SBL] Eq. 19 with γ, written out once more."""
        omega = 2 * np.pi * np.array(self.frequency) / self.speed  # rad a revolution
        shape, n = np.array(self.shape), len(self.frequency)
        stiffness = self.ke / self.speed**2 * shape @ shape.T

        def engaged(t: float) -> bool:
            return self.arcs is None or any(start <= t < end for start, end in self.arcs)

        def now(t: float) -> np.ndarray:
            lower = [
                -np.diag(omega**2) - engaged(t) * stiffness,
                -2 * np.diag(np.array(self.damping) * omega),
            ]
            return np.block([[np.zeros((n, n)), np.eye(n)], lower])

        def past(t: float) -> np.ndarray:
            zero = np.zeros((n, n))
            return np.block([[zero, zero], [engaged(t) * stiffness, zero]])

        fastest = np.sqrt(omega.max() ** 2 + 2 * np.trace(stiffness))
        jumps = [edge for arc in self.arcs or [] for edge in arc]
        return MethodOfSteps(now, past, jumps, 0.35 / fastest, shape.T)


@dataclass(frozen=True)
class MathieuCase:
    """ẍ + damping ẋ + (δ + ε cos t)x = b x(t − 2π)."""

    delta: float
    epsilon: float
    b: float
    damping: float

    @property
    def motion(self) -> MethodOfSteps:
        turn = 2 * np.pi

        def now(t: float) -> np.ndarray:
            stiffness = self.delta + self.epsilon * np.cos(turn * t)
            return np.array([[0.0, 1.0], [-(turn**2) * stiffness, -turn * self.damping]])

        def past(_: float) -> np.ndarray:
            return np.array([[0.0, 0.0], [turn**2 * self.b, 0.0]])

        return MethodOfSteps(now, past, [], 0.02, np.ones((1, 1)))


PAIRS = [
    BladeCase(
        [100.0, 301.5, 843.1], [0.0034, 0.004, 0.015], [[0.2, 5.4], [-2.0, -2.5], [2.0, 1.4]], 35.3, 105.1
    ),
    BladeCase([100.0, 230.8, 553.1], [0.02, 0.012, 0.0084], [[-5.2], [-7.4], [-0.9]], 56.8, 650.3),
    BladeCase([100.0], [0.0022], [[-0.7]], 48.0, 173700.0),  # 0.3 degrees from −1, and no flip
    BladeCase(
        [100.0, 253.3, 588.9], [0.0063, 0.0035, 0.0021], [[-3.9, -3.2], [4.2, -3.2], [-0.1, 3.5]], 29.3, 674.0
    ),
    BladeCase([100.0, 298.5], [0.0065, 0.014], [[0.3], [5.4]], 25.5, 3597.0),
    BladeCase([100.0], [0.0064], [[-2.6, 8.0]], 55.9, 77.31),
    BladeCase([100.0], [0.0049], [[2.3]], 29.0, 2273.0),
    BladeCase([100.0, 208.3], [0.019, 0.0078], [[-2.7, 0.8], [-1.9, 0.5]], 46.4, 10590.0),
    BladeCase([100.0, 212.4], [0.0025, 0.019], [[-5.3], [-3.2]], 38.0, 86.87),
    BladeCase([100.0, 259.2], [0.0027, 0.014], [[2.8, -1.3], [-1.5, -1.0]], 31.5, 4747.0),
    BladeCase(
        [100.0, 239.4, 413.0], [0.015, 0.0087, 0.0074], [[0.0, -1.8], [4.7, 2.6], [-0.1, 2.7]], 52.9, 1934.0
    ),
    BladeCase([100.0, 275.2], [0.0021, 0.0047], [[1.4], [-6.8]], 78.0, 1215.0),
]
PAIRS_WITH_ARCS = [
    BladeCase([100.0], [0.0053], [[0.7, 9.0]], 40.7, 465.9, [[0.24, 0.61]]),
    BladeCase(
        [100.0, 188.9, 588.1],
        [0.0056, 0.019, 0.0065],
        [[-1.1], [-0.6], [-3.9]],
        54.8,
        17470.0,
        [[0.17, 0.62]],
    ),
    BladeCase(
        [100.0, 152.4, 331.2],
        [0.0066, 0.018, 0.0036],
        [[-2.8, -1.3], [-2.2, 0.0], [-1.5, -1.2]],
        32.2,
        23070.0,
        [[0.02, 0.21], [0.25, 0.31]],
    ),
    BladeCase(
        [100.0, 160.2, 398.5],
        [0.006, 0.0078, 0.0091],
        [[-2.5, -7.0], [2.9, -0.1], [0.3, -3.0]],
        23.7,
        1234.0,
        [[0.16, 0.57], [0.61, 0.67]],
    ),
    BladeCase([100.0], [0.0095], [[-0.6]], 38.6, 66030.0, [[0.38, 0.7], [0.74, 0.8]]),
    BladeCase([100.0, 249.9], [0.0031, 0.0075], [[2.0, 3.5], [7.5, 5.9]], 23.0, 3320.0, [[0.14, 0.37]]),
    BladeCase([100.0], [0.013], [[-6.6, -8.4]], 67.8, 472.7, [[0.05, 0.46], [0.5, 0.56]]),
    BladeCase([100.0, 243.3], [0.0087, 0.0081], [[-6.6], [2.0]], 57.9, 613.5, [[0.33, 0.75]]),
]
FLIPS = [
    BladeCase([100.0], [0.00875], [[2.97, -4.27]], 201.21, 2460.6, [[0.2, 0.47]]),
    BladeCase([100.0], [0.02563], [[1.78]], 71.35, 51611.0, [[0.01, 0.13]]),
    BladeCase(
        [100.0, 425.5], [0.00383, 0.00256], [[-5.51], [-0.27]], 29.51, 1006.0, [[0.35, 0.7], [0.75, 0.85]]
    ),
    BladeCase(
        [100.0, 262.3], [0.00231, 0.00344], [[4.99], [-4.19]], 203.35, 2543.2, [[0.38, 0.54], [0.59, 0.69]]
    ),
    BladeCase(
        [100.0, 399.0], [0.00703, 0.01203], [[15.73, -5.57], [-2.56, 6.11]], 43.33, 522.3, [[0.07, 0.31]]
    ),
]
FOLDS = [
    MathieuCase(2.12, 2.26, 0.43, 0.26),
    MathieuCase(1.22, 1.13, 0.1, 0.26),
    MathieuCase(1.85, 2.91, -0.04, 0.32),
    MathieuCase(1.79, 1.6, 0.24, 0.12),
    MathieuCase(1.57, 1.59, 0.23, 0.34),
]


def kind_of(factor: complex) -> str:
    """Of the factor by which a motion is multiplied a revolution."""
    if abs(factor.imag) > 1e-7 * abs(factor):
        return "hopf"
    return "fold" if factor.real > 0 else "flip"


def frequency_of(factor: complex, peak: float) -> float:
    """Cycles a revolution: |±arg μ/2π + k| nearest to the peak of the spectrum."""
    turns = np.array([1.0, -1.0]) * np.angle(factor) / (2 * np.pi)
    lines = np.round(peak - turns) + turns
    return float(lines[np.argmin(np.abs(lines - peak))])


@pytest.mark.parametrize(
    ("case", "kind"),
    [
        *(pytest.param(case, "hopf", id=f"pair {i}") for i, case in enumerate(PAIRS)),
        *(pytest.param(case, "hopf", id=f"pair, arcs {i}") for i, case in enumerate(PAIRS_WITH_ARCS)),
        *(pytest.param(case, "flip", id=f"flip {i}") for i, case in enumerate(FLIPS)),
    ],
)
def test_a_blade_integrated_in_time_chatters_as_its_multiplier_says(case, kind):
    motion, solution = case.motion, stability(case.problem)
    factor, shape = motion.dominant(np.random.default_rng(0))
    assert kind_of(factor) == solution.crossing == kind
    assert abs(complex(factor.real, abs(factor.imag)) - solution.multiplier) < 1e-8 * abs(factor)
    assert solution.stable == (abs(factor) < 1)
    peak = motion.spectral_peak(factor, shape)
    assert abs(peak - solution.chatter_hz / case.speed) < 0.2 / REVOLUTIONS
    assert frequency_of(factor, peak) * case.speed == pytest.approx(solution.chatter_hz, rel=1e-8)


@pytest.mark.parametrize("case", FOLDS, ids=range(len(FOLDS)))
def test_a_delayed_mathieu_oscillator_integrated_in_time_repeats_itself_at_a_fold(case):
    motion = case.motion
    solution = stability(delayed_mathieu(case.delta, case.epsilon, case.b, case.damping))
    factor, shape = motion.dominant(np.random.default_rng(0))
    assert kind_of(factor) == solution.crossing == "fold"
    assert abs(factor - solution.multiplier) < max(solution.error_estimate, 1e-6) * abs(factor)
    assert solution.stable == (abs(factor) < 1)
    # Every revolution is like the one before but for the growth: a whole number of cycles.
    assert motion.spectral_peak(factor, shape) == pytest.approx(1.0, abs=1e-3)


def test_the_integration_reproduces_free_vibration_in_closed_form():
    omega, xi, speed = 2 * np.pi * 100.0, 0.02, 37.0
    motion = BladeCase([100.0], [xi], [[1.0]], speed, 0.0).motion
    factor, _ = motion.dominant(np.random.default_rng(0))
    exact = np.exp((-xi + 1j * np.sqrt(1 - xi**2)) * omega / speed)
    assert min(abs(factor - exact), abs(factor - exact.conjugate())) < 1e-9

"""The design space the surrogate is trained on: named, bounded, sampled space-filling."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from sdm_core.errors import InvalidInput
from training.cases import MODES, CaseBatch

Range = tuple[float, float]


@dataclass(frozen=True)
class DesignSpace:
    """Bounds of the training domain; a little wider than the reference space (DESIGN, section 7).

    Amplitudes and correlations at the contact are not bounded: modes from dominant to invisible
    and every correlation are sampled.

    Attributes
    ----------
    mode_count
        n.
    first_ratio, next_ratio
        f2/f1, and f_{j+1}/f_j above.
    damping_ratio
        ξ of every mode.
    damping_spread
        Largest ratio of a mode's ξ to their geometric mean, or the inverse.
    speed_ratio
        Ω/f1, f1 at that speed.
    """

    name: str = "permanent-contact/1"
    mode_count: tuple[int, int] = (1, MODES)
    first_ratio: Range = (1.4, 5.2)
    next_ratio: Range = (1.02, 2.5)
    damping_ratio: Range = (1.2e-4, 1.7e-2)
    damping_spread: float = 2.0
    speed_ratio: Range = (0.045, 0.85)

    def contains(self, cases: CaseBatch) -> np.ndarray:
        """Which cases lie inside, shape (m,)."""
        return self.first_violation(cases) == ""

    def first_violation(self, cases: CaseBatch) -> np.ndarray:
        """Why a case lies outside, in words; an empty string where it is inside. Shape (m,)."""
        out = np.full(len(cases), "", dtype=object)
        n = np.minimum(cases.mode_count, MODES)
        pair = np.arange(MODES - 1) < (n - 1)[:, None]
        own = np.arange(MODES) < n[:, None]
        ratio = cases.omega[:, 1:] / cases.omega[:, :-1]
        speed_ratio = 2 * np.pi * cases.speed_hz / cases.omega[:, 0]
        mean = np.exp((np.log(np.maximum(cases.damping_ratio, 1e-300)) * own).sum(axis=1) / own.sum(axis=1))
        spread = np.abs(np.log(np.maximum(cases.damping_ratio, 1e-300) / mean[:, None]))
        reached = np.einsum("mjj->mj", cases.contact_matrix).max(axis=1) > 0

        def mark(bad: np.ndarray, text: str) -> None:
            out[bad & (out == "")] = text

        mark(cases.mode_count > self.mode_count[1], f"more than {self.mode_count[1]} modes")
        mark(~reached, "no mode moves the contact nodes")
        mark(_outside(speed_ratio, self.speed_ratio), f"speed/f1 outside {_text(self.speed_ratio)}")
        first = pair[:, 0] & _outside(ratio[:, 0], self.first_ratio)
        mark(first, f"f2/f1 outside {_text(self.first_ratio)}")
        later = (pair[:, 1:] & _outside(ratio[:, 1:], self.next_ratio)).any(axis=1)
        mark(later, f"f(j+1)/f(j) outside {_text(self.next_ratio)}")
        damping = (own & _outside(cases.damping_ratio, self.damping_ratio)).any(axis=1)
        mark(damping, f"damping_ratio outside {_text(self.damping_ratio)}")
        uneven = (own & (spread > np.log(self.damping_spread))).any(axis=1)
        mark(uneven, f"damping of the modes differs by more than a factor {self.damping_spread:g}")
        return out

    def sample(self, designs: int, speeds_each: int, seed: int) -> CaseBatch:
        """Space-filling sample: `designs` blades (scrambled Sobol points), each at several speeds.

        Half the mode shapes are quadratics along the chord at 1 to 12 nodes, as real blades
        have them, half are of any rank, so that every correlation G_jk/√(G_jj G_kk) occurs.

        Raises
        ------
        InvalidInput
            For no designs or no speeds.
        """
        if designs < 1 or speeds_each < 1:
            raise InvalidInput("designs", designs, "give at least one design and one speed")
        sobol = qmc.Sobol(_Columns.total + speeds_each, rng=np.random.default_rng(seed))
        points = sobol.random(1 << int(np.ceil(np.log2(designs))))[:designs]
        points = np.clip(points, 1e-9, 1 - 1e-9)
        rng = np.random.default_rng(seed + 1)
        return CaseBatch.concatenate([self._design(u, speeds_each, rng) for u in points])

    def _design(self, u: np.ndarray, speeds_each: int, rng: np.random.Generator) -> CaseBatch:
        n = 1 + int(u[_Columns.modes] * MODES)
        ratios = np.ones(n)
        if n > 1:
            ratios[1] = _between(u[_Columns.ratio], self.first_ratio)
            for j in range(2, n):
                ratios[j] = _between(u[_Columns.ratio + j - 1], self.next_ratio)
        omega = 2 * np.pi * np.cumprod(ratios)
        mean = np.exp(_between(u[_Columns.damping], tuple(np.log(self.damping_ratio))))
        spread = _between(u[_Columns.spread : _Columns.spread + n], (-0.5, 0.5))
        damping = np.clip(mean * np.exp(spread), *self.damping_ratio)
        size = np.exp(_between(u[_Columns.size : _Columns.size + n], (np.log(0.7), np.log(43.0))))
        # A node near a nodal line of a mode hardly feels it.
        size *= np.where(rng.random(n) < 0.15, 10.0 ** rng.uniform(-3.0, 0.0, n), 1.0)
        normal = ndtri(u[_Columns.shape : _Columns.shape + 3 * n]).reshape(n, 3)
        if u[_Columns.family] < 0.5:
            r = int(rng.choice([1, 1, 2, 3, 5, 9, 12]))
            chord = np.linspace(-1, 1, r) if r > 1 else np.zeros(1)
            shape = normal @ np.stack([chord**0, chord, chord**2]) * (1 + 0.1 * rng.normal(size=(n, r)))
            shape = shape * np.sqrt(rng.uniform(0.3, 1.0, r))
        else:
            rank = 1 + int(rng.integers(0, 5))
            shape = np.concatenate([normal, rng.normal(size=(n, 3))], axis=1)[:, :rank]
        shape = shape * (size / np.abs(shape).max(axis=1))[:, None]
        low, high = np.log(self.speed_ratio)
        speed = np.exp(low + (high - low) * u[_Columns.total : _Columns.total + speeds_each])
        m = speeds_each
        return CaseBatch.from_arrays(np.tile(omega, (m, 1)), damping, np.tile(shape.T, (m, 1, 1)), speed)

    def to_dict(self) -> dict[str, Any]:
        """For the model card."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> DesignSpace:
        """From the model card."""
        values: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in data.items()}
        return cls(**values)


class _Columns:
    """Which coordinate of a Sobol point means what."""

    modes, family, damping, ratio = 0, 1, 2, 3
    spread = ratio + MODES - 1
    size = spread + MODES
    shape = size + MODES
    total = shape + 3 * MODES


def _between(u: Any, limits: Any) -> Any:
    return limits[0] + (limits[1] - limits[0]) * u


def _outside(values: np.ndarray, limits: Range) -> np.ndarray:
    return (values < limits[0] * (1 - 1e-9)) | (values > limits[1] * (1 + 1e-9))


def _text(limits: Range) -> str:
    return f"{limits[0]:g} to {limits[1]:g}"

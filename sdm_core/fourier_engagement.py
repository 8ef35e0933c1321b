"""Engagement that varies smoothly round the casing: a Fourier series, as an out-of-round casing makes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdm_core.delay_equation import Fourier
from sdm_core.errors import InvalidInput
from sdm_core.validation import number

MOST_HARMONICS = 64
_TOLERANCE = 1e-6  # by which γ may leave [0, 1]: coefficients come rounded
_FIELD = "contact.engagement"


@dataclass(frozen=True)
class FourierEngagement:
    """γ(θ) = mean + Σ_k [cosine_k cos(2πkθ) + sine_k sin(2πkθ)], k from 1; θ in revolutions.

    γ is the share of K_e that cuts at θ. It stays within [0, 1]: below 0 the liner would pull, and K_e is
    the largest cutting stiffness round the casing.

    Parameters
    ----------
    mean
        Mean over a revolution, above 0 and up to 1.
    cosine, sine
        Coefficients from one cycle a revolution up, at most 64; equally many, or none where all
        are zero.

    Raises
    ------
    InvalidInput
        For unusable coefficients, or where γ leaves [0, 1], naming field, value and remedy.

    Examples
    --------
    >>> gamma = FourierEngagement(0.5, [0.4])
    >>> gamma.at(np.array([0.0, 0.5])).round(12).tolist()
    [0.9, 0.1]
    """

    mean: float
    cosine: tuple[float, ...] = ()
    sine: tuple[float, ...] = ()

    def __init__(self, mean: float, cosine: Sequence[float] = (), sine: Sequence[float] = ()) -> None:
        average = number(f"{_FIELD}.mean", mean, 0.0, 1.0, "", open_low=True)
        parts = {name: _coefficients(name, given) for name, given in (("cosine", cosine), ("sine", sine))}
        for name, other in (("cosine", "sine"), ("sine", "cosine")):
            if not parts[name]:
                parts[name] = (0.0,) * len(parts[other])
        if len(parts["sine"]) != len(parts["cosine"]):
            raise InvalidInput(
                f"{_FIELD}.sine",
                f"{len(parts['sine'])} numbers",
                f"give {len(parts['cosine'])}, as many as cosine",
            )
        object.__setattr__(self, "mean", average)
        object.__setattr__(self, "cosine", parts["cosine"])
        object.__setattr__(self, "sine", parts["sine"])
        self._check_range()

    def at(self, theta: np.ndarray) -> np.ndarray:
        """γ at θ, revolutions; shape as `theta`."""
        return self.modulation(1.0).at(theta)

    def modulation(self, period: float) -> Fourier:
        """γ as a function of time with one revolution in `period` s."""
        return Fourier(self.mean, self.cosine, self.sine, period)

    def shifted(self, by: float) -> FourierEngagement:
        """γ(θ − by): the same pattern turned forward by so many revolutions."""
        k = np.arange(1, len(self.cosine) + 1)
        turned = (np.array(self.cosine) + 1j * np.array(self.sine)) * np.exp(2j * np.pi * k * by)
        return FourierEngagement(self.mean, turned.real.tolist(), turned.imag.tolist())

    @property
    def harmonics(self) -> int:
        """Largest k whose coefficients are not zero."""
        used = np.flatnonzero(np.abs(self.cosine) + np.abs(self.sine))
        return int(used[-1]) + 1 if len(used) else 0

    @property
    def is_one(self) -> bool:
        """True where γ = 1 all round: permanent contact."""
        return self.mean == 1.0 and self.harmonics == 0

    @property
    def extremes(self) -> tuple[float, float]:
        """Smallest and largest γ round the casing."""
        k = np.arange(1, self.harmonics + 1)
        if len(k) == 0:
            return self.mean, self.mean
        # Samples miss an extreme by 1e-3 of the amplitude, a Newton step on γ' = 0 from the best ones
        # by 1e-8 of it, the next by rounding.
        theta = np.arange(64 * len(k)) / (64 * len(k))
        complex_coefficients = np.array(self.cosine[: len(k)]) - 1j * np.array(self.sine[: len(k)])
        rate = 2j * np.pi * k
        for _ in range(2):
            waves = np.exp(theta[:, None] * rate)
            slope = (waves @ (rate * complex_coefficients)).real
            bend = (waves @ (rate**2 * complex_coefficients)).real
            with np.errstate(all="ignore"):
                step = np.nan_to_num(slope / bend)
            theta = np.concatenate([theta, theta - np.clip(step, -1 / (64 * len(k)), 1 / (64 * len(k)))])
            gamma = self.at(theta)
            theta = theta[np.argsort(gamma)[np.r_[: 4 * len(k), -4 * len(k) : 0]]]
        gamma = self.at(theta)
        return float(gamma.min()), float(gamma.max())

    def to_dict(self) -> dict[str, Any]:
        """As the wire contract writes it."""
        return {"mean": self.mean, "cosine": list(self.cosine), "sine": list(self.sine)}

    @classmethod
    def from_dict(cls, data: Any) -> FourierEngagement:
        """From the wire contract's form; unknown keys are refused."""
        if not isinstance(data, Mapping):
            raise InvalidInput(_FIELD, data, 'give an object such as {"mean": 0.5, "cosine": [0.4]}')
        for key in data:
            if key not in ("mean", "cosine", "sine"):
                raise InvalidInput(f"{_FIELD}.{key}", data[key], "leave it out: mean, cosine and sine only")
        if "mean" not in data:
            raise InvalidInput(f"{_FIELD}.mean", "missing", "give the mean of γ over a revolution")
        return cls(data["mean"], data.get("cosine", ()), data.get("sine", ()))

    def _check_range(self) -> None:
        low, high = self.extremes
        if low < -_TOLERANCE:
            raise InvalidInput(
                _FIELD, f"γ down to {low:.9g}", "raise the mean or shrink the coefficients until γ ≥ 0"
            )
        if high > 1 + _TOLERANCE:
            raise InvalidInput(
                _FIELD,
                f"γ up to {high:.9g}",
                f"divide mean, cosine and sine by {high:.9g} and multiply ke by it: γ ≤ 1",
            )


def _coefficients(name: str, values: Any) -> tuple[float, ...]:
    field = f"{_FIELD}.{name}"
    if isinstance(values, str | bytes | Mapping) or not hasattr(values, "__len__"):
        raise InvalidInput(field, values, "give a list of numbers, from one cycle a revolution up")
    if len(values) > MOST_HARMONICS:
        raise InvalidInput(field, f"{len(values)} numbers", f"give at most {MOST_HARMONICS}")
    # Of γ within [0, 1] none is above 2/π, a square wave's.
    return tuple(number(f"{field}[{i}]", value, -1.0, 1.0, "") for i, value in enumerate(values))

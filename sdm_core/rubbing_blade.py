"""The problem of this project: one blade, one contact, one rotor speed, one cutting stiffness."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import Arc, ContactConfiguration, Segment
from sdm_core.delay_equation import DelayEquation, Engagement, Modulation
from sdm_core.errors import InvalidInput
from sdm_core.fourier_engagement import FourierEngagement
from sdm_core.validation import (
    AMPLITUDE_LIMIT,
    FREQUENCY_LIMITS_HZ,
    KE_LIMIT,
    LARGEST_DAMPING,
    SPEED_LIMITS_HZ,
    WEIGHT_LIMIT,
    matrix,
    number,
    vector,
)

LEAST_DAMPING = 1e-8
"""An undamped mode is taken with this ξ: the limit of vanishing damping, in which every proof holds."""


@dataclass(frozen=True)
class RubbingBlade:
    """ẍ + 2ξΛẋ + Λ²x = K_e γ(Ωt) G [x(t − τ) − x(t)], τ = 1/Ω ([SBL] Eq. 19 with γ added).

    Attributes
    ----------
    omega
        Λ, natural angular frequencies, rad/s, shape (n,).
    damping_ratio
        ξ, shape (n,); of a blade at least `LEAST_DAMPING`.
    contact_shape
        W^½ V_bᵀ, kg^-1/2, shape (r, n); G = contact_shapeᵀ contact_shape.
    speed_hz
        Ω, Hz.
    ke
        K_e, N/m.
    arcs
        Arcs of engagement, or None for permanent contact and smooth γ.
    segments
        One revolution as stretches of constant γ; none where γ is smooth.
    engagement
        Smooth γ, or None.
    """

    omega: np.ndarray
    damping_ratio: np.ndarray
    contact_shape: np.ndarray
    speed_hz: float
    ke: float
    arcs: tuple[tuple[float, float], ...] | None
    segments: tuple[Segment, ...]
    engagement: FourierEngagement | None = None

    @classmethod
    def from_blade(
        cls,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: float,
        ke: float,
        *,
        extrapolate: bool = False,
    ) -> RubbingBlade:
        """The problem at one rotor speed and cutting stiffness.

        Raises
        ------
        InvalidInput
            For a node the blade has not got, a speed or stiffness out of range.
        OutOfSpeedRange
            When the modal data do not reach `speed_hz`.
        """
        return cls.at_speeds(blade, contact, np.array([speed_hz]), extrapolate=extrapolate)[0].with_ke(ke)

    @classmethod
    def at_speeds(
        cls,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        *,
        extrapolate: bool = False,
    ) -> list[RubbingBlade]:
        """The problem at each of many rotor speeds, with K_e = 0."""
        check_blade_and_contact(blade, contact)
        for i, speed in enumerate(speed_hz):
            number(f"speed_hz[{i}]", speed, *SPEED_LIMITS_HZ, "Hz")
        root = np.sqrt(contact.weight_vector(blade.tip_nodes))
        omega, shape = blade.at_speeds(speed_hz, extrapolate=extrapolate)
        arcs, segments, engagement = _pattern(contact)
        damping = np.maximum(blade.damping_ratio, LEAST_DAMPING)
        return [
            cls(w, damping, root[:, None] * v.T, float(s), 0.0, arcs, segments, engagement)
            for s, w, v in zip(speed_hz, omega, shape, strict=True)
        ]

    def with_ke(self, ke: float) -> RubbingBlade:
        """The same at another cutting stiffness."""
        return replace(self, ke=number("ke", ke, 0.0, KE_LIMIT, "N/m"))

    @property
    def permanent(self) -> bool:
        """True when γ = 1 all round."""
        return self.arcs is None and self.engagement is None

    @property
    def tau(self) -> float:
        """Delay: one revolution, s."""
        return 1.0 / self.speed_hz

    @cached_property
    def contact_matrix(self) -> np.ndarray:
        """G, kg^-1, shape (n, n)."""
        return self.contact_shape.T @ self.contact_shape

    @cached_property
    def contact_factor(self) -> np.ndarray:
        """F of full column rank p with F Fᵀ = G, kg^-1/2, shape (n, p): what the tip feels."""
        u, s, _ = np.linalg.svd(self.contact_shape.T, full_matrices=False)
        keep = s > 1e-12 * s.max() if s.max() > 0 else np.zeros(len(s), dtype=bool)
        return u[:, keep] * s[keep]

    def delay_equation(self) -> DelayEquation:
        """In state space zᵀ = (xᵀ ẋᵀ) ([SBL] Eqs. 5 and 20)."""
        n = len(self.omega)
        modulation: Modulation | None = None
        if self.engagement is not None:
            modulation = self.engagement.modulation(self.tau)
        elif self.arcs is not None:
            modulation = Engagement(self.arcs, self.tau)
        return DelayEquation.of_second_order(
            np.eye(n),
            np.diag(2 * self.damping_ratio * self.omega),
            np.diag(self.omega**2),
            self.ke * self.contact_matrix,
            self.tau,
            modulation,
        )


def check_blade_and_contact(blade: Any, contact: Any) -> None:
    """Refuse what is neither, before anything is asked of it.

    Raises
    ------
    InvalidInput
        Naming the field, the type and the remedy.
    """
    if not isinstance(blade, Blade):
        raise InvalidInput("blade", type(blade).__name__, "give a Blade, e.g. read_blade(path)")
    if not isinstance(contact, ContactConfiguration):
        raise InvalidInput(
            "contact",
            type(contact).__name__,
            "give a ContactConfiguration, e.g. ContactConfiguration.at('LE')",
        )


def _pattern(
    contact: ContactConfiguration,
) -> tuple[tuple[Arc, ...] | None, tuple[Segment, ...], FourierEngagement | None]:
    """Arcs, segments and smooth γ of a problem."""
    if contact.permanent:
        return None, (Segment(1.0, True),), None
    return contact.arcs, contact.segments, contact.engagement


def single_state_problem(
    frequency_hz: np.ndarray,
    damping_ratio: np.ndarray,
    mode_shape: np.ndarray,
    weights: np.ndarray,
    speed_hz: float,
    ke: float,
    arcs: list[list[float]] | None = None,
    engagement: FourierEngagement | None = None,
) -> RubbingBlade:
    """A problem from bare arrays (frequencies (n,), damping (n,), mode shape (n, r), weights (r,)).

    Raises
    ------
    InvalidInput
        When the shapes disagree or a number is out of range.
    """
    frequency = vector("frequency_hz", frequency_hz, *FREQUENCY_LIMITS_HZ, "Hz")
    if isinstance(damping_ratio, int | float | np.number):
        damping_ratio = np.full(len(frequency), damping_ratio)
    damping = vector("damping_ratio", damping_ratio, 0.0, LARGEST_DAMPING, "")
    weight = vector("weights", weights, 0.0, WEIGHT_LIMIT, "")
    shape = matrix("mode_shape", mode_shape, len(weight), -AMPLITUDE_LIMIT, AMPLITUDE_LIMIT, "kg^-1/2")
    if not len(frequency) == len(damping) == len(shape):
        raise InvalidInput(
            "mode_shape",
            f"{len(shape)} rows for {len(frequency)} frequencies and {len(damping)} damping ratios",
            "give one row, one frequency and one damping ratio a mode",
        )
    number("speed_hz", speed_hz, *SPEED_LIMITS_HZ, "Hz")
    number("ke", ke, 0.0, KE_LIMIT, "N/m")
    contact = ContactConfiguration({"all": 1.0}, arcs, engagement)
    return RubbingBlade(
        2 * np.pi * frequency,
        np.maximum(damping, LEAST_DAMPING),
        np.sqrt(weight)[:, None] * shape.T,
        float(speed_hz),
        float(ke),
        *_pattern(contact),
    )

"""The abradable liner as plastic bars: what it is made of, and how stiffly it is cut."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sdm_core.errors import InvalidInput
from sdm_core.validation import number, vector

MODULUS_LIMIT = 1e13
LENGTH_LIMIT = 1.0


class Bars(NamedTuple):
    """One bar under each contact node, as the kernel takes them; each of shape (r,).

    Attributes
    ----------
    elastic
        AE/L, N/m.
    plastic
        AK/L, N/m.
    yield_force
        Aσ_Y, N.
    thickness
        L, m.
    """

    elastic: np.ndarray
    plastic: np.ndarray
    yield_force: np.ndarray
    thickness: np.ndarray


@dataclass(frozen=True)
class AbradableLiner:
    """One-dimensional bars with linear hardening, one under each tip node in each angular cell.

    A bar of length L and section A that is shortened by d, of which p is plastic, carries

        F = (AE/L)(d − p) ≥ 0,    F ≤ A(σ_Y + K(p − p₀)/L),

    and yields where it reaches the bound. p is what has been removed; p₀ is p at the beginning of the
    pass, for what a pass leaves is a fresh surface of the same material, not a hardened bar. In a pass that
    yields, both hold with equality, and eliminating p gives the force against the shortening:

        F = Aσ_Y + K_e (d − p₀ − σ_Y L/E),    K_e = A E_T/L,    E_T = EK/(E + K).

    K_e is the specific force coefficient of [SBL] 18. The pass leaves s = p + σ_Y L/E behind, with

        s_j = ε s_{j−1} + (1 − ε) d_j,    ε = E_T/E,    F_j = Aσ_Y + K_e (d_j − s_{j−1}):

    the share ε springs back. As ε → 0 (E ≫ K) that is the delay equation with the offset Aσ_Y, which only
    shifts the position of rest; otherwise the memory fades over several revolutions, e^{−iωτ} − 1 becomes
    (e^{−iωτ} − 1)/(1 − ε e^{−iωτ}), and every critical K_e rises by the factor 1 + ε (`critical_ke_factor`).

    Were hardening to go on over all passes (p₀ = 0 for ever), F would depend on d alone: the liner would be
    a spring of stiffness K_e, and nothing would be left of regeneration.

    Parameters
    ----------
    youngs_modulus_pa, yield_stress_pa, plastic_modulus_pa
        E, σ_Y and K = dσ/dε_p, Pa.
    thickness_m
        L, m.
    axial_width_m
        Width of the strip that a contact node rubs, m, one number or one a contact node.
    contact_length_m
        Length along the circumference over which the tip bears on the liner at an instant (the thickness
        of the tip), m; A is this times the axial width. Where left out it is the length of a cell, and the
        force then depends on how many cells were asked for.
    hardening_restarts
        False lets hardening accumulate over all passes.

    Raises
    ------
    InvalidInput
        For numbers out of range.

    Examples
    --------
    >>> liner = AbradableLiner(4.0e8, 5e4, 2.1e7, 5e-3, axial_width_m=3.5e-3, contact_length_m=8e-4)
    >>> round(liner.elastic_recovery, 3)
    0.05
    >>> [round(ke) for ke in liner.cutting_stiffness(liner.bars(1))]
    [11173]

    References
    ----------
    Plastic bars as a model of abradable removal: Legrand, Batailly, Pierre (2012), reference [3] of [SBL].
    """

    youngs_modulus_pa: float
    yield_stress_pa: float
    plastic_modulus_pa: float
    thickness_m: float
    axial_width_m: float | tuple[float, ...]
    contact_length_m: float | None = None
    hardening_restarts: bool = True

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name, low_open in (
            ("youngs_modulus_pa", True),
            ("yield_stress_pa", False),
            ("plastic_modulus_pa", False),
        ):
            value = number(name, getattr(self, name), 0.0, MODULUS_LIMIT, "Pa", open_low=low_open)
            put(self, name, value)
        put(self, "thickness_m", _length("thickness_m", self.thickness_m))
        if isinstance(self.axial_width_m, int | float | np.number):
            put(self, "axial_width_m", _length("axial_width_m", self.axial_width_m))
        else:
            width = vector("axial_width_m", self.axial_width_m, 0.0, LENGTH_LIMIT, "m", open_low=True)
            put(self, "axial_width_m", tuple(width.tolist()))
        if self.contact_length_m is not None:
            put(self, "contact_length_m", _length("contact_length_m", self.contact_length_m))
        if not isinstance(self.hardening_restarts, bool):
            raise InvalidInput("hardening_restarts", self.hardening_restarts, "give true or false")

    @classmethod
    def from_cutting_stiffness(
        cls,
        ke: float,
        *,
        elastic_recovery: float = 0.05,
        yield_force_n: float = 0.0,
        thickness_m: float = 5e-3,
        axial_width_m: float = 5e-3,
        contact_length_m: float = 1e-3,
    ) -> AbradableLiner:
        """The liner that is cut with a stiffness K_e, N/m, of which a share ε = E_T/E springs back."""
        ke = number("ke", ke, 0.0, 1e15, "N/m", open_low=True)
        recovery = number("elastic_recovery", elastic_recovery, 0.0, 0.999, "", open_low=True)
        section = axial_width_m * contact_length_m
        tangent = ke * thickness_m / section
        return cls(
            tangent / recovery,
            yield_force_n / section,
            tangent / (1 - recovery),
            thickness_m,
            axial_width_m,
            contact_length_m,
        )

    @property
    def tangent_modulus_pa(self) -> float:
        """E_T = EK/(E + K), Pa."""
        e, k = self.youngs_modulus_pa, self.plastic_modulus_pa
        return e * k / (e + k)

    @property
    def elastic_recovery(self) -> float:
        """ε = E_T/E: share of what a pass cuts beyond yielding that springs back."""
        return self.tangent_modulus_pa / self.youngs_modulus_pa

    @property
    def critical_ke_factor(self) -> float:
        """1 + ε: the liner's critical K_e over that of the delay equation, at the same chatter frequency.

        On the boundary K_e λ(ω) = −(1 − ε z)/(1 − z) with z = e^{−iωτ}, |z| = 1, whose real part is
        −(1 + ε)/2 whatever z is; with ε = 0 it is the closed form of the delay equation.
        """
        return 1 + self.elastic_recovery

    def widths(self, nodes: int) -> np.ndarray:
        """Axial width under each of `nodes` contact nodes, m, shape (r,).

        Raises
        ------
        InvalidInput
            When there is another number of widths.
        """
        width = np.atleast_1d(np.asarray(self.axial_width_m, dtype=float))
        if len(width) not in (1, nodes) or (isinstance(self.axial_width_m, tuple) and len(width) != nodes):
            raise InvalidInput(
                "liner.axial_width_m",
                f"{len(width)} numbers",
                f"give one number, or one a contact node: {nodes}",
            )
        return np.broadcast_to(width, nodes).copy()

    def bars(self, nodes: int, cell_length_m: float | None = None) -> Bars:
        """Bars under `nodes` contact nodes.

        Parameters
        ----------
        cell_length_m
            Length of an angular cell along the circumference, m; asked for where the liner has no
            `contact_length_m` of its own.
        """
        along = self.contact_length_m if self.contact_length_m is not None else cell_length_m
        if along is None:
            raise InvalidInput("contact_length_m", None, "give it, or the length of a cell")
        section = self.widths(nodes) * along
        per_length = section / self.thickness_m
        return Bars(
            per_length * self.youngs_modulus_pa,
            per_length * self.plastic_modulus_pa,
            section * self.yield_stress_pa,
            np.full(nodes, self.thickness_m),
        )

    @staticmethod
    def cutting_stiffness(bars: Bars) -> np.ndarray:
        """K_e = A E_T/L of bars, N/m, shape (r,)."""
        return bars.elastic * bars.plastic / (bars.elastic + bars.plastic)


@dataclass(frozen=True)
class Friction:
    """Coulomb friction of the tip that slides on the liner.

    The force on a tip node is μF against the direction in which it slides: the speed of the rim and the
    tip's own tangential velocity together.

    Parameters
    ----------
    coefficient
        μ.
    rotation
        1 where the blade turns towards its positive tangential direction, −1 where it turns the other way. A
        blade file does not tell, and it decides whether friction lowers or raises the critical K_e
        (decision 27), so that it has to be said; NASA rotor 37 takes −1.
    """

    coefficient: float
    rotation: int

    def __post_init__(self) -> None:
        checked = number("friction.coefficient", self.coefficient, 0.0, 10.0, "")
        object.__setattr__(self, "coefficient", checked)
        if isinstance(self.rotation, bool) or self.rotation not in (1, -1):
            raise InvalidInput(
                "friction.rotation", self.rotation, "give 1 (towards positive tangential) or -1"
            )


def per_node(field: str, value: Any, nodes: int, low: float, high: float, unit: str) -> np.ndarray:
    """One number for all contact nodes, or one for each, as an array of shape (r,)."""
    if isinstance(value, int | float | np.number):
        return np.full(nodes, number(field, value, low, high, unit))
    each = vector(field, value, low, high, unit)
    if len(each) != nodes:
        raise InvalidInput(field, f"{len(each)} numbers", f"give one number, or one a contact node: {nodes}")
    return np.array(each)


def _length(field: str, value: Any) -> float:
    return number(field, value, 0.0, LENGTH_LIMIT, "m", open_low=True)

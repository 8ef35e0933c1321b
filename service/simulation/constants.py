"""Constants of liner and casing as they are ordered: what is left out is taken from here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Self

from sdm_core.blade import Blade
from sdm_core.errors import InvalidInput
from sdm_core.time_domain.liner.abradable_liner import AbradableLiner
from sdm_core.time_domain.liner.casing import Casing
from sdm_core.validation import KE_LIMIT, number

USUAL_KE = 1.0e4
"""N/m, in the middle of the stiffnesses that [SBL] looks at."""
USUAL_RADIUS_M = 0.25


@dataclass(frozen=True)
class LinerConstants:
    """Constants of an abradable liner, those left out at values of the order of sprayed abradables.

    Attributes
    ----------
    ke
        K_e of each contact node, N/m, from which the plastic modulus follows; `USUAL_KE` where neither is
        given.
    youngs_modulus_pa, yield_stress_pa, plastic_modulus_pa
        E, σ_Y, K, Pa.
    thickness_m
        Of the liner, m.
    axial_width_m, contact_length_m
        What a contact node rubs: along the axis, and along the circumference at an instant, m.

    Examples
    --------
    >>> constants = LinerConstants(ke=1e4)
    >>> liner = constants.liner()
    >>> [round(ke) for ke in liner.cutting_stiffness(liner.bars(1))]
    [10000]
    """

    ke: float | None = None
    youngs_modulus_pa: float = 1.8e9
    yield_stress_pa: float = 15e6
    plastic_modulus_pa: float | None = None
    thickness_m: float = 5e-3
    axial_width_m: float = 3.4e-3
    contact_length_m: float = 1e-3

    def liner(self) -> AbradableLiner:
        """The liner.

        Raises
        ------
        InvalidInput
            For numbers out of range, and for a K_e that a bar of this section cannot have.
        """
        if self.plastic_modulus_pa is not None:
            if self.ke is not None:
                remedy = "give ke or plastic_modulus_pa: each follows from the other"
                raise InvalidInput("ke", self.ke, remedy)
            return self._with(self.plastic_modulus_pa)
        ke = number("ke", USUAL_KE if self.ke is None else self.ke, 0.0, KE_LIMIT, "N/m", open_low=True)
        elastic = self._with(self.youngs_modulus_pa).bars(1).elastic[0]
        if ke >= elastic:
            raise InvalidInput(
                "ke",
                ke,
                f"give less than {elastic:.6g} N/m, at which the liner springs back whole, or a larger "
                "youngs_modulus_pa or section",
            )
        recovery = ke / elastic
        return self._with(self.youngs_modulus_pa * recovery / (1 - recovery))

    def _with(self, plastic_modulus_pa: float) -> AbradableLiner:
        return AbradableLiner(
            self.youngs_modulus_pa,
            self.yield_stress_pa,
            plastic_modulus_pa,
            self.thickness_m,
            self.axial_width_m,
            self.contact_length_m,
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, given: Mapping[str, Any]) -> Self:
        """From those that are given.

        Raises
        ------
        InvalidInput
            For a name there is not.
        """
        return cls(**_known(cls, given))


@dataclass(frozen=True)
class CasingConstants:
    """Constants of the casing; by default it is pressed oval, 0.1 mm further than the clearance.

    Attributes
    ----------
    clearance_m
        m, one number or one a contact node, leading to trailing edge.
    ovalisation_m, lobes, ovalisation_revolutions
        Amplitude, m, its number of lobes, and the revolutions over which it grows.
    feed_per_revolution_m
        What the casing closes in by each revolution, m.
    radius_m
        m; where left out the blade's tip radius, `USUAL_RADIUS_M` where it says none.
    """

    clearance_m: float | tuple[float, ...] = 1e-4
    ovalisation_m: float = 2e-4
    lobes: int = 2
    ovalisation_revolutions: float = 5.0
    feed_per_revolution_m: float = 0.0
    radius_m: float | None = None

    def casing(self, blade: Blade) -> Casing:
        """The casing round a blade.

        Raises
        ------
        InvalidInput
            For numbers out of range.
        """
        return Casing(
            self.radius_round(blade),
            self.clearance_m,
            self.ovalisation_m,
            self.lobes,
            self.ovalisation_revolutions,
            self.feed_per_revolution_m,
        )

    def radius_round(self, blade: Blade) -> float:
        """Radius of the casing, m."""
        if self.radius_m is not None:
            return self.radius_m
        return USUAL_RADIUS_M if blade.tip_radius_m is None else float(max(blade.tip_radius_m))

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        data = asdict(self)
        if isinstance(self.clearance_m, tuple):
            data["clearance_m"] = list(self.clearance_m)
        return data

    @classmethod
    def from_dict(cls, given: Mapping[str, Any]) -> Self:
        """From those that are given; raises as `LinerConstants.from_dict`."""
        known = _known(cls, given)
        if isinstance(known.get("clearance_m"), list):
            known["clearance_m"] = tuple(known["clearance_m"])
        return cls(**known)


def _known(kind: Any, given: Mapping[str, Any]) -> dict[str, Any]:
    names = [field.name for field in fields(kind)]
    for name, value in given.items():
        if name not in names:
            raise InvalidInput(name, value, f"leave it out: there are {', '.join(names)}")
    return dict(given)

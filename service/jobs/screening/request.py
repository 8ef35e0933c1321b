"""What a screening job is asked, as it is kept in its folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from service.screening.screen import KE_MAX, default_contacts
from service.speeds import Speed, SpeedRange, operating_range


@dataclass(frozen=True)
class Criteria:
    """What a blade under a contact has to meet; None asks nothing.

    Attributes
    ----------
    least_ke
        Of the smallest destabilising K_e, N/m.
    least_margin
        Of that K_e over the liner's, minus 1.
    most_unstable_share
        Of the map.
    """

    least_ke: float | None = None
    least_margin: float | None = None
    most_unstable_share: float | None = None

    def to_dict(self) -> dict[str, float | None]:
        """As JSON."""
        return {
            "least_ke": self.least_ke,
            "least_margin": self.least_margin,
            "most_unstable_share": self.most_unstable_share,
        }

    def missed(self, row: Mapping[str, Any]) -> list[str] | None:
        """Names of the criteria that a result misses; None where nothing is asked.

        A blade with no crossing up to ke_max has its smallest K_e above that. What is not proven does not
        meet a bound on K_e.
        """
        asked = [name for name, bound in self.to_dict().items() if bound is not None]
        if not asked:
            return None
        smallest, ke_max, liner = row["smallest_unstable_ke"], row["ke_max"], row["ke_liner"]
        proven = bool(row["proven"])
        least = ke_max if smallest is None else smallest
        met = {
            "least_ke": proven and self.least_ke is not None and least >= self.least_ke,
            "least_margin": proven
            and self.least_margin is not None
            and liner is not None
            and least >= (1.0 + self.least_margin) * liner,
            "most_unstable_share": self.most_unstable_share is not None
            and row["unstable_share"] is not None
            and row["unstable_share"] <= self.most_unstable_share,
        }
        return [name for name in asked if not met[name]]


@dataclass(frozen=True)
class ScreeningRequest:
    """Criteria common to all blades of a job.

    Attributes
    ----------
    contacts
        By name; None is leading edge, trailing edge and both of each blade.
    speed_range, speed_unit
        Low and high in ``Hz`` or as ``ratio`` to each blade's first frequency; None is each blade's own.
    ke_max, ke_liner
        N/m.
    map_shape
        Speeds and stiffnesses of each map; None is the usual.
    policy, alpha
        Of the maps.
    model
        Identifier of the surrogate, fixed when the job is accepted; None where none is used.
    models_folder
        Where that is; None is the shipped one.
    blades_per_chunk
        Blades computed and stored together.
    """

    contacts: Mapping[str, ContactConfiguration] | None = None
    speed_range: tuple[float, float] | None = None
    speed_unit: str = "Hz"
    ke_max: float = KE_MAX
    ke_liner: float | None = None
    map_shape: tuple[int, int] | None = None
    policy: str = "auto"
    alpha: float | None = None
    criteria: Criteria = field(default_factory=Criteria)
    model: str | None = None
    models_folder: str | None = None
    blades_per_chunk: int = 1

    def contacts_of(self, blade: Blade) -> Mapping[str, ContactConfiguration]:
        """The contacts of a blade, by name."""
        return default_contacts(blade) if self.contacts is None else self.contacts

    def speeds(self) -> SpeedRange | None:
        """The range asked for; None is each blade's own."""
        if self.speed_range is None:
            return None
        low, high = (Speed(value, self.speed_unit) for value in self.speed_range)
        return SpeedRange(low, high, f"speed_range_{self.speed_unit.lower()}")

    def range_of(self, blade: Blade) -> tuple[float, float]:
        """The ends of a blade's speed range, Hz.

        Raises
        ------
        InvalidInput, OutOfSpeedRange
            When the range does not fit it, or none is given and it has no usual one.
        """
        asked = self.speeds()
        return operating_range(blade) if asked is None else asked.for_blade(blade)

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        contacts = self.contacts
        return {
            "schema": "rubscreen/screening-request/1",
            "contacts": None if contacts is None else {n: c.to_dict() for n, c in contacts.items()},
            "speed_range": None if self.speed_range is None else list(self.speed_range),
            "speed_unit": self.speed_unit,
            "ke_max": self.ke_max,
            "ke_liner": self.ke_liner,
            "map_shape": None if self.map_shape is None else list(self.map_shape),
            "policy": self.policy,
            "alpha": self.alpha,
            "criteria": self.criteria.to_dict(),
            "model": self.model,
            "models_folder": self.models_folder,
            "blades_per_chunk": self.blades_per_chunk,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> ScreeningRequest:
        """From the JSON of `to_dict`."""
        contacts, speed_range, shape = data["contacts"], data["speed_range"], data["map_shape"]
        named = None
        if contacts is not None:
            named = {n: ContactConfiguration.from_dict(c) for n, c in contacts.items()}
        return cls(
            contacts=named,
            speed_range=None if speed_range is None else (speed_range[0], speed_range[1]),
            speed_unit=data["speed_unit"],
            ke_max=data["ke_max"],
            ke_liner=data["ke_liner"],
            map_shape=None if shape is None else (shape[0], shape[1]),
            policy=data["policy"],
            alpha=data["alpha"],
            criteria=Criteria(**data["criteria"]),
            model=data["model"],
            models_folder=data["models_folder"],
            blades_per_chunk=data["blades_per_chunk"],
        )

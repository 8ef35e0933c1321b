"""Isotropic elastic materials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sdm_core.errors import InvalidInput
from sdm_core.validation import number


@dataclass(frozen=True)
class Material:
    """Isotropic and linearly elastic.

    Parameters
    ----------
    youngs_modulus
        E, Pa.
    poisson_ratio
        ν, −1 < ν < 0.5.
    density
        ρ, kg/m³.

    Examples
    --------
    >>> round(Material(108e9, 0.34, 4400.0).shear_modulus / 1e9, 2)
    40.3
    """

    youngs_modulus: float
    poisson_ratio: float
    density: float

    def __post_init__(self) -> None:
        # The ranges tell Pa from MPa or GPa, and kg/m³ from t/mm³.
        checked = {
            "youngs_modulus": number("material.E", self.youngs_modulus, 1e7, 2e12, "Pa"),
            "poisson_ratio": number("material.nu", self.poisson_ratio, -0.99, 0.495, ""),
            "density": number("material.rho", self.density, 10.0, 3e4, "kg/m³"),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def shear_modulus(self) -> float:
        """μ = E / (2(1 + ν)), Pa."""
        return self.youngs_modulus / (2 * (1 + self.poisson_ratio))

    @property
    def lame_lambda(self) -> float:
        """λ = Eν / ((1 + ν)(1 − 2ν)), Pa."""
        e, nu = self.youngs_modulus, self.poisson_ratio
        return e * nu / ((1 + nu) * (1 - 2 * nu))

    @classmethod
    def from_dict(cls, data: Any) -> Material:
        """From the blade file's ``{"E": …, "nu": …, "rho": …}``."""
        if not isinstance(data, Mapping):
            raise InvalidInput(
                "material", data, 'give an object such as {"E": 108e9, "nu": 0.34, "rho": 4400}'
            )
        for key in ("E", "nu", "rho"):
            if data.get(key) is None:
                raise InvalidInput(f"material.{key}", "missing", "give E in Pa, nu, and rho in kg/m³")
        return cls(data["E"], data["nu"], data["rho"])

    def to_dict(self) -> dict[str, float]:
        return {"E": self.youngs_modulus, "nu": self.poisson_ratio, "rho": self.density}


# Ti-6Al-4V, as DESIGN has it for NASA rotor 37.
TITANIUM = Material(108e9, 0.34, 4400.0)

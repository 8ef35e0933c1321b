"""Solid finite elements of a rotating blade: equilibrium at speed and vibration about it."""

from sdm_core.blade.finite_elements.equilibrium import Equilibrium, equilibrium
from sdm_core.blade.finite_elements.material import TITANIUM, Material
from sdm_core.blade.finite_elements.solid_model import SolidModel

__all__ = ["TITANIUM", "Equilibrium", "Material", "SolidModel", "equilibrium"]

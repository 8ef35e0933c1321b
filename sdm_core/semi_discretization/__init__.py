"""Semi-discretization of the monodromy operator ([SBL] 2.3)."""

from sdm_core.semi_discretization.converged import Converged, ConvergedMultiplier
from sdm_core.semi_discretization.dense import Averaged

__all__ = ["Averaged", "Converged", "ConvergedMultiplier"]

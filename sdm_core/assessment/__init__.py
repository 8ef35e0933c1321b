"""What experts ask of a rubbing blade, beyond whether it is stable."""

from sdm_core.assessment.assessment import Assessment, assess
from sdm_core.assessment.margins import OperatingPoint
from sdm_core.assessment.shape_gradient import shape_sensitivities
from sdm_core.assessment.uncertain_blade import Uncertainty

__all__ = ["Assessment", "OperatingPoint", "Uncertainty", "assess", "shape_sensitivities"]

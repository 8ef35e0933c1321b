"""Semi-discretization of the monodromy operator ([SBL] 2.3).

`Averaged` is the method as the paper writes it, dense. `StructuredAveraged` (the same multipliers),
`Linear` and `Gauss` (any even order to 12) work on the contact history only, in O(N) memory.
`Converged` chooses the steps.
"""

from sdm_core.semi_discretization.averaged import StructuredAveraged
from sdm_core.semi_discretization.converged import Converged, ConvergedMultiplier
from sdm_core.semi_discretization.dense import Averaged
from sdm_core.semi_discretization.gauss import Gauss
from sdm_core.semi_discretization.linear import Linear
from sdm_core.semi_discretization.structured import Structured

__all__ = [
    "Averaged",
    "Converged",
    "ConvergedMultiplier",
    "Gauss",
    "Linear",
    "Structured",
    "StructuredAveraged",
]

"""A question with a known answer, asked before a model answers others and whenever readiness is."""

from __future__ import annotations

import numpy as np

from sdm_core.blade import Blade, ModalState
from sdm_core.contact import ContactConfiguration
from service.answerer import Answerer
from service.rest.errors import NotReady
from training.answers import PointAnswers

# One mode: the smallest destabilising K_e is 2ξ(1 + ξ)ω² = 790 N/m. The first point lies below it, the
# second deep inside a lobe.
_BLADE = Blade("self-check", ("TIP",), 1e-3, [ModalState(0.0, np.array([100.0]), np.array([[1.0]]))])
_CONTACT = ContactConfiguration.at("TIP")
_SPEED_HZ, _KE = np.array([40.0, 40.0]), np.array([400.0, 40000.0])
_STABLE = [1.0, 0.0]


def self_check(answerer: Answerer, policy: str, alpha: float | None = None) -> PointAnswers:
    """The answer to the question.

    Raises
    ------
    NotReady
        When it is not the known one.
    """
    found = answerer.points(_BLADE, _CONTACT, _SPEED_HZ, _KE, policy, alpha)
    if found.stable.tolist() != _STABLE:
        remedy = f"it must be {_STABLE}: activate another model, or install the service again"
        raise NotReady("self_check", f"{found.stable.tolist()} under {policy}", remedy)
    return found

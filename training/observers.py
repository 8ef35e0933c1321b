"""Who is told of the answers a screener gives; what an observer raises is logged and costs no answer."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration
from training.answers import CertificateUsed
from training.confident_answers import ConfidentAnswers
from training.exact_answers import ExactAnswers

logger = logging.getLogger("rubscreen.training")

OnExact = Callable[[ExactAnswers], None]
OnConfident = Callable[[ConfidentAnswers], None]


@dataclass(frozen=True)
class Observers:
    """Observers of a screener's answers.

    Attributes
    ----------
    on_exact
        Told of every exact answer given; None is nobody.
    on_confident
        Told of every verdict that the surrogate gave under a certificate. A boundary without a crossing is
        one, "stable at `ke_max`"; a crossing is none, since nothing is certified of where it lies.
    """

    on_exact: OnExact | None = None
    on_confident: OnConfident | None = None

    def exact(self, made: Callable[..., ExactAnswers], *found: Any) -> None:
        """Pass exact answers on, made of `found` only where somebody wants them."""
        if self.on_exact is not None:
            _passed(self.on_exact, made, *found)

    def confident(
        self,
        model: str | None,
        certificate: CertificateUsed | None,
        blade: Blade,
        contact: ContactConfiguration,
        speed_hz: np.ndarray,
        ke: np.ndarray | float,
        stable: np.ndarray | float,
    ) -> None:
        """Pass the surrogate's verdicts on; a number in place of an array counts for all of them."""
        if self.on_confident is None or model is None or certificate is None or not len(speed_hz):
            return
        at = np.broadcast_to(ke, speed_hz.shape)
        said = np.broadcast_to(np.asarray(stable) == 1.0, speed_hz.shape)
        found = (blade, contact, speed_hz, at, said, model, certificate.alpha)
        _passed(self.on_confident, ConfidentAnswers, *found)


def _passed(observer: Callable[[Any], None], made: Callable[..., Any], *found: Any) -> None:
    try:
        observer(made(*found))
    except Exception:
        logger.exception("answers could not be passed on")

"""What the surrogate answered unverified under a certificate, for whoever wants to hold it to that."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sdm_core.blade import Blade
from sdm_core.contact import ContactConfiguration


@dataclass(frozen=True)
class ConfidentAnswers:
    """Verdicts of one model on one blade in one contact, under one certified rate.

    Attributes
    ----------
    speed_hz, ke
        Hz and N/m, shape (m,) each.
    stable
        The verdicts, shape (m,), bool.
    model
        Identifier of the model.
    alpha
        Rate of unstable points among those answered stable that the certificate bounds.
    """

    blade: Blade
    contact: ContactConfiguration
    speed_hz: np.ndarray
    ke: np.ndarray
    stable: np.ndarray
    model: str
    alpha: float

    def __len__(self) -> int:
        return len(self.speed_hz)

    def drawn(self, count: int, rng: np.random.Generator) -> ConfidentAnswers:
        """At most `count` of them, every one as likely as another.

        Left out is K_e = 0, where every blade is stable: a map's first row would be held to the certificate
        and say nothing of it.

        Examples
        --------
        >>> from sdm_core.blade import example_blade
        >>> at = np.arange(5.0)
        >>> answers = ConfidentAnswers(
        ...     example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), at + 100, at, at < 3, "m", 1e-3
        ... )
        >>> sorted(answers.drawn(9, np.random.default_rng(0)).ke)
        [np.float64(1.0), np.float64(2.0), np.float64(3.0), np.float64(4.0)]
        """
        rows = np.flatnonzero(self.ke > 0)
        if len(rows) > count:
            rows = rng.choice(rows, count, replace=False)
        return replace(self, speed_hz=self.speed_hz[rows], ke=self.ke[rows], stable=self.stable[rows])

"""Kriging of the Surrogate Modeling Toolbox (SMT), by partial least squares: its method for many inputs."""

from __future__ import annotations

import contextlib
import io

import numpy as np
from smt.surrogate_models import KPLS

_AT_ONCE = 2_000


class SmtKpls:
    """KPLS (Bouhlel et al., *Struct. Multidiscip. Optim.* 53, 2016) with its noise learnt."""

    def __init__(self, components: int = 4) -> None:
        self.components = components

    def fit(self, x: np.ndarray, y: np.ndarray) -> SmtKpls:
        self.kriging = KPLS(
            n_comp=self.components, eval_noise=True, n_start=3, print_global=False, seed=2013, corr="matern32"
        )
        self.kriging.set_training_values(x, y)
        with contextlib.redirect_stdout(io.StringIO()):  # it prints every matrix it cannot factorise
            self.kriging.train()
        return self

    def predict(self, x: np.ndarray) -> np.ndarray:
        parts = [self.kriging.predict_values(x[i : i + _AT_ONCE]) for i in range(0, len(x), _AT_ONCE)]
        return np.concatenate(parts).ravel()

    def spread(self, x: np.ndarray) -> np.ndarray:
        """Standard deviation of the process."""
        parts = [self.kriging.predict_variances(x[i : i + _AT_ONCE]) for i in range(0, len(x), _AT_ONCE)]
        return np.sqrt(np.maximum(np.concatenate(parts).ravel(), 0.0))

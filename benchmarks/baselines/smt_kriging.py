"""Kriging of the Surrogate Modeling Toolbox (SMT)."""

from __future__ import annotations

import contextlib
import io

import numpy as np
from smt.surrogate_models import KRG

_AT_ONCE = 100  # larger pieces do not fit the cache: five times slower


class SmtKriging:
    """KRG, Matérn 3/2 with a length for each input and its noise learnt, from one start.

    Of its family the most accurate here: KPLS, which has fewer lengths to learn, is wrong twice as often.
    """

    def fit(self, x: np.ndarray, y: np.ndarray) -> SmtKriging:
        self.kriging = KRG(corr="matern32", eval_noise=True, n_start=1, print_global=False, seed=2013)
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

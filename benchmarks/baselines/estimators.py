"""The estimators of scikit-learn and SMT, set as one who knows them would set them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import minimize
from sklearn.compose import TransformedTargetRegressor
from sklearn.ensemble import (
    HistGradientBoostingClassifier,
    HistGradientBoostingRegressor,
    RandomForestClassifier,
    RandomForestRegressor,
)
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Kernel, Matern, WhiteKernel
from sklearn.neural_network import MLPClassifier, MLPRegressor
from sklearn.preprocessing import StandardScaler

_SEED, _TREES = 2013, 100
_AT_ONCE = 2_000
_LIKELIHOOD_STEPS = 40


def forest(rows: int) -> RandomForestRegressor:
    return RandomForestRegressor(_TREES, max_features=1 / 3, min_samples_leaf=2, random_state=_SEED)


def forest_classifier(rows: int) -> RandomForestClassifier:
    return RandomForestClassifier(_TREES, max_features=1 / 3, min_samples_leaf=2, random_state=_SEED)


def disagreement_of_trees(fitted: RandomForestRegressor, x: np.ndarray) -> np.ndarray:
    """Standard deviation over the trees."""
    narrow = x.astype(np.float32)
    return np.std([tree.predict(narrow) for tree in fitted.estimators_], axis=0)


def boosted(rows: int) -> HistGradientBoostingRegressor:
    return HistGradientBoostingRegressor(
        max_iter=1000, learning_rate=0.06, max_leaf_nodes=31, early_stopping=True, random_state=_SEED
    )


def boosted_classifier(rows: int) -> HistGradientBoostingClassifier:
    return HistGradientBoostingClassifier(
        max_iter=1000, learning_rate=0.06, max_leaf_nodes=31, early_stopping=True, random_state=_SEED
    )


def _mlp_settings(rows: int) -> dict[str, Any]:
    """Of our network's size, in batches so small that few rows give steps enough, until it gains no more."""
    return {
        "hidden_layer_sizes": (192, 192, 192),
        "batch_size": int(np.clip(rows // 50, 16, 256)),
        "early_stopping": True,
        "n_iter_no_change": 10,
        "max_iter": 80,
        "random_state": _SEED,
    }


def mlp(rows: int) -> TransformedTargetRegressor:
    """Fitted to the standardised target: it starts near the mean, and corrections are small numbers."""
    return TransformedTargetRegressor(MLPRegressor(**_mlp_settings(rows)), transformer=StandardScaler())


def mlp_classifier(rows: int) -> MLPClassifier:
    return MLPClassifier(**_mlp_settings(rows))


def _short_search(
    objective: Callable[..., Any], start: np.ndarray, bounds: np.ndarray
) -> tuple[np.ndarray, float]:
    """L-BFGS-B as scikit-learn has it, for 40 steps: more changes the likelihood little and takes minutes."""
    found = minimize(
        objective, start, method="L-BFGS-B", jac=True, bounds=bounds, options={"maxiter": _LIKELIHOOD_STEPS}
    )
    return found.x, found.fun


class GaussianProcess:
    """Matérn 3/2 with a length for each input.

    The likelihood's gradient holds n²·f numbers, 8.6 GB for 6,000 labels and 30 inputs: lengths and noise are
    learnt on the first 500 labels, and the process is then conditioned on all. The likelihood has several
    optima, of which a poor one doubles the errors: the best of three starts is taken.
    """

    def __init__(self, learnt_on: int = 500, starts: tuple[float, ...] = (1.0, 5.0, 30.0)) -> None:
        self.learnt_on, self.starts = learnt_on, starts

    def fit(self, x: np.ndarray, y: np.ndarray) -> GaussianProcess:
        self.middle, self.scale = y.mean(), y.std()
        small, z = slice(self.learnt_on), (y - self.middle) / self.scale
        learnt = [
            GaussianProcessRegressor(_kernel(x.shape[1], length), optimizer=_short_search).fit(
                x[small], z[small]
            )
            for length in self.starts
        ]
        best = max(learnt, key=lambda process: process.log_marginal_likelihood_value_)
        self.process = GaussianProcessRegressor(best.kernel_, optimizer=None).fit(x, z)
        return self

    def predict(self, x: np.ndarray) -> np.ndarray:
        parts = [self.process.predict(x[i : i + _AT_ONCE]) for i in range(0, len(x), _AT_ONCE)]
        return self.middle + self.scale * np.concatenate(parts)

    def spread(self, x: np.ndarray) -> np.ndarray:
        """Standard deviation of the process."""
        parts = [
            self.process.predict(x[i : i + _AT_ONCE], return_std=True)[1] for i in range(0, len(x), _AT_ONCE)
        ]
        return self.scale * np.concatenate(parts)


def _kernel(inputs: int, length: float) -> Kernel:
    matern = Matern(np.full(inputs, length), (0.1, 1e3), nu=1.5)
    return ConstantKernel(1.0, (1e-2, 1e3)) * matern + WhiteKernel(0.05, (1e-6, 1.0))
